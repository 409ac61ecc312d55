"""What happens on the page: reports go into an inbox, and one thread takes them out, solves and shows.

Only that thread touches the state, so that callbacks of any number of browsers do no harm. A failure is said
on the page, which goes on.
"""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.motion import Motion, Pose
from sixpoint.errors import SixpointError
from sixpoint.jobs.reconstruct import finish
from sixpoint.jobs.view import readout
from sixpoint.jobs.view.clips import Clip, find_middle, known_rotations
from sixpoint.jobs.view.inbox import Inbox
from sixpoint.jobs.view.posing import (
    Posing,
    SolvedClip,
    find_limited,
    solve_clip,
    solve_frame,
    solve_up_to,
)
from sixpoint.jobs.view.saving import save_numbered
from sixpoint.jobs.view.settings import describe_settings
from sixpoint.jobs.view.task_list import change
from sixpoint.solvers.base import Solution, Solver
from sixpoint.viewer.panel import DOWN, UP, Panel
from sixpoint.viewer.scene import Scene

Array = NDArray[np.float64]

RATE = 90.0  # solves in a second while something moves [Hz]
FOLLOW = 0.025  # time constant with which a point follows its handle: browsers report 20 times a second [s]
SETTLE = 0.6  # solving goes on that long after the last change, for methods with a memory [s]
TELL = 1 / 12  # between two read-outs [s]
IDLE = 0.5  # longest sleep [s]
NEAR = 1e-5  # [m]
PLACES = (np.array([0.45, 0.35, 0.45, 0, 0, 0, 1.0]), np.array([0.0, 0.05, 0.5, 0, 0, 0, 1.0]))
"""Where sphere and box begin, from the middle of the recording's pelvis."""

log = logging.getLogger("sixpoint")


