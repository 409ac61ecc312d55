"""What we write, in programs of others: the Khronos validator; three.js and three-vrm in Chromium."""

from __future__ import annotations

import json
import mimetypes
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sixpoint as sp
from conftest import data_folder, recordings
from gltf_avatars import EXTENSIONS, STYLES, make_avatar
from node_packages import node_modules
from sixpoint.body.motion import Motion
from sixpoint.formats import load, load_avatar, save
from sixpoint.formats.gltf.avatar import Avatar
from sixpoint.jobs.driving import drive as drive_figure

PACKAGES = ("gltf-validator", "three", "@pixiv/three-vrm", "@pixiv/three-vrm-animation")
CHARACTERS = recordings("mesh/*.[gv]*")
HOST = "http://viewer.test/"
VALIDATE = """
const fs = require('fs'), validator = require('gltf-validator');
(async () => {
  for (const file of process.argv.slice(1)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {maxIssues: 0});
    console.log(JSON.stringify({file, issues: report.issues.messages.filter(m => m.severity < 2)}));
  }
})();
"""
PAGE = """<!doctype html><script type="importmap">{"imports": {
  "three": "./node/three/build/three.module.js", "three/addons/": "./node/three/examples/jsm/",
  "three-vrm": "./node/@pixiv/three-vrm/lib/three-vrm.module.js",
  "three-vrm-animation": "./node/@pixiv/three-vrm-animation/lib/three-vrm-animation.module.js"}}</script>
<script type="module">
import * as THREE from 'three';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {VRMLoaderPlugin} from 'three-vrm';
import {VRMAnimationLoaderPlugin, createVRMAnimationClip} from 'three-vrm-animation';
const place = object => object.getWorldPosition(new THREE.Vector3()).toArray();
const play = (root, clip) => {
  const mixer = new THREE.AnimationMixer(root), action = mixer.clipAction(clip);
  action.setLoop(THREE.LoopOnce);
  action.clampWhenFinished = true;
  action.play();
  return mixer;
};
window.show = async (url, times) => {
  const gltf = await new GLTFLoader().loadAsync(url);
  const mixer = play(gltf.scene, gltf.animations[0]), nodes = {}, frames = [];
  gltf.parser.associations.forEach((refs, object) => {
    if (object.isObject3D && refs.nodes !== undefined) nodes[refs.nodes] = object;
  });
  for (const time of times) {
    mixer.setTime(time);
    gltf.scene.updateMatrixWorld(true);
    const joints = {}, vertices = [];
    for (const k in nodes) joints[k] = place(nodes[k]);
    gltf.scene.traverse(mesh => {
      if (!mesh.isMesh) return;
      for (let k = 0; k < mesh.geometry.attributes.position.count; k++) {
        const vertex = mesh.getVertexPosition(k, new THREE.Vector3());
        vertices.push(vertex.applyMatrix4(mesh.matrixWorld).toArray());
      }
    });
    frames.push({joints, vertices});
  }
  return frames;
};
window.act = async (avatar, animation, times) => {
  const loader = new GLTFLoader();
  loader.register(parser => new VRMLoaderPlugin(parser));
  loader.register(parser => new VRMAnimationLoaderPlugin(parser));
  const vrm = (await loader.loadAsync(avatar)).userData.vrm;
  const acted = (await loader.loadAsync(animation)).userData.vrmAnimations[0];
  const mixer = play(vrm.scene, createVRMAnimationClip(acted, vrm)), frames = [];
  for (const time of times) {
    mixer.setTime(time);
    vrm.humanoid.update();
    vrm.scene.updateMatrixWorld(true);
    const bones = {};
    for (const name in vrm.humanoid.humanBones) bones[name] = place(vrm.humanoid.getRawBoneNode(name));
    frames.push(bones);
  }
  return frames;
};
window.ready = true;
</script>"""


@pytest.fixture(scope="module")
def boxing() -> sp.Targets:
    """Two seconds of the built-in boxing motion."""
    figure = sp.Figure.from_stature()
    return figure.targets(sp.make_sample("boxing", figure).sliced(slice(60, 180)))


def drive(avatar: Avatar, targets: sp.Targets) -> Motion:
    """An avatar posed from six points, scaled roughly by its size."""
    figure = avatar.figure
    size = figure.height / sp.Figure.from_stature().height
    scaled = sp.Targets(targets.positions * size, targets.rate, targets.rotations)
    return sp.SequentialIKPlus(figure).solve_motion(scaled)


