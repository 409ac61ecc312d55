"""The viewer's page without a browser: what is dragged is solved, and nothing that comes in takes it down."""

from __future__ import annotations

import asyncio
import importlib.util
import re
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("viser", reason="viser is not installed: pip install 'sixpoint[viewer]'")

import sixpoint as sp
from sixpoint.body.mannequin import Mannequin
from sixpoint.cli import main
from sixpoint.cli.view import show_page
from sixpoint.errors import SixpointError
from sixpoint.jobs.view.clips import Clip, open_clips, sample_clips, stand
from sixpoint.jobs.view.inbox import MOST, Inbox
from sixpoint.jobs.view.job import open_page
from sixpoint.jobs.view.posing import Posing, find_limited
from sixpoint.jobs.view.saving import save_numbered
from sixpoint.jobs.view.session import Session
from sixpoint.jobs.view.settings import describe_settings, read_settings
from sixpoint.jobs.view.task_list import DEFAULT, Row, TaskSolver, change
from sixpoint.solvers.prioritized.tasks import Sphere
from sixpoint.solvers.registry import SOLVERS, make_solver
from sixpoint.study.limit_excess import compute_limit_excess
from sixpoint.viewer.meshes import find_tubes, make_sphere, make_tube
from sixpoint.viewer.panel import Choice, Panel
from sixpoint.viewer.scene import Scene
from sixpoint.viewer.server import close, describe_address, find_port, is_public, open_server

UNTURNED = np.array([0.0, 0.0, 0.0, 1.0])
L_WRIST = 2


@pytest.fixture(scope="module")
def clips() -> list[Clip]:
    """Two built-in motions."""
    return sample_clips(["walk", "reach"])


@pytest.fixture
def session(clips: list[Clip], tmp_path: Path) -> Iterator[Session]:
    """A session on a real server, driven by hand."""
    server = open_server()
    inbox = Inbox()
    panel = Panel(server, inbox.put, [clip.name for clip in clips], [*SOLVERS], "sik+", True)
    yield Session(clips, Posing(), Scene(server, inbox.put), panel, inbox, tmp_path)
    close(server)


def go_on(session: Session, *reports: tuple[str, object], seconds: float = 0.3) -> None:
    """Let reports come in and time pass."""
    for name, value in reports:
        session.inbox.put(name, value)
    for _ in range(int(seconds * 90)):
        session.step(session._last + 1 / 90)


def shown_points(session: Session) -> np.ndarray:
    """The six points of the pose that is shown, by forward kinematics."""
    motion = sp.Motion.from_poses([session.pose], 60.0)
    return session.clip.figure.targets(motion).positions[0]


# --- showing -------------------------------------------------------------------------------------


def test_meshes_are_seen_from_outside():
    """The normals of balls and tubes point outward, and a tube has its two radii."""
    for vertices, faces in (make_sphere(), make_tube(0.7)):
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        outward = (a + b + c) / 3 * ([1, 1, 1] if len(vertices) > 40 else [1, 0, 1])
        assert np.all(np.sum(np.cross(b - a, c - a) * outward, axis=1) > -1e-12)
    low, high = (make_tube(0.7)[0][make_tube(0.7)[0][:, 1] == y] for y in (0, 1))
    np.testing.assert_allclose(np.linalg.norm(low[:, [0, 2]], axis=1), 1.0)
    np.testing.assert_allclose(np.linalg.norm(high[:, [0, 2]], axis=1), 0.7)


@pytest.mark.parametrize("slim", [True, False])
def test_tubes_join_the_balls_of_a_mannequin(clips, slim):
    """A tube's copy, turned and stretched by SciPy, ends at its two balls; limbs' balls are at joints."""
    body, motion = Mannequin.of(clips[0].figure, slim), clips[0].truth
    assert motion is not None
    positions, world = (array[7] for array in motion.transforms)
    centres = body.place(positions, world)
    on_joint = ~body.offsets.any(axis=1)
    np.testing.assert_allclose(centres[on_joint], positions[body.joints[on_joint]], atol=1e-12)
    for tubes in find_tubes(body):
        start, turned, scales = tubes.place(centres, body.radii)
        tips = start + Rotation.from_quat(turned).apply(np.array([0, 1, 0]) * scales)
        np.testing.assert_allclose(start, centres[tubes.first], atol=1e-12)
        np.testing.assert_allclose(tips, centres[tubes.last], atol=2e-6)


