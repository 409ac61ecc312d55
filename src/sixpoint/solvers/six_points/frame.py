"""How a frame of six points begins and ends, whatever the method.

State between frames is one array (rows + 15, 4): ``local`` (rows, 4) are the anatomical local rotations of
the posed joints (as many as ``Model.balls`` has rows) and ``memory`` (15, 4) holds the estimated X axis, the
bending plane's normal (zero if none), the positions of pelvis and head, whether there was a frame before and
whether the X axis was ever told by wrists or ankles, the estimated Y axis, and rows for what a method
remembers beside. Avoidance has numbers beside the third and fourth.
"""

from sixpoint.kernels import quaternion as qt
from sixpoint.kernels import vector as vec
from sixpoint.kernels.jit import helper
from sixpoint.solvers.six_points.pelvis import estimate_x, says_something

MEMORY_ROWS = 15
FAR = 1e7  # m, a point farther away than this, or not a number, counts as lost
CONVERGED, UNREACHABLE, LOST = 0, 1, 2
REACHED = 0.01  # m, the paper's stop criterion (Unzueta et al. 2008, section 9)


@helper
def fill_lost(points, filled, memory, neutral_chord):
    """Copy the points; a lost pelvis or head follows the other, or stays where it was.

    Returns whether any of the six is lost.
    """
    lost = False
    for i in range(6):
        p = vec.load(points, i)
        here = abs(p[0]) < FAR and abs(p[1]) < FAR and abs(p[2]) < FAR  # false for NaN
        filled[i, 3] = 1.0 if here else 0.0
        if here:
            vec.store(filled, i, p)
        else:
            lost = True
    if filled[0, 3] * filled[1, 3] == 0.0:
        has_state = memory[4, 0] > 0.0
        neutral = (0.0, neutral_chord, 0.0)
        chord = vec.sub(vec.load(memory, 3), vec.load(memory, 2)) if has_state else neutral
        if filled[1, 3] > 0.0:
            vec.store(filled, 0, vec.sub(vec.load(filled, 1), chord))
        elif filled[0, 3] > 0.0:
            vec.store(filled, 1, vec.add(vec.load(filled, 0), chord))
        else:
            vec.store(filled, 0, vec.load(memory, 2))
            vec.store(filled, 1, vec.add(vec.load(memory, 2), chord))
    return lost


@helper
def estimate_pelvis(filled, memory, w1, w2, w3):
    """Estimated X and Y axes of the pelvis (Unzueta et al. 2008, section 4)."""
    y = vec.unit(vec.sub(vec.load(filled, 1), vec.load(filled, 0)))
    if vec.norm(y) < 0.5:  # pelvis and head coincide: the trunk keeps its direction
        y = vec.load(memory, 5) if memory[4, 0] > 0.0 else (0.0, 1.0, 0.0)
    x = estimate_x(filled, y, vec.load(memory, 0), memory[4, 1] > 0.0, w1, w2, w3)
    return x, y


@helper
def end_trunk(filled, memory, x, y, root, top, residual):
    """Remember where pelvis and head came to be; write their residuals."""
    if memory[4, 1] > 0.0 or says_something(filled, y):
        vec.store(memory, 0, x)
        memory[4, 1] = 1.0
    vec.store(memory, 2, root)
    vec.store(memory, 3, top)
    vec.store(memory, 5, y)
    memory[4, 0] = 1.0
    residual[0] = vec.norm(vec.sub(vec.load(filled, 0), root)) if filled[0, 3] > 0.0 else 0.0
    residual[1] = vec.norm(vec.sub(vec.load(filled, 1), top)) if filled[1, 3] > 0.0 else 0.0


@helper
def end_limb(target, limb, row, frame, place, upper, hinge, end, local, residual):
    """Store a posed limb, and how far its end, given from ``place`` in ``frame``, is off its target."""
    qt.store(local, row, upper)
    qt.store(local, row + 2, hinge)
    there = vec.add(place, qt.mul_vec(frame, end))
    residual[limb + 2] = vec.norm(vec.sub(target, there))


@helper
def judge(lost, residual):
    """Status of the frame: CONVERGED, UNREACHABLE (a residual above 1 cm) or LOST (some point is unknown)."""
    if lost:
        return LOST
    for i in range(6):
        if not residual[i] <= REACHED:
            return UNREACHABLE
    return CONVERGED


@helper
def write_rig(row, before, after, constant, origin, local, root, rotations, pelvis):
    """Anatomical local rotations -> the rig's local rotations (J, 4) and the pelvis' local position (3,)."""
    for j in range(row.shape[0]):
        k = row[j]
        if k >= 0:
            q = qt.mul(qt.load(before, j), qt.mul(qt.load(local, k), qt.load(after, j)))
            qt.store(rotations, j, q)
        else:
            qt.store(rotations, j, qt.load(constant, j))
    for i in range(3):
        pelvis[i] = root[i] - origin[0, i]


@helper
def write_frame(model, local, memory, rotations, pelvis):
    """The solved frame as local rotations of the rig, and where its pelvis is."""
    root = vec.load(memory, 2)
    write_rig(
        model.row, model.before, model.after, model.constant, model.origin, local, root, rotations, pelvis
    )