def written(folder: Path, name: str, targets: sp.Targets) -> tuple[Avatar, Motion, Path]:
    """An avatar of a style, its movement, and the GLB of both."""
    source = folder / (name + EXTENSIONS.get(name, ".glb"))
    source.write_bytes(make_avatar(name))
    avatar = load_avatar(source)
    motion, out = drive(avatar, targets), folder / f"{name}_out.glb"
    save(motion, out, avatar=avatar, force=True)
    return avatar, motion, out


def problems(files: list[Path]) -> dict[str, list[Any]]:
    """File -> errors and warnings of the Khronos validator."""
    modules = node_modules(*PACKAGES)
    call = ["node", "-e", VALIDATE, *map(str, files)]
    done = subprocess.run(call, cwd=modules.parent, capture_output=True, text=True, timeout=120, check=True)
    found = map(json.loads, done.stdout.splitlines())
    return {Path(f["file"]).name: f["issues"] for f in found}


def errors(files: list[Path]) -> dict[str, list[Any]]:
    """File -> errors of the validator; files without any are left out."""
    found = {name: [i for i in issues if i["severity"] == 0] for name, issues in problems(files).items()}
    assert len(found) == len(files)
    return {name: issues for name, issues in found.items() if issues}


def test_the_validator_finds_no_error_in_what_we_write(tmp_path, boxing):
    """Avatars of all styles, a bare skeleton, and VRM animations are valid glTF 2.0."""
    files = []
    for name in STYLES:
        avatar, motion, out = written(tmp_path, name, boxing)
        save(motion, tmp_path / f"{name}.vrma", avatar=avatar)
        save(motion, tmp_path / f"{name}_shape.glb", shape=avatar.figure.shape, appearance=avatar.appearance)
        files += [out, tmp_path / f"{name}.vrma", tmp_path / f"{name}_shape.glb"]
    sample = sp.make_sample("walk")
    for name in ("bare.glb", "bare.vrma"):
        save(sample, tmp_path / name)
        files.append(tmp_path / name)
    save(sample.sliced(slice(3, 4)), tmp_path / "one_frame.glb")
    assert errors([*files, tmp_path / "one_frame.glb"]) == {}


@pytest.fixture(scope="module")
def match() -> Motion:
    """The beginning of the paper's boxing clip."""
    folder = data_folder()
    if folder is None:
        pytest.skip("no recordings: set SIXPOINT_DATA or put them into ../shared/data")
    return load(folder / "paper" / "17_10.amc").sliced(slice(0, 240))


@pytest.mark.parametrize("path", CHARACTERS)
def test_the_validator_finds_no_error_in_driven_characters(path, match, tmp_path):
    """Characters of others, driven by the paper's boxing clip, are valid in every way they are written."""
    avatar = load_avatar(path)
    motion = drive_figure(avatar.figure, match)[1].solution.motion
    save(motion, tmp_path / "driven.glb", avatar=avatar)
    save(motion, tmp_path / "driven.vrma", avatar=avatar)
    save(motion, tmp_path / "shape.glb", shape=avatar.figure.shape, appearance=avatar.appearance)
    save(avatar.read_motion(), tmp_path / "own.glb", avatar=avatar)
    names = ("driven.glb", "driven.vrma", "shape.glb", "own.glb")
    assert errors([tmp_path / name for name in names]) == {}


@pytest.fixture(scope="module")
def viewer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Any, Path]]:
    """A page with three.js in headless Chromium, and the folder whose files it can load."""
    api = pytest.importorskip(
        "playwright.sync_api", reason="Playwright is not installed: pip install playwright"
    )
    modules = node_modules(*PACKAGES)
    folder = tmp_path_factory.mktemp("viewer")

    def answer(route: Any) -> None:
        name = route.request.url.removeprefix(HOST)
        if not name:
            return route.fulfill(body=PAGE, content_type="text/html")
        path = modules / name.removeprefix("node/") if name.startswith("node/") else folder / name
        if not path.is_file():
            return route.abort()
        kind = mimetypes.guess_type(path)[0] or "application/octet-stream"
        return route.fulfill(body=path.read_bytes(), content_type=kind)

    with api.sync_playwright() as playwright:
        found = (
            shutil.which("chromium") or shutil.which("google-chrome") or playwright.chromium.executable_path
        )
        if not Path(found).is_file():
            pytest.skip("no Chromium: install it, or run `playwright install chromium`")
        browser = playwright.chromium.launch(executable_path=found, args=["--no-sandbox"])
        tab = browser.new_page()
        tab.route("**/*", answer)
        tab.goto(HOST)
        tab.wait_for_function("window.ready", timeout=60_000)
        yield tab, folder
        browser.close()


FRAMES = (0, 47, 119)


