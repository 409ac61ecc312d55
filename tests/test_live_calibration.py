"""Calibrating live, and the command line: anonymous trackers in, a profile out, poses by it."""

from __future__ import annotations

import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint.body.targets import EFFECTORS
from sixpoint.calibration.mounts import Mount
from sixpoint.calibration.profile import Profile, Worn, format_profile, parse_profile
from sixpoint.cli import main
from sixpoint.jobs.live import FitCheck, Live, mounts_of, parse_address, roles_of
from sixpoint.live.calibrating import MOVING, READY, STILL, Calibrating
from sixpoint.live.readings import Packet, Reading
from sixpoint.live.session import Session
from sixpoint.samples.range_of_motion import range_of_motion

FIGURE = sp.Figure.from_stature(1.72)


def wear(motion: sp.Motion, seed: int = 3) -> tuple[sp.Targets, np.ndarray]:
    """Trackers up to 12 cm off the joints, turned at random; the offsets."""
    rng = np.random.default_rng(seed)
    joints = FIGURE.targets(motion)
    offsets = rng.normal(size=(6, 3))
    offsets *= (rng.uniform(0.02, 0.12, 6) / np.linalg.norm(offsets, axis=1))[:, None]
    points, turns = np.array(joints.positions), np.array(joints.rotations)
    for k in range(6):
        turned = Rotation.from_quat(turns[:, k]) * Rotation.random(random_state=rng)
        points[:, k] += turned.apply(offsets[k])
        turns[:, k] = turned.as_quat()
    return sp.Targets(points, joints.rate, turns), offsets


def packet(trackers: sp.Targets, frame: int, names) -> Packet:
    return Packet(
        tuple(
            Reading("tracker", name, tuple(p), tuple(q))
            for name, p, q in zip(names, trackers.positions[frame], trackers.rotations[frame], strict=True)
        )
    )


def collect(trackers: sp.Targets, names) -> Calibrating:
    """A calibration that was sent the trackers; the stand takes the time before the movement."""
    going, session = Calibrating(0.0), Session(FIGURE, sp.SequentialIKPlus(FIGURE))
    now, frame, over = 0.0, 0, False
    while not over:
        now += 1 / 60
        late = now - READY - STILL + 1.5
        frame = int(np.clip(round(late * trackers.rate), 0, len(trackers) - 1))
        session.receive(packet(trackers, frame, names), now)
        over = going.take(now, session.seen)
    assert now == pytest.approx(READY + STILL + MOVING, abs=0.1)
    return going


def test_named_trackers_are_calibrated():
    """Serials that are points need no assignment; offsets are found, and the profile keeps them."""
    trackers, offsets = wear(range_of_motion(FIGURE))
    outcome = collect(trackers, EFFECTORS).finish()
    profile = parse_profile(format_profile(outcome.profile))
    mounts = mounts_of(profile)
    known = [k for k, name in enumerate(EFFECTORS) if mounts[name].std < 0.01]
    assert len(known) >= 4
    for k in known:
        assert np.linalg.norm(mounts[EFFECTORS[k]].offset - offsets[k]) < 0.03
    assert profile.stature == pytest.approx(1.72, abs=0.06)
    session = Session(
        profile.figure(),
        sp.SequentialIKPlus(profile.figure(), rotations=EFFECTORS),
        roles=roles_of(profile),
        mounts=mounts,
    )
    joints = FIGURE.targets(range_of_motion(FIGURE))
    for frame in range(60):
        session.receive(packet(trackers, frame, EFFECTORS), frame / 60)
        posed = session.solve(frame / 60)
    off = np.linalg.norm(posed.tracked.positions - joints.positions[59], axis=1)
    assert off[known].max() < 0.04 and np.isfinite(posed.pose.rotations).all()


def test_too_little_is_said():
    """Nothing sent, or an ambiguous stance, is an error that says what to do."""
    going = Calibrating(0.0)
    with pytest.raises(sp.TargetError, match="sending"):
        going.finish()
    assert "still" in going.say(0.5) and "circle" in going.say(READY + STILL + 1)
    still = sp.Targets(np.tile(FIGURE.targets(range_of_motion(FIGURE)).positions[:1], (900, 1, 1)), 60.0)
    turns = np.tile([0.0, 0, 0, 1], (900, 6, 1))
    still = sp.Targets(still.positions, 60.0, turns)
    with pytest.raises(sp.TargetError, match="certain"):
        collect(still, [f"LHR-{k}" for k in range(6)]).finish()


