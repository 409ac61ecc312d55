"""Joint angles: their signs in words, the rotations rebuilt from them, the files read by others."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sixpoint as sp
from body_rigs import exercise, random_quaternions, reframed
from sixpoint.body import rotations as rot
from sixpoint.body.joint_angles import LIMBS, JointAngles, compute_joint_angles
from sixpoint.body.limits import Limits
from sixpoint.errors import FigureError, FormatError
from sixpoint.formats import load_markers, save_markers
from sixpoint.formats.angles import save_angles
from sixpoint.jobs.track.job import track
from sixpoint.jobs.track.options import Following
from sixpoint.samples import make_sample

FIGURE = sp.Figure.from_stature(1.75)
RISE = np.radians(42.0)  # of the subtalar axis to the front
AXES = dict(zip("xyz", np.eye(3), strict=True)) | {"subtalar": np.array([0.0, np.sin(RISE), np.cos(RISE)])}
SEGMENT = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]])  # forward, up and right in ours (X left, Z forward)
FACING_X = Rotation.from_euler("y", 90, degrees=True)  # from our +Z, where figures look, to OpenSim's +X


def posed(**turns: tuple[str, float]) -> JointAngles:
    """Angles of the figure facing +X with single joints turned: role_side -> (axis of ours, degrees)."""
    rotations = np.tile([0.0, 0, 0, 1], (1, len(FIGURE.skeleton), 1))
    for where, (axis, degrees) in turns.items():
        role, _, side = where.partition("_")
        joint = getattr(FIGURE.roles, role)
        joint = joint["lr".index(side)] if side else joint if isinstance(joint, int) else joint[0]
        turn = Rotation.from_rotvec(np.radians(degrees) * AXES[axis])
        rotations[0, joint] = turn.as_quat()
    pelvis = FIGURE.roles.pelvis
    rotations[0, pelvis] = (FACING_X * Rotation.from_quat(rotations[0, pelvis])).as_quat()
    return compute_joint_angles(FIGURE.compute_motion(rotations, np.zeros((1, 3)), 60.0), FIGURE)


# Ours: turning about -X brings what hangs down to the front; about +Z, what hangs down to the left (+X).
SIGNS = [
    ({"hip_r": ("x", -30)}, "hip_flexion_r", 30, "the right thigh forward is flexion"),
    ({"hip_l": ("x", -30)}, "hip_flexion_l", 30, "and so is the left one"),
    ({"hip_r": ("z", 20)}, "hip_adduction_r", 20, "the right thigh to the left is adduction"),
    ({"hip_l": ("z", 20)}, "hip_adduction_l", -20, "the left thigh to the left is abduction"),
    ({"hip_r": ("y", 15)}, "hip_rotation_r", 15, "the right toes to the left: internal rotation"),
    ({"hip_l": ("y", 15)}, "hip_rotation_l", -15, "the left toes to the left: external rotation"),
    ({"knee_r": ("x", 60)}, "knee_angle_r", -60, "the calf backward: flexion is negative in gait2392"),
    ({"ankle_l": ("x", -10)}, "ankle_angle_l", 10, "the toes up: dorsiflexion"),
    ({"ankle_r": ("subtalar", 20)}, "subtalar_angle_r", 20, "the right sole to the left: inversion"),
    ({"ankle_l": ("subtalar", 20)}, "subtalar_angle_l", -20, "the left sole to the left: eversion"),
    ({"shoulder_r": ("x", -90)}, "arm_flex_r", 90, "the arm forward: flexion"),
    ({"shoulder_r": ("z", -70)}, "arm_add_r", -70, "the right arm to the right: abduction"),
    ({"shoulder_l": ("z", 70)}, "arm_add_l", -70, "the left arm to the left: abduction"),
    ({"elbow_l": ("x", -80)}, "elbow_flex_l", 80, "the forearm forward: flexion"),
    ({"elbow_r": ("y", 40)}, "pro_sup_r", 40, "the right thumb to the left: pronation"),
    ({"wrist_r": ("z", 25)}, "wrist_flex_r", 25, "the right hand to the left: the palm's side"),
    ({"wrist_r": ("x", -12)}, "wrist_dev_r", 12, "the hand forward: the thumb's side"),
    ({"pelvis": ("y", 25)}, "pelvis_rotation", 25, "the pelvis to the left"),
    ({"pelvis": ("x", -8)}, "pelvis_tilt", 8, "the front of the pelvis up"),
    ({"pelvis": ("z", 6)}, "pelvis_list", 6, "the right side of the pelvis down"),
    ({"spine": ("x", 30)}, "lumbar_extension", -30, "the trunk forward is flexion"),
    ({"spine": ("z", 15)}, "lumbar_bending", 15, "the trunk to the right"),
    ({"spine": ("y", 20)}, "lumbar_rotation", 20, "the trunk to the left"),
]


@pytest.mark.parametrize(("turns", "name", "degrees", "why"), SIGNS, ids=[sign[1] for sign in SIGNS])
def test_signs_are_those_of_opensim(turns, name, degrees, why):
    """One joint turned: one angle, with the sign that its name says, and nothing else."""
    angles = posed(**turns)
    expected = [degrees if column == name else 0.0 for column in angles.names]
    np.testing.assert_allclose(angles.values[0], expected, atol=1e-9, err_msg=why)


def test_names_begin_as_in_gait2392():
    """All coordinates of gait2392 but the toes' are there, and the pelvis comes first."""
    names = posed().names
    assert names[:6] == (
        "pelvis_tilt",
        "pelvis_list",
        "pelvis_rotation",
        "pelvis_tx",
        "pelvis_ty",
        "pelvis_tz",
    )
    legs = ("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle", "subtalar_angle")
    assert {f"{name}_{side}" for name in legs for side in "lr"} | {
        "lumbar_extension",
        "lumbar_bending",
        "lumbar_rotation",
    } <= set(names)
    assert len(set(names)) == len(names) == 6 + 6 + 2 * 3 * len(LIMBS)


