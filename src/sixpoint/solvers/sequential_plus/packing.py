"""How the constants of SIK+ cross into compiled code."""

from typing import NamedTuple

from sixpoint.kernels.jit import helper


class Settings(NamedTuple):
    """Whether limits hold, the constants (``solver.Habits``), and what follows from frame time and figure.

    Attributes:
        kept: Share of what told X that is kept over the frame.
        kept_speed: Share of the velocity that is kept over the frame.
        kept_tilt: Share of the Y axis that is kept over the frame.
        kept_lean: Share of the turn towards the ankles that is kept over the frame.
        rate: Frames per second; 0 where no time passed [Hz].
        dt: Time of the frame [s].
        head_site: Whether the head is an end site, turned by the last trunk joint.
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
    known_twist: float
    known_bend: float
    head_twist: float
    head_bend: float
    head_rise: float
    head_hold: float
    elbow_hand: float
    elbow_palm: float
    elbow_grip: float
    elbow_tilt: float
    knee_shank: float
    knee_toes: float
    knee_tilt: float
    swivel_lag: float
    swivel_memory: float
    swivel_speed: float
    turn_speed: float
    kept: float
    kept_speed: float
    kept_tilt: float
    kept_lean: float
    rate: float
    dt: float
    head_site: bool


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
        options[19],
        options[20],
        options[21],
        options[22],
        options[23],
        options[24],
        options[25],
        options[26],
        options[27],
        options[28],
        options[29],
        options[30],
        options[31],
        options[32],
        options[33],
        options[34],
        options[35],
        options[36],
        options[37],
        options[38],
        options[39] > 0.0,
    )
