"""How the constants of SIK+ cross into compiled code."""

from typing import NamedTuple

from sixpoint.kernels.jit import helper


class Settings(NamedTuple):
    """Whether limits hold, the constants (see ``solver.Habits``), and what follows from the frame time.

    Attributes:
        kept: Share of what told X that is kept over the frame.
        kept_speed: Share of the velocity that is kept over the frame.
        rate: Frames per second; 0 where no time passed [Hz].
    """

    limits: bool
    chord_share: float
    leg_share: float
    wrist_line: float
    ankle_line: float
    reach: float
    speed: float
    twist_share: float
    bend_share: float
    low_joint: float
    neck_curve: float
    elbow_out: float
    elbow_down: float
    elbow_back: float
    elbow_lift: float
    knee_out: float
    kept: float
    kept_speed: float
    rate: float


@helper
def unpack_settings(options):
    """Settings from numbers."""
    return Settings(
        options[0] > 0.0,
        options[1],
        options[2],
        options[3],
        options[4],
        options[5],
        options[6],
        options[7],
        options[8],
        options[9],
        options[10],
        options[11],
        options[12],
        options[13],
        options[14],
        options[15],
        options[16],
        options[17],
        options[18],
    )