@pytest.mark.parametrize("sample", ["walk", "boxing", "climb_and_hang", "jump_kick"])
def test_rotations_follow_from_the_angles(sample):
    """SciPy rebuilds pelvis, limbs and trunk from the angles alone, and no angle jumps."""
    motion = make_sample(sample, FIGURE)
    angles = compute_joint_angles(motion, FIGURE)
    world = Rotation.from_quat(motion.transforms[1].reshape(-1, 4)).as_matrix().reshape(len(motion), -1, 3, 3)
    frames = world @ SEGMENT
    roles = FIGURE.roles

    def rebuilt(columns, mirror=1):
        turns = np.stack([angles[column] for column in columns], axis=1) * [1, mirror, mirror]
        return Rotation.from_euler("ZXY", turns, degrees=True).as_matrix()

    pelvis = rebuilt(("pelvis_tilt", "pelvis_list", "pelvis_rotation"))
    np.testing.assert_allclose(pelvis, frames[:, roles.pelvis], atol=1e-9)
    for k, (side, mirror) in enumerate((("l", -1), ("r", 1))):
        above = frames[:, roles.pelvis]
        for joint in ("hip", "knee", "ankle"):
            turn = rebuilt([f"{column}_{side}" for column in LIMBS[joint]], mirror)
            tilt = Rotation.from_euler("z", RISE if joint == "ankle" else 0.0).as_matrix()
            above = above @ tilt @ turn @ tilt.T
            np.testing.assert_allclose(above, frames[:, getattr(roles, joint)[k]], atol=1e-9)
        arm = [rebuilt([f"{c}_{side}" for c in LIMBS[j]], mirror) for j in ("shoulder", "elbow", "wrist")]
        torso = pelvis @ rebuilt(("lumbar_extension", "lumbar_bending", "lumbar_rotation"))
        np.testing.assert_allclose(torso @ arm[0] @ arm[1] @ arm[2], frames[:, roles.wrist[k]], atol=1e-9)
    place = np.stack([angles[f"pelvis_t{axis}"] for axis in "xyz"], axis=1)
    np.testing.assert_array_equal(place, motion.positions[:, roles.pelvis])
    jumps = np.abs(np.diff(angles.values, axis=0))
    assert np.all(jumps <= 180.0 + 1e-9)