def test_a_joint_at_its_limit_is_found(clips):
    """An elbow folded to its limit is found, one folded half is not, and a straight one never is."""
    figure = clips[0].figure
    elbow = figure.roles.elbow[0]
    dof = figure.dofs[elbow]
    rest = figure.neutral_pose
    for share, found in ((1.0, True), (0.5, False), (0.0, False)):
        angle = share * (dof.lower[0] if abs(dof.lower[0]) > dof.upper[0] else dof.upper[0])
        local = np.tile(UNTURNED, (1, len(figure.skeleton), 1))
        local[0, elbow] = Rotation.from_rotvec(angle * dof.axes[0]).as_quat()
        motion = figure.compute_motion(local, np.zeros((1, 3)), 60.0)
        assert (elbow in find_limited(figure, motion.pose(0))) == found
        assert compute_limit_excess(figure, motion)[0, elbow] < 1e-9
    assert find_limited(figure, rest) == []


def test_arrows_and_balls_report_what_is_dragged(clips):
    """A ball reports the pointer plus where it was gripped, arrows their own place; both stay together."""
    server, told = open_server(), []
    try:
        scene = Scene(server, lambda name, value: told.append((name, *value)))
        scene.set_figure(clips[0].figure)
        scene.set_targets(clips[0].targets.positions[0], clips[0].targets.rotations[0])
        handle = scene._handles._all[L_WRIST]
        start = handle.position
        grip = SimpleNamespace(phase="start", start_position=start + [0, 0, 0.03])
        asyncio.run(handle._on_drag(grip))
        assert [h.selected for h in scene._handles._all] == [k == L_WRIST for k in range(6)]
        asyncio.run(handle._on_drag(SimpleNamespace(phase="update", end_position=start + [0.2, 0, 0.03])))
        np.testing.assert_allclose(told[-1][2], start + [0.2, 0, 0], atol=1e-9)
        handle._gizmo.position, handle._gizmo.wxyz = start + [0, 0.1, 0], (0.0, 0.0, 1.0, 0.0)
        asyncio.run(handle._on_gizmo(SimpleNamespace(phase="update")))
        assert told[-1][:2] == ("drag", L_WRIST)
        np.testing.assert_allclose(told[-1][2], start + [0, 0.1, 0], atol=1e-9)
        np.testing.assert_allclose(told[-1][3], [0, 1, 0, 0], atol=1e-9)
        scene.set_targets(np.full((6, 3), np.nan))
        assert not handle.visible
    finally:
        close(server)


# --- driving it ----------------------------------------------------------------------------------


def test_a_scrubbed_frame_is_that_of_the_solver(session):
    """The pose shown at a frame is what the method makes of the clip there; beyond the end is the last."""
    go_on(session, ("frame", 40))
    expected = sp.SequentialIKPlus(session.clip.figure).solve_motion(session.clip.targets)
    assert session.frame == 40
    np.testing.assert_array_equal(session.pose.rotations, expected.rotations[40])
    go_on(session, ("frame", 10**9))
    assert session.frame == len(session.clip.targets) - 1


@pytest.mark.parametrize("method", ["sik+", "sik", "pik"])
def test_a_dragged_wrist_follows(session, method):
    """The wrist goes where its handle was dragged, and a reset goes back to the recording."""
    go_on(session, ("method", method), ("frame", 30))
    before = session.pose
    goal = session.clip.targets.positions[30, L_WRIST] + [0.02, 0.12, 0.08]
    go_on(session, ("drag", (L_WRIST, goal, UNTURNED)), seconds=0.7)
    np.testing.assert_allclose(shown_points(session)[L_WRIST], goal, atol=0.01)
    np.testing.assert_allclose(session.points[L_WRIST], goal, atol=1e-4)
    go_on(session, ("reset", None))
    assert session.frame == 30
    np.testing.assert_array_equal(session.pose.rotations, before.rotations)


def test_dragging_begins_where_the_recording_is(session):
    """The first dragged pose is close to the one that was shown: nothing jumps."""
    go_on(session, ("frame", 50))
    before = session.pose.compute_transforms()[0]
    session.inbox.put("drag", (L_WRIST, session.points[L_WRIST], UNTURNED))
    session.step(session._last + 1 / 90)
    assert np.abs(session.pose.compute_transforms()[0] - before).max() < 0.02


def test_playing_goes_on_in_time(session):
    """At half speed half a second is a quarter of a second of the recording; dragging ends it."""
    go_on(session, ("speed", 0.5), ("play", True), seconds=0.5)
    assert session.playing
    assert session.time == pytest.approx(0.25, abs=0.02)
    go_on(session, ("drag", (0, session.points[0], UNTURNED)), seconds=0.05)
    assert not session.playing
    assert session.solution is not None