@pytest.mark.parametrize("name", STYLES)
def test_three_js_shows_joints_and_skin_where_we_have_them(name, viewer, boxing):
    """At three frames joints and vertices are within 1e-4 m of ours, in the file's own orientation."""
    compare_with_three_js(viewer, *written(viewer[1], name, boxing))


@pytest.mark.parametrize("path", CHARACTERS)
def test_three_js_shows_driven_characters_where_we_have_them(path, viewer, match):
    """Characters of others, driven by the paper's boxing clip: the same."""
    avatar, out = load_avatar(path), viewer[1] / f"{path.stem}.glb"
    motion = drive_figure(avatar.figure, match)[1].solution.motion
    save(motion, out, avatar=avatar)
    compare_with_three_js(viewer, avatar, motion, out)


def compare_with_three_js(viewer: tuple[Any, Path], avatar: Avatar, motion: Motion, out: Path) -> None:
    """Joints and sorted vertices of three frames within 1e-4 m; VRM 0.x files face the other way."""
    tab = viewer[0]
    turn = np.array([-1.0, 1.0, -1.0]) if avatar.kind == "VRM 0.x" else np.ones(3)
    shown = tab.evaluate("args => show(...args)", [out.name, [k / motion.rate for k in FRAMES]])
    for k, frame in zip(FRAMES, shown, strict=True):
        joints = [frame["joints"][str(node)] for node in avatar.rig.nodes]
        np.testing.assert_allclose(joints * turn, motion.positions[k], atol=1e-4)
        if avatar.figure.shape is not None:
            ours = avatar.figure.shape.place(motion.positions[k], motion.transforms[1][k])
            theirs = np.array(frame["vertices"]) * turn
            assert theirs.shape == ours.shape
            np.testing.assert_allclose(np.sort(theirs, axis=0), np.sort(ours, axis=0), atol=1e-4)


def test_three_js_shows_a_motion_with_a_shape(viewer, boxing):
    """A GLB made of a motion and a shape shows both where we have them."""
    tab, folder = viewer
    avatar, motion, _ = written(folder, "vrm1", boxing)
    shape = avatar.figure.shape
    save(motion, folder / "shape.glb", shape=shape)
    shown = tab.evaluate("args => show(...args)", ["shape.glb", [k / motion.rate for k in FRAMES]])
    for k, frame in zip(FRAMES, shown, strict=True):
        joints = [frame["joints"][str(j)] for j in range(len(motion.skeleton))]
        np.testing.assert_allclose(joints, motion.positions[k], atol=1e-4)
        ours = shape.place(motion.positions[k], motion.transforms[1][k])
        np.testing.assert_allclose(frame["vertices"], ours, atol=1e-4)


@pytest.mark.parametrize("name", ["vrm0", "vrm1"])
def test_three_vrm_plays_our_animations_on_an_avatar(name, viewer, boxing):
    """A .vrma of an avatar's movement, played on it by three-vrm, puts its bones where we have them."""
    avatar, motion, _ = written(viewer[1], name, boxing)
    compare_with_three_vrm(viewer, avatar, motion)


@pytest.mark.parametrize("path", recordings("mesh/*.vrm"))
def test_three_vrm_plays_our_animations_on_characters_of_others(path, viewer, match):
    """The paper's boxing clip on their own bones, as a .vrma: the same."""
    shutil.copy(path, viewer[1])
    avatar = load_avatar(path)
    compare_with_three_vrm(viewer, avatar, drive_figure(avatar.figure, match)[1].solution.motion)


def compare_with_three_vrm(viewer: tuple[Any, Path], avatar: Avatar, motion: Motion) -> None:
    """Bones of three frames within 1e-4 m; the avatar's file is in the viewer's folder already."""
    tab, folder = viewer
    save(motion, folder / f"{avatar.name}.vrma", avatar=avatar, force=True)
    turn = np.array([-1.0, 1.0, -1.0]) if avatar.kind == "VRM 0.x" else np.ones(3)
    files = avatar.document.path.name, f"{avatar.name}.vrma"
    acted = tab.evaluate("args => act(...args)", [*files, [k / motion.rate for k in FRAMES]])
    assert avatar.humanoid is not None
    for k, bones in zip(FRAMES, acted, strict=True):
        for bone in ("hips", "head", "leftHand", "rightHand", "leftFoot", "rightFoot", "leftLowerArm"):
            joint = avatar.rig.nodes.index(avatar.humanoid.bones[bone])
            np.testing.assert_allclose(np.array(bones[bone]) * turn, motion.positions[k, joint], atol=1e-4)