def test_addresses_and_settings(tmp_path):
    """Hosts, ports, profiles and methods are checked before a port is opened."""
    assert parse_address("127.0.0.1:39539", 1) == ("127.0.0.1", 39539)
    assert parse_address("39539", 1) == ("127.0.0.1", 39539)
    assert parse_address("box", 7) == ("box", 7)
    for wrong in ("a:b", "x:0", "70000"):
        with pytest.raises(sp.SixpointError, match="host:port"):
            parse_address(wrong, 1)
    path = tmp_path / "me.toml"
    path.write_text("stature = 'tall'")
    with pytest.raises(sp.FormatError, match=r"me\.toml"):
        Live(profile=path).make_session()
    with pytest.raises(sp.SixpointError, match="rotations"):
        Live(method="sik", rotations=("head",)).make_session()


def test_the_command_runs_and_says_how_it_went(capsys, tmp_path):
    """A short session without any packet; mistakes are told."""
    assert main(["live", "--plain-in", "0", "--duration", "0.2", "--vmc-out", "127.0.0.1:39555"]) == 0
    assert "listening for plain" in capsys.readouterr().out
    for words, message in (
        (["--vmc-in", "1", "--plain-in", "2"], "one protocol"),
        (["--profile", str(tmp_path / "no.toml")], "--calibrate"),
        (["--calibrate"], "--profile"),
        (["--vmc-out", "x:y"], "host:port"),
        (["--method", "nothing"], "no method"),
    ):
        assert main(["live", *words, "--duration", "0.1"]) == 2
        assert message in capsys.readouterr().err


def test_the_page_of_a_live_session_follows(monkeypatch):
    """With --view the newest frame is drawn, whoever's figure it is; the loop is not kept waiting."""
    pytest.importorskip("viser", reason="the page needs viser: pip install 'sixpoint[viewer]'")
    from sixpoint.jobs.live_view import LiveView
    from sixpoint.live.loop import Channel

    session = Session(FIGURE, sp.SequentialIKPlus(FIGURE))
    channel, page = Channel(session, "plain", 0), LiveView(sp.Figure.from_stature(1.6))
    try:
        assert page.address[0].startswith("http://127.0.0.1:") and not page.address[1]
        targets = FIGURE.targets(sp.make_sample("walk", FIGURE))
        for k in range(30):
            session.receive(packet(targets, k, EFFECTORS), k / 60)
            page.watch(channel, session.solve(k / 60))
        for _ in range(100):
            if page._newest is None and page._scene.figure is FIGURE:
                break
            time.sleep(0.05)
        assert page._scene.figure is FIGURE
    finally:
        page.close()


def test_a_profile_of_somebody_else_is_said():
    """After three seconds of readings: nothing for the person, a warning for a far shorter one's profile."""
    targets = FIGURE.targets(sp.make_sample("walk", FIGURE))
    plain = Mount(np.zeros(3), np.array([0.0, 0, 0, 1]))
    worn = {name: Worn(name, plain) for name in EFFECTORS}
    for stature, fits in ((1.72, True), (1.2, False)):
        check, session = FitCheck(Profile(stature, trackers=worn)), Session(FIGURE, None)
        assert check.take({}) is None
        for k in range(FitCheck.SAMPLES):
            session.receive(packet(targets, k, EFFECTORS), k / 10)
            said = check.take(session.seen)
        assert (said == ()) is fits


def test_a_calibration_does_not_replace_a_profile_unasked(tmp_path):
    """A file that exists is kept without force."""
    path = tmp_path / "me.toml"
    profile = Profile(1.7)
    Live(profile=path).keep_profile(profile)
    with pytest.raises(sp.FormatError, match="exists"):
        Live(profile=path).keep_profile(Profile(1.9))
    assert Live(profile=path).read_profile().stature == 1.7
    Live(profile=path).keep_profile(Profile(1.9), force=True)
    assert Live(profile=path).make_session().figure.height > Live().make_session().figure.height
