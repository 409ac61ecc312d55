"""A camera drives an avatar: 33 landmarks of a pose estimator -> six points -> a body -> VMC.

    pip install mediapipe opencv-python          # your own choice of estimator; sixpoint needs neither
    python examples/camera.py --vmc-out 127.0.0.1:39539
    python examples/camera.py --landmarks take.jsonl --vmc-out 127.0.0.1:39539

The landmarks are those of BlazePose: metres from the middle of the hips, x to the right of the picture, y
down, z away from the camera, in the order nose, eyes, mouth, shoulders, elbows, ... feet. A file has one JSON
object per line: {"time": 0.033, "landmarks": [[x, y, z, visibility], ...]}; ``--record FILE`` writes one.
"""

from __future__ import annotations

import argparse
import json
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import sixpoint as sp
from sixpoint.live.readings import Packet, Reading
from sixpoint.live.session import Session
from sixpoint.live.vmc_write import PerformerWriter

EARS, SHOULDERS, ELBOWS, WRISTS = (7, 8), (11, 12), (13, 14), (15, 16)
HIPS, KNEES, ANKLES = (23, 24), (25, 26), (27, 28)
SEEN = 0.5  # visibility below which a landmark is lost
ANKLE = 0.07  # m, height of a standing ankle

Frame = tuple[float, np.ndarray]


def to_readings(landmarks: np.ndarray, figure: sp.Figure) -> list[Reading]:
    """Trackers from 33 landmarks (33, 4): effectors, and elbows and knees that lead the limbs.

    The camera does not say how large the person is: the limbs are made as long as the figure's. It does not
    say where the floor is: the lower ankle stands on it.
    """
    p = np.where(landmarks[:, 3:] >= SEEN, landmarks[:, :3] * [1.0, -1.0, -1.0], np.nan)
    p *= find_scale(p, figure)
    roles = figure.roles
    to_pelvis = -np.mean([figure.offset_between(roles.pelvis, hip) for hip in roles.hip], axis=0)
    hips, shoulders = p[list(HIPS)].mean(axis=0), p[list(SHOULDERS)].mean(axis=0)
    up = (shoulders - hips) / np.linalg.norm(shoulders - hips)
    ankles = p[list(ANKLES), 1]
    floor = np.nanmin(ankles) - ANKLE if np.isfinite(ankles).any() else -0.95
    points = {
        "pelvis": hips + to_pelvis[1] * up,
        "head": p[list(EARS)].mean(axis=0),
        "l_wrist": p[WRISTS[0]],
        "r_wrist": p[WRISTS[1]],
        "l_ankle": p[ANKLES[0]],
        "r_ankle": p[ANKLES[1]],
        "l_elbow": p[ELBOWS[0]],
        "r_elbow": p[ELBOWS[1]],
        "l_knee": p[KNEES[0]],
        "r_knee": p[KNEES[1]],
    }
    return [
        Reading("tracker", name, (float(x), float(y - floor), float(z))) for name, (x, y, z) in points.items()
    ]


def find_scale(p: np.ndarray, figure: sp.Figure) -> float:
    """The figure's size over the person's: by the bones that are seen, which do not change their lengths."""
    roles, own, seen = figure.roles, 0.0, 0.0
    for side in range(2):
        arm = (SHOULDERS[side], ELBOWS[side], WRISTS[side]), roles.limbs[side]
        leg = (HIPS[side], KNEES[side], ANKLES[side]), roles.limbs[2 + side]
        for landmarks, joints in (arm, leg):
            for a, b, c, d in zip(landmarks, landmarks[1:], joints, joints[1:], strict=False):
                length = float(np.linalg.norm(p[b] - p[a]))
                if np.isfinite(length):
                    seen += length
                    own += float(np.linalg.norm(figure.offset_between(c, d)))
    return own / seen if seen > 0.1 else 1.0


def read_landmarks(path: Path) -> Iterator[Frame]:
    """Frames of a recorded file; a line that is none ends the program with its number."""
    with path.open(encoding="utf-8") as lines:
        for number, line in enumerate(lines, 1):
            try:
                entry = json.loads(line)
                landmarks = np.array(entry["landmarks"], float)
                if landmarks.shape != (33, 4):
                    raise ValueError(f"landmarks must be 33 of four numbers, got {landmarks.shape}")
                yield float(entry["time"]), landmarks
            except (ValueError, KeyError, TypeError) as error:
                raise SystemExit(f"{path}:{number}: {error}") from None


def watch_camera(index: int) -> Iterator[Frame]:
    """Frames of a camera by MediaPipe."""
    try:
        import cv2
        import mediapipe
    except ImportError as error:
        raise SystemExit(f"{error}: pip install mediapipe opencv-python, or give --landmarks FILE") from None
    camera = cv2.VideoCapture(index)
    if not camera.isOpened():
        raise SystemExit(f"camera {index} cannot be opened")
    with mediapipe.solutions.pose.Pose() as estimator:
        while True:
            good, picture = camera.read()
            if not good:
                return
            found = estimator.process(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)).pose_world_landmarks
            if found is not None:
                yield (
                    time.perf_counter(),
                    np.array([[m.x, m.y, m.z, m.visibility] for m in found.landmark]),
                )


def main(words: list[str] | None = None) -> None:
    """Run until the frames end."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--landmarks", type=Path, help="recorded file in place of the camera")
    parser.add_argument("--camera", type=int, default=0)
    parser.add_argument("--stature", type=float, default=1.75)
    parser.add_argument("--vmc-out", default="127.0.0.1:39539")
    parser.add_argument("--record", type=Path, help="write the landmarks to this file")
    parser.add_argument("--fast", action="store_true", help="do not keep the time of a recorded file")
    options = parser.parse_args(words)
    host, _, port = options.vmc_out.rpartition(":")
    figure = sp.Figure.from_stature(options.stature)
    solver = sp.SequentialIKPlus(figure)
    solver.warm_up()
    session = Session(figure, solver, smoothing="light")
    writer, out = PerformerWriter(figure), socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    frames = read_landmarks(options.landmarks) if options.landmarks else watch_camera(options.camera)
    record = options.record.open("x", encoding="utf-8") if options.record else None
    start = first = None
    for moment, landmarks in frames:
        if first is None:
            start, first = time.perf_counter(), moment
        if options.landmarks and not options.fast:
            time.sleep(max(start + moment - first - time.perf_counter(), 0.0))
        if record is not None:
            record.write(json.dumps({"time": moment, "landmarks": landmarks.round(5).tolist()}) + "\n")
        session.receive(Packet(tuple(to_readings(landmarks, figure))), moment)
        frame = session.solve(moment)
        for datagram in writer.write_pose(frame.pose, moment - first):
            out.sendto(datagram, (host or "127.0.0.1", int(port)))
    if record is not None:
        record.close()


if __name__ == "__main__":
    main()
