"""The goals of a frame, from where the points were seen, the reconstruction, and the feet."""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import entry, helper
from sixpoint.solvers.hybrid.feet import ANKLES, FOLLOWING, HELD, hold_feet, is_seen

SEEN, FOLLOWS, STANDS, TURN = 0, 6, 12, 14
"""Rows of the hybrid's own tasks: six points as seen, as followed; ankles that stand; the pelvis' turn."""
LOST, OFF = float("nan"), float("inf")


@helper
def within_reach(hip, place, reach):
    """The place itself, or the nearest one that a stretched leg reaches: then the heel has to rise."""
    way = vec.sub(place, hip)
    length = vec.norm(way)
    return place if length <= reach else vec.madd(hip, reach / length, way)


@helper
def write_point(goals, row, place):
    for i in range(3):
        goals[row, i] = place[i]
    goals[row, 3], goals[row, 4], goals[row, 5], goals[row, 6] = 0.0, 0.0, 0.0, 1.0


@helper
def end_of(rotations, rig, base, pelvis, ends, k):
    """Where an end of the reconstruction is, given its rig's local rotations and the pelvis' place."""
    joint, place = int(ends[k, 3]), vec.load(ends, k)
    while joint >= 0:
        place = qt.mul_vec(qt.load(rotations, joint), place)
        if joint > base:
            place = vec.add(vec.load(rig, joint), place)
        joint = int(rig[joint, 3])
    return vec.add(pelvis, place)


@entry
def write_goals(points, wanted, rotations, states, rig, ends, legs, base, dt, floor, contacts, memory, goals):
    """Write the goals (F, T, 7) of the hybrid's own tasks.

    ``memory`` becomes that after the last frame.

    Args:
        points: (F, 6, 3) where the six points were seen [m].
        wanted: (F, 6, 3) where they should be [m]; of these feet are held.
        rotations: (F, J, 4) local rotations of the reconstruction, whose ends the body follows.
        states: (F, 2 J + 1, 4) the same as states of prioritized IK.
        rig: (J, 4) offset of each joint of the rig [m], and its parent.
        ends: (6, 4) place of each end in its joint's frame [m], and the joint.
        legs: (2, 4) the hips from the pelvis, and how far the legs reach [m].
        base: The pelvis.
        dt: Time between frames [s].
        floor: Its height [m]; infinite where it is to be learnt.
        contacts: Whether to hold feet.
        memory: See ``feet``.
        goals: What is written.
    """
    for f in range(points.shape[0]):
        pelvis, turn = vec.load(states[f], (states.shape[1] - 1) // 2), qt.load(states[f], base)
        for k in range(6):
            seen = is_seen(points[f], k)
            write_point(goals[f], SEEN + k, vec.load(points[f], k) if seen else (LOST, LOST, LOST))
            write_point(goals[f], FOLLOWS + k, end_of(rotations[f], rig, base, pelvis, ends, k))
        write_point(goals[f], TURN, (0.0, 0.0, 0.0))
        for i in range(4):
            goals[f, TURN, 3 + i] = turn[i]
        left, right = vec.load(wanted[f], ANKLES), vec.load(wanted[f], ANKLES + 1)
        why_left, why_right = FOLLOWING, FOLLOWING
        if contacts:
            left, why_left, right, why_right = hold_feet(wanted[f], dt, floor, memory)
        for k in range(2):
            place, why = (left, why_left) if k == 0 else (right, why_right)
            write_point(goals[f], STANDS + k, (OFF, OFF, OFF))
            if why == FOLLOWING:
                continue
            place = within_reach(vec.add(pelvis, qt.mul_vec(turn, vec.load(legs, k))), place, legs[k, 3])
            write_point(goals[f], FOLLOWS + ANKLES + k, (OFF, OFF, OFF) if why == HELD else place)
            if why == HELD:
                write_point(goals[f], STANDS + k, place)
