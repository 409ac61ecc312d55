"""The camera example on a landmark file: what the receiver gets is the body that was filmed."""

from __future__ import annotations

import json
import socket
import sys
from pathlib import Path

import numpy as np
import pytest

import sixpoint as sp
from sixpoint.live import vmc

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))

import camera

FIGURE = sp.Figure.from_stature(1.75)


def film(motion: sp.Motion, visible: float = 1.0) -> list[np.ndarray]:
    """33 landmarks per frame as a camera in front sees them: from the hips, y down, z away."""
    roles, frames = FIGURE.roles, []
    for positions in motion.positions:
        p = np.zeros((33, 3))
        head = positions[roles.head]
        for pair, joints in (
            (camera.SHOULDERS, roles.shoulder),
            (camera.ELBOWS, roles.elbow),
            (camera.WRISTS, roles.wrist),
            (camera.HIPS, roles.hip),
            (camera.KNEES, roles.knee),
            (camera.ANKLES, roles.ankle),
        ):
            p[list(pair)] = positions[list(joints)]
        p[list(camera.EARS)] = head
        p = 0.9 * (p - p[list(camera.HIPS)].mean(axis=0)) * [1.0, -1.0, -1.0]  # a smaller person
        frames.append(np.column_stack([p, np.full(33, visible)]))
    return frames


def write(path: Path, frames: list[np.ndarray]) -> Path:
    lines = [json.dumps({"time": k / 30, "landmarks": f.tolist()}) for k, f in enumerate(frames)]
    path.write_text("\n".join(lines) + "\n")
    return path


def run(path: Path) -> dict[str, list[vmc.Reading]]:
    """Bones that a receiver gets."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        out.bind(("127.0.0.1", 0))
        out.setblocking(False)
        camera.main(["--landmarks", str(path), "--fast", "--vmc-out", f"127.0.0.1:{out.getsockname()[1]}"])
        bones: dict[str, list[vmc.Reading]] = {}
        while True:
            try:
                packet = vmc.read_packet(out.recv(2000))
            except BlockingIOError:
                return bones
            for reading in packet.readings:
                if reading.kind == "bone":
                    bones.setdefault(reading.name, []).append(reading)


def test_a_filmed_body_arrives(tmp_path):
    """Every frame is answered; the hips are at the right height and the elbows bend as they were filmed."""
    motion = sp.make_sample("boxing", FIGURE).sliced(slice(0, 120, 2))
    bones = run(write(tmp_path / "take.jsonl", film(motion)))
    assert len(bones["Hips"]) == len(motion)
    hips = np.array([b.position for b in bones["Hips"]])
    true = motion.positions[:, FIGURE.roles.pelvis]
    assert np.abs(hips[:, 1] - true[:, 1]).mean() < 0.06
    roles = FIGURE.roles
    upper = motion.positions[:, roles.elbow[1]] - motion.positions[:, roles.shoulder[1]]
    lower = motion.positions[:, roles.wrist[1]] - motion.positions[:, roles.elbow[1]]
    cosine = (upper * lower).sum(-1) / np.linalg.norm(upper, axis=-1) / np.linalg.norm(lower, axis=-1)
    bent = 2 * np.arccos(np.clip(np.abs([b.rotation[3] for b in bones["RightLowerArm"]]), 0, 1))
    assert np.abs(bent - np.arccos(cosine))[10:].mean() < 0.25


def test_what_is_not_visible_is_filled_in(tmp_path):
    """With nothing visible for a while poses go on and stay finite."""
    motion = sp.make_sample("walk", FIGURE).sliced(slice(0, 60))
    frames = film(motion)
    for k in range(20, 40):
        frames[k][:, 3] = 0.0
    bones = run(write(tmp_path / "take.jsonl", frames))
    assert len(bones["Hips"]) == 60
    assert np.isfinite([b.rotation for b in bones["LeftUpperArm"]]).all()


def test_a_damaged_file_is_named(tmp_path):
    """The message has the line."""
    path = write(tmp_path / "take.jsonl", film(sp.make_sample("walk", FIGURE).sliced(slice(0, 3))))
    path.write_text(path.read_text() + '{"time": 1, "landmarks": [[1, 2]]}\n')
    with pytest.raises(SystemExit, match=r"take\.jsonl:4: .*33"):
        run(path)
    with pytest.raises(SystemExit, match="mediapipe"):
        camera.main([])