@pytest.mark.parametrize("side", [0, 1])
def test_the_two_angles_of_an_ankle_are_the_figures_own(side):
    """Dorsiflexion, then inversion about the hinges that limits have: both come back, the third is zero."""
    hinges = Limits.default().ankle(1.0 - 2.0 * side)
    turns = np.random.default_rng(side).uniform(hinges.lower, hinges.upper, (50, 2))
    flexed, rolled = (Rotation.from_rotvec(turns[:, [k]] * hinges.axes[k]) for k in range(2))
    rotations = np.tile([0.0, 0, 0, 1], (50, len(FIGURE.skeleton), 1))
    rotations[:, FIGURE.roles.ankle[side]] = (flexed * rolled).as_quat()
    angles = compute_joint_angles(FIGURE.compute_motion(rotations, np.zeros((50, 3)), 60.0), FIGURE)
    found = [angles[f"{name}_{'lr'[side]}"] for name in LIMBS["ankle"]]
    inward = 1.0 if side else -1.0
    expected = [-np.degrees(turns[:, 0]), inward * np.degrees(turns[:, 1]), np.zeros(50)]
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("heading", [-135, -90, -30, 0, 60, 90])
def test_the_pelvis_lies_in_the_unturned_world(heading):
    """Who faces +X has pelvis_rotation 0, who faces +Z, as figures at rest, -90; the place is the joint's."""
    rotations = np.tile([0.0, 0, 0, 1], (1, len(FIGURE.skeleton), 1))
    # Turning left from +X leads towards -Z.
    ahead = np.array([np.cos(np.radians(heading)), 0.0, -np.sin(np.radians(heading))])
    turn = np.column_stack([np.cross([0, 1, 0], ahead), [0, 1, 0], ahead])  # our X left, Y up, Z forward
    rotations[0, FIGURE.roles.pelvis] = Rotation.from_matrix(turn).as_quat()
    motion = FIGURE.compute_motion(rotations, np.array([[0.5, 1.0, -2.0]]), 60.0)
    angles = compute_joint_angles(motion, FIGURE)
    assert angles["pelvis_rotation"][0] == pytest.approx(heading)
    assert angles["pelvis_tilt"][0] == pytest.approx(0, abs=1e-9)
    np.testing.assert_array_equal(angles.values[0, 3:6], motion.positions[0, FIGURE.roles.pelvis])


def test_angles_lie_in_the_laboratory_of_the_markers(data, tmp_path):
    """OpenSim's walking person: the .mot has the heading and place of the pelvis markers of the .trc."""
    trials = [data / "trc" / f"opensim_subject01_{name}.trc" for name in ("walk", "static")]
    if not all(path.exists() for path in trials):
        pytest.skip("no recording of OpenSim's subject01 in the data")
    markers = load_markers(trials[0]).sliced(slice(0, 30))
    save_markers(markers, tmp_path / "walk.trc", unit="m")
    track(tmp_path / "walk.trc", tmp_path / "walk.mot", following=Following(static=trials[1]))
    _, names, rows = read_mot(tmp_path / "walk.mot")
    mot = dict(zip(names, rows.T, strict=True))
    trc = np.loadtxt(trials[0], skiprows=6)[:30, 2:].reshape(30, -1, 3) / 1000  # our reader is not asked
    left, right, back = (trc[:, markers.names.index(name)] for name in ("L.ASIS", "R.ASIS", "V.Sacral"))
    across = right - left
    heading = np.degrees(np.arctan2(across[:, 0], across[:, 2]))  # of the line to +Z, about +Y
    np.testing.assert_allclose(mot["pelvis_rotation"], heading, atol=4)
    place = np.column_stack([mot[f"pelvis_t{axis}"] for axis in "xyz"])
    shift = place - ((left + right) / 2 + back) / 2
    assert np.abs(shift).max() < 0.03
    written = np.loadtxt(tmp_path / "walk.trc", skiprows=6)[:, 2:]
    np.testing.assert_allclose(written, trc.reshape(30, -1), atol=1e-8)


