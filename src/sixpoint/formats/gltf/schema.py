"""What a glTF 2.0 document must look like where sixpoint reads it: types, ranges, indices that exist.

Checked once, right after parsing, so that all other code may index without asking. A mistake is named by
its place in the document: ``nodes[3].children[0]: node 17 does not exist, there are 5``.

Reference: Khronos, glTF 2.0 specification, section 5 (properties reference).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from sixpoint.formats.source import LARGEST

Rule = Callable[[Any, str, Mapping[str, int]], None]
"""Checks a value at a place of the document, given how many objects of each kind there are."""

COMPONENTS = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
"""glTF component type -> little-endian NumPy type."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
"""glTF element type -> numbers per element."""
KINDS = (
    *("accessors", "animations", "buffers", "bufferViews", "images", "materials"),
    *("meshes", "nodes", "samplers", "scenes", "skins", "textures"),
)
"""Top-level arrays of the document."""


class SchemaError(Exception):
    """A value of the document is not what glTF 2.0 allows there."""


def _fail(where: str, expected: str, got: Any) -> None:
    shown = type(got).__name__ if isinstance(got, (dict, list)) else repr(got)[:40]
    raise SchemaError(f"{where}: expected {expected}, got {shown}")


def text(value: Any, where: str, counts: Mapping[str, int]) -> None:
    """A string."""
    if not isinstance(value, str):
        _fail(where, "text", value)


def flag(value: Any, where: str, counts: Mapping[str, int]) -> None:
    """True or false."""
    if not isinstance(value, bool):
        _fail(where, "true or false", value)


