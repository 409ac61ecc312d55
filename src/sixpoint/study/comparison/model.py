"""What a comparison of methods holds: one row per method and clip, and what is drawn of each.

The report is a function of this alone, so an interrupted comparison can be drawn at any time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import nan

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion

Array = NDArray[np.float64]

SPLITS = TRAIN, DEVELOPMENT, TEST = ("train", "development", "test")
"""What a clip is for: fitting methods, choosing among them, or testing them; only the last is averaged."""


def is_fitted(person: str, fitted_on: Iterable[str]) -> bool:
    """Whether a person is one of those, or of a data set that is."""
    return any(person == name or person.startswith(f"{name}/") for name in fitted_on)


@dataclass(frozen=True)
class Row:
    """One method on one clip: a line of ``results.csv``. NaN where it was not, or cannot be, measured.

    Attributes:
        clip: Name of the clip.
        method: Name of the method.
        frames: Frames of the clip.
        rate: Frames per second [Hz].
        key: Names what was measured: the files, frames and options of the clip, the method, and the code.
        options: Options that the solver was made with, as ``limits=True weights=1,1,0``.
        person: Whom the clip shows, as "cmu/14"; empty where that is not known.
        split: What the clip is for, one of ``SPLITS``; the same for all methods.
        error: Why there is no result; empty where there is one.
        failed_frames: Frames for which the method raised or gave numbers that are not finite.
        position: RMS over frames of the mean joint distance over H, E_p; see ``Figure.height``.
        orientation: RMS over frames of the mean joint angle, E_o [rad].
        position_mean: Mean over frames of e_p(t).
        position_p95: 95th percentile of e_p(t).
        orientation_mean: Mean over frames of e_o(t) [rad].
        orientation_p95: 95th percentile of e_o(t) [rad].
        position_pooled: The other reading of the position error, ``Errors.position_pooled``.
        residual_mean: Mean over frames of the largest distance of an effector to its target [m].
        residual_p95: 95th percentile of the same [m].
        residual_max: Largest [m].
        missed: Share of frames with an effector more than 1 cm off its target.
        batch_us: Time per frame of ``solve_frames``, best of some rounds [us].
        median_us: Median time of single ``solve`` calls from Python [us].
        p99_us: 99th percentile of the same [us].
        warm_up_s: Time to compile or load the kernels, not contained in the others [s].
        limit_frames: Share of frames with a joint outside its limits by more than 0.1 degrees.
        limit_worst: Largest excess over a limit [rad].
        jerk_ratio: Mean third difference of joint positions over that of the truth.
        skate: Horizontal path of the ankles while the true foot stands, per frame [m].
        skate_truth: The same of the truth [m].
        swivel_jumps: Changes of an elbow's or knee's swivel angle by more than 30 degrees in a frame.
        swivel_jumps_truth: The same of the truth.
        clavicle: Mean angle of the clavicles from rest [rad].
        clavicle_truth: The same of the truth [rad].
        bend_top: Share of the trunk's bending that its upper half does.
        bend_top_truth: The same of the truth.

    Reference: Unzueta et al. 2008, section 9, for the first two errors.
    """

    clip: str
    method: str
    frames: int
    rate: float
    key: str = ""
    options: str = ""
    person: str = ""
    split: str = TEST
    error: str = ""
    failed_frames: int = 0
    position: float = nan
    orientation: float = nan
    position_mean: float = nan
    position_p95: float = nan
    orientation_mean: float = nan
    orientation_p95: float = nan
    position_pooled: float = nan
    residual_mean: float = nan
    residual_p95: float = nan
    residual_max: float = nan
    missed: float = nan
    batch_us: float = nan
    median_us: float = nan
    p99_us: float = nan
    warm_up_s: float = nan
    limit_frames: float = nan
    limit_worst: float = nan
    jerk_ratio: float = nan
    skate: float = nan
    skate_truth: float = nan
    swivel_jumps: float = nan
    swivel_jumps_truth: float = nan
    clavicle: float = nan
    clavicle_truth: float = nan
    bend_top: float = nan
    bend_top_truth: float = nan


@dataclass(frozen=True, eq=False)
class Run:
    """What is drawn of one method on one clip.

    Attributes:
        position: (F,) e_p(t).
        orientation: (F,) e_o(t) [rad].
        sample: The pose at the clip's chosen frame, a motion of one frame.
    """

    position: Array
    orientation: Array
    sample: Motion


@dataclass(frozen=True, eq=False)
class ClipRuns:
    """One clip and what the methods made of it.

    Attributes:
        name: Name of the clip.
        figure: Anatomy of its rig.
        rate: Frames per second [Hz].
        turning: (F,) speed of the true pelvis about the vertical [rad/s].
        frame: The chosen frame.
        window: First frame and end of the part that is drawn large.
        truth: The true pose at the chosen frame, a motion of one frame.
        runs: Method -> what is drawn; only methods that have a result.
    """

    name: str
    figure: Figure
    rate: float
    turning: Array
    frame: int
    window: tuple[int, int]
    truth: Motion
    runs: Mapping[str, Run] = field(default_factory=dict)


@dataclass(frozen=True)
class Reference:
    """Published numbers to stand beside ours.

    Attributes:
        name: Whose, e.g. "Unzueta et al. 2008, Table 1".
        position: Clip (or "average") -> method -> position error.
        orientation: Clip -> method -> orientation error [rad].
        milliseconds: Clip -> method -> median time per frame [ms].
    """

    name: str
    position: Mapping[str, Mapping[str, float]]
    orientation: Mapping[str, Mapping[str, float]]
    milliseconds: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Claim:
    """A statement of a paper and what was measured.

    Attributes:
        text: The statement.
        measured: What was found, with its numbers.
        holds: Whether that agrees.
    """

    text: str
    measured: str
    holds: bool


@dataclass(frozen=True, eq=False)
class Comparison:
    """A whole comparison.

    Attributes:
        title: What was compared.
        methods: In the order of the tables.
        rows: One per method and clip.
        clips: Those that could be read, in the order of the tables.
        reference: Published numbers, if the study has them.
        claims: Statements tested, if the study has any.
        presets: Method -> its fixed parameters in words.
        fitted_on: Method -> people it was fitted on, as "cmu/02"; methods fitted on nobody may be left out.
        facts: What it was measured on: (label, text) pairs: machine, versions, date, options.
        limitations: Known limitations, a sentence each.
        notes: Remarks on clips, a sentence each.
    """

    title: str
    methods: tuple[str, ...]
    rows: tuple[Row, ...]
    clips: tuple[ClipRuns, ...]
    reference: Reference | None = None
    claims: tuple[Claim, ...] = ()
    presets: Mapping[str, str] = field(default_factory=dict)
    fitted_on: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    facts: tuple[tuple[str, str], ...] = ()
    limitations: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def row(self, clip: str, method: str) -> Row | None:
        """The row of a clip and method, if there is one."""
        return next((r for r in self.rows if (r.clip, r.method) == (clip, method)), None)