class Session:
    """Recordings, a method and a figure that is dragged.

    Args:
        clips: What can be looked at.
        posing: The method to begin with.
        scene: Where bodies are shown.
        panel: Where controls are.
        inbox: Where both of them report to.
        folder: Where poses and motions are saved; None for nowhere.
    """

    def __init__(
        self,
        clips: Sequence[Clip],
        posing: Posing,
        scene: Scene,
        panel: Panel,
        inbox: Inbox,
        folder: Path | None = None,
    ) -> None:
        self.clips = {clip.name: clip for clip in clips}
        self.scene, self.panel, self.folder = scene, panel, folder
        self.clip, self.posing = clips[0], posing
        self.solver: Solver = posing.make(self.clip.figure)
        self.solved: SolvedClip | None = None
        self.solution: Solution | None = None
        """Of the pose that is dragged; None while the recording is shown."""
        self.time, self.playing, self.speed, self.truth = 0.0, False, 1.0, "over"
        self.points = self.goals = self.clip.targets.positions[0].copy()
        self.rotations = known_rotations(self.clip, 0)
        self.seconds: deque[float] = deque(maxlen=31)
        self._places: list[Array] = []
        self.inbox = inbox
        self._message, self._bad = "", False
        self._told, self._changed, self._last, self._busy = -np.inf, -np.inf, 0.0, False
        self._limited: list[int] = []
        self._begin(self.clip)

    # --- going on ------------------------------------------------------------------------------------

    def run(self) -> None:
        """Take out reports, solve and show, until the inbox is closed."""
        while not self.inbox.closed:
            start = time.perf_counter()
            busy = self.step(start)
            self.inbox.wait(max(1 / RATE - (time.perf_counter() - start), 0.0) if busy else IDLE)

    def step(self, now: float) -> bool:
        """Take out all reports, go on to a time [s] and show; whether something still moves."""
        passed = now - self._last if self._busy else 1 / RATE  # a rest is no time
        dt, self._last = float(np.clip(passed, 1e-4, 0.1)), now
        for name, value in self.inbox.take():
            self._guard(partial(self._take, name, value, now))
        self._busy = bool(self._guard(partial(self._go_on, now, dt)))
        return self._busy

    def _guard(self, act: Callable[[], Any]) -> Any:
        try:
            return act()
        except SixpointError as error:
            self._say(str(error), bad=True)
        except Exception as error:  # a bug must not take the page away from who is looking at it
            log.exception("the page goes on after an error")
            self._say(f"{type(error).__name__}: {error}", bad=True)
            self.playing = False
        return None

    def _take(self, name: str, value: Any, now: float) -> None:
        self._changed = now
        if name == "drag":
            self._drag(*value)
        elif name == "frame":
            self._show_frame(int(value))
        elif name == "play":
            self._play(not self.playing)
        elif name == "speed":
            self.speed = float(value)
        elif name == "truth":
            self.truth = value
            self._show_truth()
        elif name == "clip" and value in self.clips:
            self._begin(self.clips[value])
        elif name == "method":
            self._set_posing(replace(self.posing, method=value))
        elif name == "setting":
            self._set_posing(self.posing.with_setting(*value))
        elif name == "task":
            row, sign = value
            step = {UP: -1, DOWN: 1}.get(sign, 0)
            self._set_posing(replace(self.posing, rows=change(self.posing.rows, row, step, toggle=not step)))
        elif name == "obstacle":
            number, position, rotation = value
            self._places[number] = np.concatenate([position, rotation])
            self._set_posing(self.posing.with_obstacle(number, self._places[number]))
        elif name == "show obstacle":
            number, shown = value
            place = self._places[number] if shown else None
            self.scene.show_obstacle(number, place)
            self._set_posing(self.posing.with_obstacle(number, place))
        elif name == "reset":
            self._reset()
        elif name in ("save pose", "save motion"):
            self._save(value, whole=name == "save motion")

    # --- what is asked for ---------------------------------------------------------------------------

    @property
    def frame(self) -> int:
        """Frame of the recording."""
        return min(int(self.time * self.clip.targets.rate + 1e-6), len(self.clip.targets) - 1)

    @property
    def pose(self) -> Pose:
        """What is shown."""
        if self.solution is not None:
            return self.solution.pose
        assert self.solved is not None
        return self.solved.motion.pose(self.frame)

    def _begin(self, clip: Clip) -> None:
        """Look at another recording, from its first frame."""
        solver = self.posing.make(clip.figure)
        self.clip, self.solver, self.time, self.playing = clip, solver, 0.0, False
        self.solved = self.solution = None
        self.scene.set_figure(clip.figure)
        self.panel.set_playing(False)
        self.panel.set_clip(clip.name, len(clip.targets), clip.truth is not None)
        middle = find_middle(clip)
        self.scene.look_at(middle)
        self._places = self._places or [place + np.append(middle, np.zeros(4)) for place in PLACES]
        self._show_posing()
        self._solve_clip()

    def _reset(self) -> None:
        """Back to the recording; without one, to standing."""
        self._show_frame(0 if len(self.clip.targets) == 1 else self.frame)
        self.scene.select(None)

    def _set_posing(self, posing: Posing) -> None:
        """Go on with other settings, or keep the old ones where these make no sense."""
        try:
            solver = posing.make(self.clip.figure)
        except SixpointError:
            self._show_posing()
            raise
        anew = posing.method != self.posing.method
        only_moved = posing.prioritized is False and posing.values == self.posing.values and not anew
        self.posing = posing
        if anew:
            self._say(f"preparing {posing.method}; the first time its kernels are compiled ...")
            self._tell(force=True)
        if only_moved:  # an obstacle, which this method does not know
            self._say("obstacles count with --method pik and pik-flext: choose one above")
            return
        self.solver = solver
        self._show_posing(settings=anew)
        free = self.solution is not None
        if not free:
            self._solve_clip()
        else:
            solver.warm_up()
            self.solution = solve_frame(solver, self.points, self.rotations, None, 1 / RATE)
            self.solved = None
            self._say("")
        self.seconds.clear()

    def _show_posing(self, settings: bool = True) -> None:
        posing = self.posing
        self.panel.set_method(posing.method)
        if settings:
            self.panel.set_settings(describe_settings(posing.method, posing.values))
        rows = posing.rows if posing.prioritized else ()
        self.panel.set_tasks([(f"{row.level + 1}  {row.name}", row.on) for row in rows])
        self.scene.set_turns(posing.turned)

    def _solve_clip(self) -> None:
        """Pose the whole recording, and show the frame that was shown."""
        if len(self.clip.targets) > 2000:
            self._say(f"solving {len(self.clip.targets)} frames ...")
            self._tell(force=True)
        self.solved = solve_clip(self.solver, self.clip)
        errors = self.solved.errors
        if errors is None or len(self.clip.targets) < 2:
            self.panel.curve.show([], [])
        else:
            times = np.arange(len(self.clip.targets)) / self.clip.targets.rate
            self.panel.curve.show(times, 100 * errors.distances.mean(axis=1))
        self._say("")
        self._show_frame(self.frame)

    def _play(self, playing: bool) -> None:
        self.playing = playing and len(self.clip.targets) > 1
        if self.playing and self.solution is not None:
            self._show_frame(self.frame)
        self.panel.set_playing(self.playing)

    def _drag(self, number: int, position: Array, rotation: Array) -> None:
        """Let a point follow its handle, from the pose that is shown."""
        if not (np.all(np.isfinite(position)) and np.abs(position).max() < 1e3):
            return
        if self.solution is None:
            self._play(False)
            self.solution = solve_up_to(self.solver, self.clip, self.frame, self.rotations)
            self.goals = self.points.copy()
            self._show_truth()
        self.goals[number] = position
        if np.all(np.isfinite(rotation)) and np.linalg.norm(rotation) > 0.5:
            self.rotations[number] = rotation

    def _save(self, name: str, whole: bool) -> None:
        if self.folder is None:
            raise SixpointError("nothing is saved on this page: start it with --out FOLDER")
        if not whole:
            motion = Motion.from_poses([self.pose], self.clip.targets.rate)
        elif self.solved is None or self.solution is not None:
            raise SixpointError("no motion is shown: play a recording, or save the pose")
        else:
            motion = self.solved.motion
        path = save_numbered(finish(motion, self.clip.figure, self.clip.truth, None), self.folder, str(name))
        self._say(f"saved {path.name}")

    # --- what is shown -------------------------------------------------------------------------------

    def _go_on(self, now: float, dt: float) -> bool:
        if self.playing:
            self.time = (self.time + self.speed * dt) % (len(self.clip.targets) / self.clip.targets.rate)
            self._show_frame(self.frame, moved=False)
        elif self.solution is not None and now - self._changed < SETTLE:
            self._follow(dt)
        busy = self.playing or now - self._changed < SETTLE
        if now - self._told >= TELL or not busy:
            self._told = now
            self._tell()
        return busy

    def _follow(self, dt: float) -> None:
        """Move the points towards their handles, solve and show."""
        gap = self.goals - self.points
        share = 1.0 - np.exp(-dt / FOLLOW)
        self.points = np.where(np.abs(gap) > NEAR, self.points + share * gap, self.goals)
        start = time.perf_counter()
        self.solution = solve_frame(self.solver, self.points, self.rotations, self.solution, dt)
        self.seconds.append(time.perf_counter() - start)
        self.scene.show(*self.solution.pose.compute_transforms())

    def _show_frame(self, frame: int, moved: bool = True) -> None:
        """A frame of the recording, in place of what was dragged."""
        frame = int(np.clip(frame, 0, len(self.clip.targets) - 1))
        if moved:
            self.time = frame / self.clip.targets.rate
        self.solution = None
        if self.solved is None:
            self._solve_clip()
            return
        self.points = self.clip.targets.positions[frame].copy()
        self.rotations = known_rotations(self.clip, frame)
        motion = self.solved.motion
        self.scene.show(motion.positions[frame], motion.transforms[1][frame])
        self.scene.set_targets(self.points, self.rotations)
        self._show_truth()

    def _show_truth(self) -> None:
        """The recording itself; not once the pose is another one."""
        truth = self.clip.truth
        if truth is None or self.truth == "hidden" or self.solution is not None:
            self.scene.show_truth(None)
        else:
            places, world = truth.transforms
            self.scene.show_truth((places[self.frame], world[self.frame]), self.truth == "beside")

    def _say(self, message: str, bad: bool = False) -> None:
        self._message, self._bad = message, bad

    def _tell(self, force: bool = False) -> None:
        """Read-outs, marks and paint."""
        if force or (self.solved is None and self.solution is None):
            self.panel.say(readout.lay_out(self.clip.name, [], self._message, self._bad))
            return
        limited = find_limited(self.clip.figure, self.pose)
        if limited != self._limited:
            self._limited = limited
            self.scene.paint(limited)
        if self.solution is not None:
            rows = readout.describe_solution(self.solution, float(np.median(self.seconds or [0.0])))
            title = f"{self.clip.name}: dragged"
        else:
            assert self.solved is not None
            rows = readout.describe_frame(self.solved, self.frame)
            title = f"{self.clip.name}, {self.time:.2f} s" if len(self.clip.targets) > 1 else self.clip.name
            self.panel.set_frame(self.frame)
            self.panel.curve.mark(self.frame)
        rows.append(readout.describe_limited(self.clip.figure, limited))
        self.panel.say(readout.lay_out(title, rows, self._message, self._bad))
