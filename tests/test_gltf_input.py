"""Files that are wrong: each is refused with a message that names the thing, whatever its bytes."""

from __future__ import annotations

import copy
import json
import math
import struct
import tracemalloc
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gltf_avatars import EXTENSIONS, STYLES, Style, make_avatar
from gltf_independent import Scene
from sixpoint.errors import FormatError
from sixpoint.formats import load, load_avatar, save
from sixpoint.formats.gltf.builder import Builder

Change = Callable[[dict[str, Any]], Any]


def glb(content: Any, binary: bytes = b"") -> bytes:
    """A GLB of any JSON."""
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if binary:
        chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def changed(name: str, change: Change) -> bytes:
    """An avatar whose JSON was changed."""
    scene = Scene(make_avatar(name))
    change(scene.json)
    return glb(scene.json, scene.binary)


def set_in(*path: Any) -> Change:
    """Set a value: keys and indices, the value last."""

    def change(content: dict[str, Any]) -> None:
        *keys, last, value = path
        for key in keys:
            content = content[key]
        content[last] = value  # type: ignore[index]

    return change


def drop_bones(content: dict[str, Any]) -> None:
    """Two bones leave a humanoid map."""
    bones = content["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]
    del bones["leftHand"], bones["head"]


def cycle(content: dict[str, Any]) -> None:
    """A node that is its own grandparent, and hangs on nothing else."""
    content["nodes"][0]["children"] = []
    content["nodes"][5]["children"] = [1]


def draco(content: dict[str, Any]) -> None:
    """Draco, not required."""
    primitive = content["meshes"][0]["primitives"][0]
    primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}


def two_bodies(content: dict[str, Any]) -> None:
    """A second skeleton beside the first."""
    first = len(content["nodes"])
    content["nodes"] += [{"name": "other", "children": [first + 1]}, {"name": "other bone"}]
    content["skins"].append({"joints": [first + 1], "name": "second"})
    content["scenes"][0]["nodes"].append(first)