def test_an_arm_raised_sideways_passes_ninety_degrees():
    """From hanging to overhead: -arm_add runs from 0 to 170, the two others stay."""
    rotations = np.tile([0.0, 0, 0, 1], (86, len(FIGURE.skeleton), 1))
    turns = np.arange(0, 172, 2.0)
    rotations[:, FIGURE.roles.shoulder[1]] = Rotation.from_euler("z", -turns[:, None], degrees=True).as_quat()
    angles = compute_joint_angles(FIGURE.compute_motion(rotations, np.zeros((86, 3)), 60.0), FIGURE)
    np.testing.assert_allclose(angles["arm_add_r"], -turns, atol=1e-6)
    inside = np.abs(turns - 90) > 1  # where the others are not determined
    np.testing.assert_allclose(angles["arm_flex_r"][inside], 0, atol=1e-6)
    np.testing.assert_allclose(angles["arm_rot_r"][inside], 0, atol=1e-6)


def test_the_rig_does_not_matter():
    """The same movement on a rig with other joint frames and another size has the same angles."""
    motion = exercise(FIGURE, 40)
    frames = random_quaternions(np.random.default_rng(2), len(FIGURE.skeleton))
    other = reframed(motion, frames, scale=1.1)
    figure = replace(FIGURE, skeleton=other.skeleton, neutral=rot.mul(FIGURE.neutral, frames))
    ours, theirs = compute_joint_angles(motion, FIGURE), compute_joint_angles(other, figure)
    np.testing.assert_allclose(theirs.values[:, 6:], ours.values[:, 6:], atol=1e-6)
    np.testing.assert_allclose(theirs.values[:, 3:6], 1.1 * ours.values[:, 3:6], atol=1e-9)


def read_mot(path) -> tuple[dict[str, str], list[str], np.ndarray]:
    """A reader of its own for .mot: header, names, rows."""
    head, _, body = path.read_text().partition("endheader\n")
    header = dict(line.split("=", 1) for line in head.splitlines() if "=" in line and " " not in line)
    lines = body.splitlines()
    return header, lines[0].split("\t"), np.array([line.split("\t") for line in lines[1:]], float)


def test_files_are_read_by_others(tmp_path):
    """An independent reader of .mot, and the csv module, find counts, unit, names and numbers."""
    angles = compute_joint_angles(make_sample("walk", FIGURE), FIGURE)
    save_angles(angles, tmp_path / "a.mot")
    header, names, rows = read_mot(tmp_path / "a.mot")
    assert header["inDegrees"] == "yes" and header["version"] == "1"
    assert (int(header["nRows"]), int(header["nColumns"])) == rows.shape == (len(angles), len(names))
    assert names == ["time", *angles.names]
    np.testing.assert_allclose(rows[:, 0], np.arange(len(angles)) / 60, atol=1e-8)
    np.testing.assert_allclose(rows[:, 1:], angles.values, atol=1e-8)
    save_angles(angles, tmp_path / "a.csv")
    with (tmp_path / "a.csv").open() as stream:
        table = list(csv.DictReader(stream))
    np.testing.assert_allclose(
        [float(row["knee_angle_l"]) for row in table], angles["knee_angle_l"], atol=1e-8
    )
    assert angles["knee_angle_l"].min() < -40 and angles["hip_flexion_r"].max() > 15  # it is a walk


def test_mistakes(tmp_path):
    """Other skeletons, unknown suffixes, files that exist."""
    angles = posed()
    with pytest.raises(FigureError, match="another skeleton"):
        compute_joint_angles(sp.load(_bvh(tmp_path)), FIGURE)
    with pytest.raises(FormatError, match=r"joint angles are written as \.mot, \.csv"):
        save_angles(angles, tmp_path / "a.sto")
    save_angles(angles, tmp_path / "a.mot")
    with pytest.raises(FormatError, match="exists"):
        save_angles(angles, tmp_path / "a.mot")


def _bvh(folder):
    path = folder / "a.bvh"
    path.write_text(
        "HIERARCHY\nROOT A\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
        "End Site\n{\nOFFSET 0 1 0\n}\n}\n"
        "MOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0\n"
    )
    return path