def test_a_rotation_counts_where_it_is_asked_for(session):
    """With its rotation switched on, the head turns with its handle; else it does not."""
    turned = Rotation.from_rotvec([0, 0.5, 0]).as_quat()
    heads = []
    for on in (False, True):
        go_on(session, ("frame", 0), ("setting", ("turn head", on)))
        go_on(session, ("drag", (1, session.points[1], turned)), seconds=0.6)
        head = session.clip.figure.targets(sp.Motion.from_poses([session.pose], 60.0)).rotations[0, 1]
        heads.append((Rotation.from_quat(turned).inv() * Rotation.from_quat(head)).magnitude())
    assert heads[0] > 0.1
    assert heads[1] < 0.02


def test_what_makes_no_sense_is_said_and_changes_nothing(session):
    """Weights of zero, unknown methods and points that are not finite leave the page as it was."""
    go_on(session, ("method", "sik"))
    go_on(session, ("setting", ("w1", 0.0)), ("setting", ("w2", 0.0)), ("setting", ("w3", 0.0)))
    assert "weights" in session._message
    assert session.posing.values["w2"] == 0.0
    go_on(session, ("method", "no such"), ("drag", (2, np.full(3, np.nan), UNTURNED)), ("clip", "no such"))
    assert "no such" in session._message
    assert session.solution is None
    go_on(session, ("drag", (9, np.zeros(3), UNTURNED)), ("task", (99, "on")), ("unheard of", 1))
    go_on(session, ("method", "sik+"))
    assert session.posing.method == "sik+"


def test_an_error_in_solving_does_not_end_the_page(session):
    """A solver that raises is said on the page, and after a reset all goes on."""

    class Broken:
        def solve(self, *_: object, **__: object) -> None:
            raise ZeroDivisionError("broken")

    solver = session.solver
    go_on(session, ("drag", (0, session.points[0], UNTURNED)), seconds=0.05)
    session.solver = Broken()
    go_on(session, ("drag", (0, session.points[0], UNTURNED)), seconds=0.05)
    assert "ZeroDivisionError" in session._message
    session.solver = solver
    go_on(session, ("reset", None), ("frame", 3))
    assert session.frame == 3


def test_another_recording_is_another_figure(tmp_path, data):
    """A recording with its own rig is shown on it, and six points stand on the built-in figure."""
    mine = sp.make_sample("walk").sliced(slice(0, 5))
    sp.save_targets(sp.Figure.from_motion(mine).targets(mine), tmp_path / "points.csv")
    path = sorted(data.glob("**/*.bvh"))[0]
    opened = open_clips([path, tmp_path / "points.csv"])
    assert opened[0].truth is not None
    assert opened[1].truth is None
    with open_page(opened) as page:
        for clip in (opened[1], opened[0]):
            page.session.inbox.put("clip", clip.name)
            wait_for(lambda clip=clip: page.session.clip is clip and page.session.solved is not None)
            assert page.session.pose.skeleton is clip.figure.skeleton


def test_the_standing_figure_stands_on_the_floor():
    """Without a file a figure stands with its soles at zero."""
    clip = stand(sp.Figure.from_stature(1.6))
    figure, pose = clip.figure, clip.figure.neutral_pose
    sites = figure.skeleton.compute_sites(*pose.compute_transforms())
    lowest = min(sites[:, 1].min(), pose.compute_transforms()[0][:, 1].min())
    np.testing.assert_allclose(clip.targets.positions[0, 0, 1], -lowest, atol=1e-12)


# --- several at once -----------------------------------------------------------------------------