WRONG: dict[str, tuple[str, Change, str]] = {
    # name: style, change, what the message must hold
    "missing bones": ("vrm1", drop_bones, r"VRM 1\.0.*lacks required bones: head, leftHand"),
    "empty map": (
        "vrm0",
        set_in("extensions", "VRM", "humanoid", {}),
        "lacks required bones: hips, spine",
    ),
    "no VRM": ("vrm0", lambda c: c.pop("extensions"), "this .vrm is no VRM.*call it .glb"),
    "bone on no node": (
        "vrm0",
        set_in("extensions", "VRM", "humanoid", "humanBones", 3, "node", 999),
        r"nodes that do not exist: neck \(node 999\)",
    ),
    "bone twice": (
        "vrm1",
        set_in("extensions", "VRMC_vrm", "humanoid", "humanBones", "head", {"node": 1}),
        r"hips and head are the same nodes\[1\] 'hips'",
    ),
    "lost buffer": (
        "vrm1",
        set_in("buffers", 0, "uri", "gone.bin"),
        r"buffers\[0\].*'gone.bin'.*no such file",
    ),
    "buffer from the net": ("vrm1", set_in("buffers", 0, "uri", "https://x.org/a.bin"), "only files beside"),
    "absolute buffer": ("vrm1", set_in("buffers", 0, "uri", "/etc/passwd"), "only files beside"),
    "bad data uri": ("vrm1", set_in("buffers", 0, "uri", "data:;base64,!!"), "data URI is damaged"),
    "long buffer": (
        "vrm1",
        set_in("buffers", 0, "byteLength", 10**9),
        r"buffers\[0\] is cut: 1000000000 bytes",
    ),
    "long view": ("vrm1", set_in("bufferViews", 2, "byteLength", 10**9), r"bufferViews\[2\] reaches to byte"),
    "long accessor": (
        "vrm1",
        set_in("accessors", 0, "count", 10**6),
        r"accessors\[0\] \(.*\) reaches beyond",
    ),
    "accessor type": (
        "vrm1",
        set_in("accessors", 0, "type", "VEC2"),
        r"accessors\[0\] \(vertices.*must be VEC3",
    ),
    "accessor kind": ("vrm1", set_in("accessors", 0, "componentType", 1), r"accessors\[0\].componentType"),
    "sparse": (
        "vrm1",
        set_in("accessors", 0, "sparse", {"count": 1}),
        r"accessors\[0\].*sparse: not supported",
    ),
    "draco": ("vrm1", draco, r"Draco.*not supported"),
    "draco required": (
        "vrm1",
        set_in("extensionsRequired", ["KHR_draco_mesh_compression"]),
        "Draco.*which the file requires: not supported",
    ),
    "meshopt": (
        "vrm1",
        set_in("bufferViews", 2, "extensions", {"EXT_meshopt_compression": {"buffer": 0}}),
        r"accessors\[0\].*meshopt.*not supported",
    ),
    "unknown required": ("vrm1", set_in("extensionsRequired", ["ACME_secret"]), "ACME_secret.*requires"),
    "negative scale": (
        "vrm1",
        set_in("nodes", 3, "scale", [-1, 1, 1]),
        r"nodes\[3\] 'chest'.*negative \(-1 1 1\)",
    ),
    "uneven scale": ("vrm1", set_in("nodes", 3, "scale", [1, 2, 1]), r"'chest'.*not uniform"),
    "zero scale": ("vrm1", set_in("nodes", 3, "scale", [0, 0, 0]), r"'chest'.*zero"),
    "sheared": (
        "vrm1",
        lambda c: c["nodes"][3].update(matrix=[1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
        r"nodes\[3\] 'chest' is sheared",
    ),
    "mirrored matrix": (
        "vrm1",
        lambda c: c["nodes"][3].update(matrix=[-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
        r"'chest'.*negative",
    ),
    "no quaternion": ("vrm1", set_in("nodes", 3, "rotation", [0, 0, 0, 0]), r"'chest' is no quaternion"),
    "NaN node": ("vrm1", set_in("nodes", 3, "translation", [0, math.nan, 0]), "NaN is no number"),
    "huge node": ("vrm1", set_in("nodes", 3, "translation", [0, 1e300, 0]), r"nodes\[3\].translation\[1\]"),
    "cycle": ("vrm1", cycle, r"cycle: nodes\[\d+\] '\w+' is its own ancestor"),
    "two parents": ("vrm1", set_in("nodes", 0, "children", [1, 4]), r"nodes\[4\] 'neck' is a child of both"),
    "no such child": (
        "vrm1",
        set_in("nodes", 0, "children", [77]),
        r"children\[0\]: nodes\[77\] does not exist",
    ),
    "no nodes": ("cesium", lambda c: [c.pop(k) for k in ("nodes", "scenes", "scene", "skins")], "no nodes"),
    "several skins": ("cesium", two_bodies, r"2 separate skeletons: skins\[0\], skins\[1\] 'second'"),
    "joint twice": ("cesium", set_in("skins", 0, "joints", [1, 1]), r"skins\[0\] has a joint twice"),
    "few matrices": (
        "cesium",
        lambda c: c["skins"][0]["joints"].append(0),
        "21 inverse bind matrices.*22 joints",
    ),
    "half a skin": (
        "cesium",
        lambda c: c["meshes"][0]["primitives"][0]["attributes"].pop("WEIGHTS_0"),
        "only one of JOINTS_0 and WEIGHTS_0",
    ),
    "version": ("vrm1", set_in("asset", {"version": "1.0"}), "glTF version 1.0"),
    "no asset": ("vrm1", lambda c: c.pop("asset"), "'asset' is missing"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_named(name, tmp_path):
    """File and thing are in the message."""
    style, change, message = WRONG[name]
    path = tmp_path / ("wrong" + EXTENSIONS.get(style, ".glb"))
    path.write_bytes(changed(style, change))
    with pytest.raises(FormatError, match=f"(?s)wrong.*(?:{message})"):
        load_avatar(path)


CUTS = {
    "empty": (lambda d: b"", "empty"),
    "text": (lambda d: b"hello world, this is text", "no glTF file"),
    "head": (lambda d: d[:15], "15 bytes do not even hold"),
    "body": (lambda d: d[:5000], "GLB is cut: .* bytes are declared, the file has 5000"),
    "version": (lambda d: d[:4] + struct.pack("<I", 1) + d[8:], "GLB version 1"),
    "chunk": (lambda d: d[:12] + struct.pack("<I", 10**8) + d[16:], "chunk 0 at byte 12 declares 100000000"),
    "kind": (lambda d: d[:16] + b"XXXX" + d[20:], "first chunk of the GLB is not JSON"),
    "json": (lambda d: d[:20] + b"X" + d[21:], "JSON is damaged at character 0"),
    "utf-8": (lambda d: d[:30] + b"\xff" + d[31:], "not UTF-8"),
    "no binary": (
        lambda d: d[:8] + struct.pack("<I", 20 + struct.unpack_from("<I", d, 12)[0]) + d[12:],
        "no BIN",
    ),
}


@pytest.mark.parametrize("name", CUTS)
def test_damaged_containers(name, tmp_path):
    """Where a GLB is cut or is none."""
    change, message = CUTS[name]
    path = tmp_path / "cut.glb"
    path.write_bytes(change(make_avatar("vrm1")))
    with pytest.raises(FormatError, match=message):
        load_avatar(path)
    with pytest.raises(FormatError, match=r"no such file"):
        load_avatar(tmp_path / "none.glb")
    with pytest.raises(FormatError, match=r"folder"):
        load_avatar(tmp_path)


def test_numbers_that_are_none_are_found(tmp_path):
    """NaN among vertices, weights, matrices and keys: the accessor and the element are named."""
    avatar = make_avatar("vrm1")
    scene = Scene(avatar)
    for kind, index in (
        ("vertices", scene.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"]),
        ("WEIGHTS_0", scene.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]),
        ("inverse bind matrices", scene.json["skins"][0]["inverseBindMatrices"]),
    ):
        data = bytearray(scene.binary)
        view = scene.json["bufferViews"][scene.json["accessors"][index]["bufferView"]]
        data[view["byteOffset"] : view["byteOffset"] + 4] = struct.pack("<f", math.nan)
        path = tmp_path / "nan.vrm"
        path.write_bytes(glb(scene.json, bytes(data)))
        with pytest.raises(FormatError, match=rf"accessors\[{index}\] \({kind}.*element 0 is not finite"):
            load_avatar(path)


@pytest.mark.parametrize(
    ("times", "values", "message"),
    [
        ([0.0, 1.0, 0.5], np.tile([0, 0, 0, 1.0], (3, 1)), "must not go back in time"),
        ([0.0, 1.0], np.tile([0, 0, 0, 1.0], (3, 1)), "3 values for 2 keys"),
        ([0.0, math.nan], np.tile([0, 0, 0, 1.0], (2, 1)), "key times of rotation of .* not finite"),
        ([0.0, 1.0], np.zeros((2, 3)), "must be VEC4"),
        ([0.0, 0.1, 9e9], np.tile([0, 0, 0, 1.0], (3, 1)), "frames are too many"),
    ],
)
def test_wrong_keys(times, values, message, tmp_path):
    """Animations that cannot be sampled."""

    def add(builder: Builder, nodes: dict[str, int]) -> None:
        sampler = {"input": builder.add_accessor(times), "output": builder.add_accessor(values)}
        channel = {"sampler": 0, "target": {"node": nodes["head"], "path": "rotation"}}
        builder.add("animations", {"name": "nod", "samplers": [sampler], "channels": [channel]})
        for accessor in builder.content["accessors"]:
            accessor.pop("min", None)

    path = tmp_path / "keys.glb"
    path.write_bytes(make_avatar(Style(more=add)))
    with pytest.raises(FormatError, match=message):
        load(path)


def test_a_rig_that_is_no_human_still_moves(tmp_path):
    """``load`` reads any rig; only an avatar has to be a human."""
    nodes = [{"name": "base", "children": [1]}, {"translation": [0, 1, 0]}]
    path = tmp_path / "lamp.gltf"
    path.write_text(json.dumps({"asset": {"version": "2.0"}, "nodes": nodes}))
    motion = load(path)
    assert motion.skeleton.names == ("base", "node_1")
    with pytest.raises(FormatError, match="roles were not found"):
        load_avatar(path)


def test_a_mapping_names_what_is_not_found(tmp_path):
    """Roles of a rig without names and structure can be given."""
    path = tmp_path / "mute.glb"
    path.write_bytes(make_avatar(Style(names=False, mesh="none")))
    avatar = load_avatar(path, mapping={"l_wrist": "node_9"})
    assert "mapping" in avatar.figure.roles.found_by
    with pytest.raises(FormatError, match="rig lacks: l_wrist = 'nowhere'"):
        load_avatar(path, mapping={"l_wrist": "nowhere"})


def test_a_file_of_100_megabytes_is_not_copied(tmp_path):
    """Reading an avatar beside 100 MB of other data takes the file once, and little more."""
    heavy = 100_000_000

    def add(builder: Builder, nodes: dict[str, int]) -> None:
        builder.add("images", {"bufferView": builder.add_view(bytes(heavy)), "mimeType": "image/png"})

    path = tmp_path / "heavy.glb"
    path.write_bytes(make_avatar(Style(more=add)))
    tracemalloc.start()
    avatar = load_avatar(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(avatar.figure.skeleton) == 21
    assert peak < 1.1 * heavy


# --- any bytes -----------------------------------------------------------------------------------


def _animated(name: str) -> bytes:
    """An avatar with a short animation of its own."""

    def add(builder: Builder, nodes: dict[str, int]) -> None:
        times = builder.add_accessor([0.0, 0.5, 1.0], bounds=True)
        channels, samplers = [], []
        for k, (bone, kind, width) in enumerate((("head", "rotation", 4), ("hips", "translation", 3))):
            samplers.append({"input": times, "output": builder.add_accessor(np.eye(3, width))})
            channels.append({"sampler": k, "target": {"node": nodes[bone], "path": kind}})
        builder.add("animations", {"samplers": samplers, "channels": channels})

    return make_avatar(Style(**(vars(STYLES[name]) | {"more": add})))


SEEDS = {name: _animated(name) for name in STYLES}
JSON_VALUES = st.sampled_from(
    [None, True, -1, 0, 1, 2, 7, 300, 2**31, 10**30, 0.5, 1e308, math.inf, "", "x", "STEP", "CUBICSPLINE"]
    + [[], {}, [0, 0, 0], [0] * 16, [1e9, 1e9, 1e9], 5121, 5123, 5126, "VEC3", "VEC4", "SCALAR", "MAT4", "/x"]
)


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of everything inside a JSON value."""
    if path:
        yield path
    if isinstance(value, (dict, list)):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from places(value[key], (*path, key))


def survives(data: bytes, path: Path) -> None:
    """Reading and writing gives a valid result or a FormatError."""
    path.write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            motion = load(path)
            assert np.all(np.isfinite(motion.positions))
            avatar = load_avatar(path)
            colours = avatar.appearance
            assert colours is None or len(colours.colours) == len(avatar.figure.shape.vertices)
            save(avatar.read_motion(), path.with_name("again.glb"), avatar=avatar, force=True)
            save(avatar.read_motion(), path.with_name("again.vrma"), avatar=avatar, force=True)
        except FormatError as error:
            assert str(path.parent) in str(error)
            return
    back = load(path.with_name("again.glb"))
    assert back.skeleton.names == motion.skeleton.names


FUZZ = settings(
    max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)


@FUZZ
@given(
    st.sampled_from(sorted(SEEDS)),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), max_size=12),
    st.data(),
)
def test_any_bytes_are_read_or_refused(tmp_path, name, changes, draw):
    """Bytes that are changed anywhere, and files that are cut anywhere."""
    data = bytearray(SEEDS[name])
    for place, value in changes:
        data[int(place * (len(data) - 1))] = value
    if draw.draw(st.booleans()):
        data = data[: draw.draw(st.integers(0, len(data)))]
    survives(bytes(data), tmp_path / ("any" + EXTENSIONS.get(name, ".glb")))


@FUZZ
@given(st.sampled_from(sorted(SEEDS)), st.data())
def test_any_json_is_read_or_refused(tmp_path, name, draw):
    """Values of the document that are dropped, or are something else."""
    scene = Scene(SEEDS[name])
    content = copy.deepcopy(scene.json)
    for _ in range(draw.draw(st.integers(1, 3))):
        *keys, last = draw.draw(st.sampled_from(list(places(content))))
        owner = content
        for key in keys:
            owner = owner[key]
        if draw.draw(st.booleans()):
            owner[last] = draw.draw(st.one_of(JSON_VALUES, st.integers(0, 40)))
        else:
            del owner[last]
    survives(glb(content, scene.binary), tmp_path / ("any" + EXTENSIONS.get(name, ".glb")))