def number(value: Any, where: str, counts: Mapping[str, int]) -> None:
    """A finite number of sane size."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= LARGEST:
        _fail(where, "a finite number", value)


def whole(least: int = 0, most: int = 2**48) -> Rule:
    """An integer in a range; exporters that write 3.0 for 3 are not forgiven."""

    def check(value: Any, where: str, counts: Mapping[str, int]) -> None:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            _fail(where, f"a whole number from {least}", value)

    return check


def one_of(*values: Any) -> Rule:
    """One of a few values."""

    def check(value: Any, where: str, counts: Mapping[str, int]) -> None:
        if isinstance(value, (dict, list, bool)) or value not in values:
            _fail(where, f"one of {', '.join(map(str, values))}", value)

    return check


def index(kind: str) -> Rule:
    """The index of an object that exists."""

    def check(value: Any, where: str, counts: Mapping[str, int]) -> None:
        if isinstance(value, bool) or not isinstance(value, int):
            _fail(where, f"an index into {kind}", value)
        if not 0 <= value < counts.get(kind, 0):
            raise SchemaError(f"{where}: {kind}[{value}] does not exist, there are {counts.get(kind, 0)}")

    return check


def many(rule: Rule, count: int | None = None) -> Rule:
    """A list whose items follow a rule."""

    def check(value: Any, where: str, counts: Mapping[str, int]) -> None:
        if not isinstance(value, list) or (count is not None and len(value) != count):
            _fail(where, "a list" if count is None else f"{count} values", value)
        for k, item in enumerate(value):
            rule(item, f"{where}[{k}]", counts)

    return check


def table(rule: Rule) -> Rule:
    """An object with any keys whose values follow a rule."""

    def check(value: Any, where: str, counts: Mapping[str, int]) -> None:
        if not isinstance(value, dict):
            _fail(where, "an object", value)
        for key, item in value.items():
            rule(item, f"{where}.{key}", counts)

    return check


def record(required: Mapping[str, Rule] | None = None, **optional: Rule) -> Rule:
    """An object with known keys; unknown ones are let through."""
    required = required or {}
    rules = {**required, **optional}

    def check(value: Any, where: str, counts: Mapping[str, int]) -> None:
        if not isinstance(value, dict):
            _fail(where, "an object", value)
        for key in required:
            if key not in value:
                raise SchemaError(f"{where}: {key!r} is missing")
        for key, rule in rules.items():
            if key in value:
                rule(value[key], f"{where}.{key}", counts)

    return check


_TEXTURE = record({"index": index("textures")}, texCoord=whole(0, 100), extensions=table(record()))
_BONE0 = record(bone=text, node=whole(-1))
_BONES1 = record({"humanBones": table(record({"node": index("nodes")}))})
_VRM: dict[str, Rule] = {
    "VRM": record(humanoid=record(humanBones=many(_BONE0)), meta=record(), specVersion=text),
    "VRMC_vrm": record(humanoid=_BONES1, meta=record(name=text), specVersion=text),
    "VRMC_vrm_animation": record(humanoid=_BONES1, specVersion=text),
}
_PRIMITIVE = record(
    {"attributes": table(index("accessors"))},
    indices=index("accessors"),
    material=index("materials"),
    mode=whole(0, 6),
    targets=many(table(index("accessors"))),
    extensions=record(),
)
_NODE = record(
    name=text,
    children=many(index("nodes")),
    mesh=index("meshes"),
    skin=index("skins"),
    matrix=many(number, 16),
    translation=many(number, 3),
    rotation=many(number, 4),
    scale=many(number, 3),
)
_ACCESSOR = record(
    {
        "componentType": one_of(*COMPONENTS),
        "count": whole(1),
        "type": one_of(*WIDTHS),
    },
    bufferView=index("bufferViews"),
    byteOffset=whole(),
    normalized=flag,
    sparse=record(),
)
_VIEW = record(
    {"buffer": index("buffers"), "byteLength": whole(1)},
    byteOffset=whole(),
    byteStride=whole(4, 252),
    extensions=record(),
)
_TARGET = record(
    {"path": text}, node=index("nodes"), extensions=record()
)  # paths of extensions (pointer) are passed over
_ANIMATION = record(
    {
        "channels": many(record({"sampler": whole(), "target": _TARGET})),
        "samplers": many(
            record(
                {"input": index("accessors"), "output": index("accessors")},
                interpolation=one_of("LINEAR", "STEP", "CUBICSPLINE"),
            )
        ),
    },
    name=text,
)
_MATERIAL = record(
    name=text,
    pbrMetallicRoughness=record(baseColorFactor=many(number, 4), baseColorTexture=_TEXTURE),
)

_DOCUMENT = record(
    {"asset": record({"version": text}, minVersion=text)},
    accessors=many(_ACCESSOR),
    animations=many(_ANIMATION),
    buffers=many(record({"byteLength": whole(1)}, uri=text)),
    bufferViews=many(_VIEW),
    images=many(record(uri=text, bufferView=index("bufferViews"), mimeType=text, name=text)),
    materials=many(_MATERIAL),
    meshes=many(record({"primitives": many(_PRIMITIVE)}, name=text)),
    nodes=many(_NODE),
    samplers=many(record()),
    scenes=many(record(nodes=many(index("nodes")))),
    skins=many(
        record(
            {"joints": many(index("nodes"))},
            inverseBindMatrices=index("accessors"),
            skeleton=index("nodes"),
            name=text,
        )
    ),
    textures=many(record(source=index("images"), sampler=index("samplers"), extensions=table(record()))),
    scene=index("scenes"),
    extensions=record(None, **_VRM),
    extensionsUsed=many(text),
    extensionsRequired=many(text),
)


def check_document(content: Any) -> None:
    """Check a parsed document.

    Raises:
        SchemaError: With the place and what was expected there.
    """
    if not isinstance(content, dict):
        raise SchemaError("the document is not a JSON object")
    counts = {k: len(v) for k in KINDS if isinstance(v := content.get(k, []), list)}
    _DOCUMENT(content, "document", counts)
    for a, animation in enumerate(content.get("animations", [])):
        for c, channel in enumerate(animation["channels"]):
            if channel["sampler"] >= len(animation["samplers"]):
                raise SchemaError(f"animations[{a}].channels[{c}]: sampler {channel['sampler']} is missing")
    major = content["asset"]["version"].split(".")[0]
    if major != "2":
        raise SchemaError(f"this is glTF version {content['asset']['version']}, only 2.0 is supported")