def wait_for(condition, seconds: float = 20.0) -> None:
    """Wait until something is so."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.02)


def test_five_threads_drag_at_once(clips):
    """Reports from five threads at once end in one pose that meets the last of each."""
    with open_page(clips) as page:
        session = page.session
        wait_for(lambda: session.solved is not None)
        start = clips[0].targets.positions[0]

        def drag(number: int) -> None:
            for k in range(60):
                session.inbox.put("drag", (number, start[number] + [0, 0.0005 * k, 0], UNTURNED))
                time.sleep(0.002)

        threads = [threading.Thread(target=drag, args=(number,)) for number in range(1, 6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        goal = start + np.array([[0, 0, 0]] + [[0, 0.0295, 0]] * 5)
        wait_for(lambda: session.solution is not None and np.abs(session.points - goal).max() < 1e-3)
        time.sleep(0.2)
        assert np.abs(shown_points(session) - goal).max() < 0.02


def test_a_flood_is_bounded():
    """Reports that nobody takes do not pile up, and of those about one thing the newest stays."""
    inbox = Inbox()
    for k in range(1000):
        inbox.put("play", None)
        inbox.put("drag", (1, k))
    reports = inbox.take()
    assert len(reports) == MOST
    assert ("drag", (1, 999)) in reports
    assert inbox.take() == []


# --- methods and tasks ---------------------------------------------------------------------------


@pytest.mark.parametrize("method", SOLVERS)
def test_controls_become_options(method, clips):
    """Untouched controls are no options; limits and every other value reach the method."""
    settings = describe_settings(method, {})
    assert settings[0].name == "limits"
    assert read_settings(method, {}) == {}
    values = {"limits": False}
    for setting in settings[1:]:
        if isinstance(setting.domain, Choice):
            values[setting.name] = setting.domain.options[-1]
        elif setting.domain is None:
            values[setting.name] = not setting.value
        else:
            values[setting.name] = type(setting.value)(0.5 * (setting.domain[0] + setting.domain[1]))
    options = read_settings(method, values)
    assert options.pop("limits") is False
    several = {"w": "weights", "turn": "rotations", "avoid": "avoid"}  # options that have several controls
    names = {several.get("w" if re.fullmatch(r"w\d", n) else n.split(" ")[0], n) for n in values}
    assert len(options) == len(names - {"limits"})
    Posing(method, values).make(clips[0].figure)


@pytest.mark.parametrize(("method", "flext"), [("pik", False), ("pik-flext", True)])
def test_the_list_of_tasks_begins_as_the_method(clips, method, flext):
    """Untouched, the list of tasks gives what the method of that name gives."""
    figure, targets = clips[0].figure, clips[0].targets.sliced(slice(0, 30))
    expected = make_solver(method, figure).solve_frames(targets)
    found = TaskSolver(figure, flext=flext).solve_frames(targets)
    np.testing.assert_allclose(found.motion.positions, expected.motion.positions, atol=1e-9)
    np.testing.assert_array_equal(found.status, expected.status)


def test_priorities_decide_who_gives_way(clips):
    """Of two wrists that cannot both be met, the one raised in the list is; one switched off is free."""
    figure = clips[0].figure
    points = stand(figure).targets.positions[0].copy()
    points[2], points[3] = points[2] + [1.5, 0.3, 0], points[3] + [-1.5, 0.3, 0]

    def miss(rows: tuple[Row, ...]) -> np.ndarray:
        solver, solution = TaskSolver(figure, rows), None
        for _ in range(30):
            solution = solver.solve(points, solution)
        return np.linalg.norm(
            figure.targets(sp.Motion.from_poses([solution.pose], 60.0)).positions[0] - points, axis=1
        )

    free = tuple(row for row in DEFAULT if row.name in ("l_wrist", "r_wrist", "posture"))
    right_first = change(free, 1, step=-1)
    left_first = change(free, 0, step=-1)
    assert [row.name for row in right_first] == ["r_wrist", "l_wrist", "posture"]
    assert miss(right_first)[3] < 0.01 < miss(right_first)[2]
    assert miss(left_first)[2] < 0.01 < miss(left_first)[3]
    off = change(left_first, 1, toggle=True)
    assert not off[1].on
    assert miss(off)[2] < 0.01


def test_the_posture_stays_last():
    """No number of steps brings the posture before a task, or a task behind it."""
    rows = DEFAULT
    for _ in range(12):
        rows = change(rows, len(rows) - 1, step=-1)
        rows = change(rows, 0, step=1)
    assert rows[-1].name == "posture"
    assert {row.name for row in rows} == {row.name for row in DEFAULT}


def test_an_obstacle_is_kept_out(session):
    """Prioritized IK keeps the wrist out of a sphere around it, which has a row in the list meanwhile."""
    go_on(session, ("method", "pik"), ("frame", 0))
    place = session.points[L_WRIST] + [0.05, 0.0, 0.05]
    go_on(session, ("obstacle", (0, place, UNTURNED)), seconds=0.1)
    assert session.posing.rows[0].name == "sphere"
    assert np.linalg.norm(shown_points(session)[L_WRIST] - place) > 0.19
    go_on(session, ("show obstacle", (0, False)), seconds=0.1)
    assert "sphere" not in [row.name for row in session.posing.rows]
    solver = TaskSolver(
        session.clip.figure, (Row("sphere", 0),), obstacles={"sphere": (Sphere(0.1), np.r_[place, UNTURNED])}
    )
    assert np.all(np.isfinite(solver.solve(session.points).pose.rotations))


# --- saving and listening ------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["", "../up", "/etc/passwd", "a/b", "a\\b", "..", ".hidden", "x" * 200, "a\nb", "é"]
)
def test_only_plain_names_are_saved(tmp_path, clips, name):
    """A name from the page is never a path."""
    folder = tmp_path / "inside"
    folder.mkdir()
    with pytest.raises(SixpointError, match="letters, digits"):
        save_numbered(clips[0].truth, folder, name)
    assert list(tmp_path.rglob("*")) == [folder]


def test_saving_never_overwrites(session, tmp_path):
    """A second pose of one name gets a number; a motion is the solved one; a dragged one is no motion."""
    (tmp_path / "mine.bvh").write_text("precious")
    go_on(session, ("frame", 20), seconds=0.02)
    go_on(session, ("save pose", "mine"), ("save pose", "mine.bvh"), ("save motion", "walk"), seconds=0.02)
    assert (tmp_path / "mine.bvh").read_text() == "precious"
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "mine.bvh",
        "mine_2.bvh",
        "mine_3.bvh",
        "walk.bvh",
    ]
    assert len(sp.load(tmp_path / "walk.bvh")) == len(session.clip.targets)
    pose = sp.load(tmp_path / "mine_2.bvh")
    np.testing.assert_allclose(pose.positions[0], session.pose.compute_transforms()[0], atol=1e-4)
    go_on(session, ("drag", (0, session.points[0], UNTURNED)), ("save motion", "other"), seconds=0.02)
    assert "no motion" in session._message
    session.folder = None
    go_on(session, ("save pose", "mine"), seconds=0.02)
    assert "--out" in session._message


def test_a_port_in_use_is_said_with_a_free_one():
    """A port that is taken is an error that names a free one; without a port the next is taken."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        with pytest.raises(SixpointError, match=rf"port {taken} is in use .* --port \d+"):
            open_server(port=taken)
        assert find_port("127.0.0.1", taken) > taken
    with pytest.raises(SixpointError, match="no address of this machine"):
        find_port("203.0.113.7", 8080)
    with pytest.raises(SixpointError, match="from 1 to 65535"):
        open_server(port=70000)


def test_only_this_machine_unless_told_otherwise():
    """The page listens on 127.0.0.1; others are warned about, and no tunnel is ever opened."""
    server = open_server()
    try:
        address, warning = describe_address(server)
        assert address.startswith("http://127.0.0.1:")
        assert warning == ""
        assert server.request_share_url() is None
        assert server._share_tunnel is None
    finally:
        close(server)
    assert is_public("0.0.0.0")
    assert is_public("192.0.2.1")
    assert is_public("example.org")
    assert not is_public("::1")
    assert not is_public("localhost")


def test_the_command_opens_and_says_where(capsys, tmp_path):
    """The command line says where the page is, warns of a public address, and ends when it is told to."""
    stop = threading.Event()
    stop.set()
    show_page(lambda clips: clips.open_clips([]), stop=stop)
    assert "open http://127.0.0.1:" in capsys.readouterr().out
    show_page(lambda clips: clips.open_clips([]), host="0.0.0.0", stop=stop)
    out, err = capsys.readouterr()
    assert "open http://localhost:" in out
    assert "no password" in err
    assert main(["view", "--out", str(tmp_path / "none")]) == 2
    assert "create it first" in capsys.readouterr().err
    assert main(["view", "--method", "no-such"]) == 2
    assert "methods:" in capsys.readouterr().err


def test_without_viser_the_command_says_how_to_get_it(capsys, monkeypatch):
    """Without the extra the command names it."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    for words in (["view"], ["demo", "--view"]):
        assert main(words) == 2
        assert 'pip install "sixpoint[viewer]"' in capsys.readouterr().err


def test_another_method_keeps_what_is_dragged(session):
    """A method chosen while dragging poses the same points; the scrubber then shows that method's frame."""
    goal = session.points[L_WRIST] + [0.0, 0.1, 0.1]
    go_on(session, ("drag", (L_WRIST, goal, UNTURNED)), ("method", "pik"))
    np.testing.assert_allclose(session.points[L_WRIST], goal, atol=1e-4)
    assert np.linalg.norm(shown_points(session)[L_WRIST] - goal) < 0.01
    go_on(session, ("frame", 12))
    expected = make_solver("pik", session.clip.figure).solve_motion(session.clip.targets)
    assert session.frame == 12
    np.testing.assert_allclose(session.pose.rotations, expected.rotations[12], atol=1e-9)


def test_python_of_the_docs_runs():
    """The example of docs/view.md runs as it stands."""
    text = (Path(__file__).parents[1] / "docs" / "view.md").read_text("utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(compile(block, "view.md", "exec"), {})
