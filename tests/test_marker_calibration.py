"""A person's lengths and marker places from labelled markers alone."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sixpoint.body import rotations as rot
from sixpoint.body.anthropometry import segments_of_skeleton
from sixpoint.body.figure import Figure
from sixpoint.body.markers.model import MarkerModel
from sixpoint.body.markers.recording import Markers
from sixpoint.body.markers.roles import find_marker_roles
from sixpoint.calibration.markers import calibrate_markers
from sixpoint.calibration.markers.posing import pose_markers
from sixpoint.calibration.model import stature_of
from sixpoint.errors import TargetError
from sixpoint.formats import load
from sixpoint.formats.markers import load_markers
from sixpoint.samples.range_of_motion import range_of_motion
from worn_markers import CMU, Worn, every_joint, wear

BONES = (
    ("l_hip", "l_knee"), ("l_knee", "l_ankle"), ("l_shoulder", "l_elbow"), ("l_elbow", "l_wrist"),
    ("l_hip", "r_hip"), ("l_shoulder", "r_shoulder"), ("vt1", "skullbase"),
)  # fmt: skip


@cache
def sweeping() -> tuple[Worn, MarkerModel]:
    worn = wear(seed=1)
    return worn, calibrate_markers(worn.markers)


@cache
def short() -> tuple[Markers, MarkerModel]:
    """A third of the frames, for what is only compared with itself."""
    markers = wear(seed=1).markers.sliced(slice(0, None, 3))
    return markers, calibrate_markers(markers)


def bones(figure: Figure) -> np.ndarray:
    at = dict(zip(figure.skeleton.names, figure.rest_positions, strict=True))
    trunk = np.linalg.norm((at["l_hip"] + at["r_hip"]) / 2 - at["vt1"])
    return np.array([*(np.linalg.norm(at[a] - at[b]) for a, b in BONES), trunk])


def offset_errors(found: MarkerModel, truth: MarkerModel) -> dict[str, float]:
    rows = [truth.names.index(name) for name in found.names]
    errors = np.linalg.norm(found.offsets - truth.offsets[rows], axis=1)
    return dict(zip(found.names, errors, strict=True))


def shuffled(markers: Markers, new_names: dict[str, str]) -> Markers:
    return replace(markers, names=tuple(new_names.get(name, name) for name in markers.names))


# --- the truth is found ---------------------------------------------------------------------------


def test_lengths_come_from_a_movement_of_all_joints():
    """All bones within a centimetre, whose lengths anatomy alone would miss by more."""
    worn, found = sweeping()
    guess = bones(Figure.from_stature(1.8)) - bones(worn.model.figure)
    errors = bones(found.figure) - bones(worn.model.figure)
    assert np.abs(errors).max() < 0.01 < 0.015 < np.abs(guess).max()


def test_marker_places_come_from_the_movement():
    """Offsets within 1.6 cm, half a centimetre on average; their spread is that of a trunk of many joints."""
    worn, found = sweeping()
    errors = offset_errors(found, worn.model)
    assert max(errors.values()) < 0.016 and np.mean(list(errors.values())) < 0.006
    assert np.nanmax(found.spread) < 0.013 and found.missing == ()


def test_the_calibration_movement_tells_the_limbs():
    """The range of motion that calibration asks for, with a millimetre of noise."""
    worn = wear(motion=range_of_motion, seed=1, noise=0.001)
    found = calibrate_markers(worn.markers)
    assert np.abs(bones(found.figure) - bones(worn.model.figure)).max() < 0.012
    errors = offset_errors(found, worn.model)
    assert max(errors.values()) < 0.02 and np.mean(list(errors.values())) < 0.006


def test_joints_are_where_they_were():
    """Posing the found figure by its markers puts all limb and trunk joints within 2 cm, 1 cm on average."""
    worn, found = sweeping()
    posed = pose_markers(found, worn.markers.sliced(slice(0, None, 2)))
    names = found.figure.skeleton.names
    joints = [
        k for k, name in enumerate(names) if not name.endswith(("1", "tarsal", "subtalar")) or name == "vt1"
    ]
    apart = np.linalg.norm(posed.motion.positions - worn.motion.positions[::2], axis=2)[:, joints]
    assert apart.mean() < 0.008 and apart.mean(axis=0).max() < 0.02
    assert posed.rms < 0.005 and posed.found.all()


def test_a_model_places_its_markers():
    """The residual that posing reports is the distance from the places of the model."""
    worn, found = sweeping()
    few = worn.markers.sliced(slice(0, 5))
    posed = pose_markers(found, few)
    away = np.linalg.norm(found.place(*posed.motion.transforms) - few.selected(found.names).positions, axis=2)
    np.testing.assert_allclose(posed.residuals, away, atol=1e-9)


# --- what must not matter -------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [0.6, 1.25])
def test_a_smaller_person_is_a_smaller_model(scale):
    """Lengths and offsets scale with the markers, but for the errors that are given in millimetres."""
    markers, found = short()
    scaled = calibrate_markers(replace(markers, positions=markers.positions * scale))
    np.testing.assert_allclose(bones(scaled.figure), scale * bones(found.figure), rtol=0.02, atol=0.003)


def test_the_world_does_not_matter():
    """Another origin and heading: the same person."""
    markers, found = short()
    turned = markers.positions @ np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]]) + [5.0, 0.3, -2.0]
    other = calibrate_markers(replace(markers, positions=turned))
    np.testing.assert_allclose(bones(other.figure), bones(found.figure), atol=0.002)


def test_a_mirrored_person_with_exchanged_labels_is_the_mirror_image():
    """Symmetric lengths stay; offsets change sides."""
    markers, _ = short()
    swap = {name: {"L": "R", "R": "L"}[name[0]] + name[1:] for name in CMU if name[0] in "LR"}
    del swap["RBAC"]
    kept = [name for name in markers.names if name != "RBAC"]
    markers = markers.selected(kept)
    mirrored = shuffled(replace(markers, positions=markers.positions * [-1.0, 1, 1]), swap)
    a, b = calibrate_markers(markers), calibrate_markers(mirrored)
    np.testing.assert_allclose(bones(b.figure), bones(a.figure), atol=0.004)
    knee = a.offsets[a.names.index("LKNE")] * [-1, 1, 1] - b.offsets[b.names.index("RKNE")]
    assert np.linalg.norm(knee) < 0.005


def test_gaps_do_little():
    """A quarter of all samples missing in bursts, markers seen never or once: still within 1.2 cm."""
    markers, full = short()
    points, rng = np.array(markers.positions), np.random.default_rng(0)
    for marker in range(points.shape[1]):
        for start in rng.integers(0, len(points), 3):
            points[start : start + 2, marker] = np.nan
    points[:, markers.index("RSHN")] = np.nan
    points[1:, [markers.index("LTHI"), markers.index("LSHN")]] = np.nan
    found = calibrate_markers(replace(markers, positions=points))
    assert "RSHN" not in found.names and len(found.names) == len(CMU) - 1
    assert np.abs(bones(found.figure) - bones(full.figure)).max() < 0.012


def test_a_marker_that_swaps_for_a_while_does_little():
    """Left and right knee exchanged in a tenth of the frames."""
    markers, found = short()
    points = np.array(markers.positions)
    pair = [markers.index("LKNE"), markers.index("RKNE")]
    points[5:7, pair] = points[5:7, pair[::-1]]
    other = calibrate_markers(replace(markers, positions=points))
    np.testing.assert_allclose(bones(other.figure), bones(found.figure), atol=0.012)


# --- few markers ----------------------------------------------------------------------------------


def test_legs_alone_name_what_is_missing():
    """A gait set: arms, head and trunk are named, and their lengths follow by proportion."""
    labels = [n for n in CMU if n[1:] in ["FWT", "BWT", "THI", "KNE", "SHN", "ANK", "HEE", "TOE"]]
    worn = wear(labels, seed=2)
    found = calibrate_markers(worn.markers)
    assert found.missing == ("head", "trunk", "l_arm", "r_arm")
    lengths, true = (segments_of_skeleton(f.skeleton) for f in (found.figure, worn.model.figure))
    assert abs(lengths["thigh"] - true["thigh"]) < 0.015
    assert lengths["upper_arm"] == pytest.approx(
        0.173 / 0.246 * (lengths["thigh"] + lengths["calf"]) / 2, rel=0.06
    )


def test_one_frame_is_enough_for_proportions():
    """A single standing frame: lengths within four centimetres, and no complaint."""
    worn = wear(seed=3, motion=range_of_motion)
    found = calibrate_markers(worn.markers.sliced(slice(0, 1)))
    assert np.abs(bones(found.figure) - bones(worn.model.figure)).max() < 0.04


def test_a_static_trial_adds_its_markers():
    """Medial markers that only the static trial has belong to the model, and the knee is better for them."""
    labels = (*CMU, "LKNEM", "RKNEM")
    still = wear(labels, seed=4, motion=range_of_motion)
    moving = wear(labels, seed=4)
    names = [name for name in CMU if name[1:] not in ("UPA", "FRM")]
    found = calibrate_markers(
        moving.markers.selected(names), still.markers.sliced(slice(0, 60)).selected(list(labels))
    )
    assert {"LKNEM", "RKNEM"} <= set(found.names)
    assert np.abs(bones(found.figure) - bones(moving.model.figure)).max() < 0.012


def test_a_wrist_under_a_bar_is_found():
    """Markers 15 cm apart on a bar over the back of the wrist: forearms and wrists within 1.2 cm."""
    worn = wear(seed=1)
    points, names, (positions, world) = (
        np.array(worn.markers.positions),
        worn.markers.names,
        worn.motion.transforms,
    )
    for side, out in (("l", 1.0), ("r", -1.0)):
        elbow = worn.model.figure.skeleton.index(f"{side}_elbow")
        wrist = worn.model.figure.skeleton.index(f"{side}_wrist")
        for label, front in (("WRA", 0.075), ("WRB", -0.075)):
            place = positions[:, wrist] + rot.mul_vec(world[:, elbow], np.array([out * 0.032, 0.0, front]))
            points[:, names.index(side.upper() + label)] = place
    markers = replace(worn.markers, positions=points)
    found = calibrate_markers(markers)
    posed = pose_markers(found, markers.sliced(slice(0, None, 2)))
    wrists = [found.figure.skeleton.index(f"{side}_wrist") for side in "lr"]
    apart = np.linalg.norm(posed.motion.positions - worn.motion.positions[::2], axis=2)[:, wrists]
    assert apart.mean(axis=0).max() < 0.012
    assert np.abs(bones(found.figure) - bones(worn.model.figure))[3] < 0.012


@pytest.mark.parametrize(
    ("label", "place"), [("LWRB", "LANK"), ("LWRA", "LANK"), ("LWRB", "LELB"), ("LWRB", "LFRM")]
)
def test_a_wrong_label_of_a_wrist_is_no_bar(label, place):
    """A wrist's label on an ankle, on the elbow or along the forearm: wrists are within 1.5 cm."""
    worn, step = wear(seed=1), slice(0, None, 2)
    points, names = np.array(worn.markers.positions), worn.markers.names
    points[:, names.index(label)] = points[:, names.index(place)] + [0.0, 0.02, 0.0]
    markers = replace(worn.markers, positions=points).sliced(step)
    found = calibrate_markers(markers)
    apart = np.linalg.norm(
        pose_markers(found, markers).motion.positions - worn.motion.positions[step], axis=2
    )
    wrists = [found.figure.skeleton.index(f"{side}_wrist") for side in "lr"]
    assert apart.mean(axis=0)[wrists].max() < 0.015
    assert abs(bones(found.figure) - bones(worn.model.figure))[3] < 0.012


def test_landmarks_of_joint_centres_are_joints():
    """Hips, knees, ankles and shoulders as pose estimators give them: bones are the distances between."""
    figure = Figure.from_stature(1.7)
    motion = every_joint(figure)
    centres = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
    names = [f"{side}_{joint}" for joint in centres for side in "lr"]
    points = motion.positions[:, [figure.skeleton.index(name) for name in names]]
    labels = tuple(f"{ {'l': 'left', 'r': 'right'}[n[0]] }_{n[2:]}" for n in names)
    found = calibrate_markers(Markers(labels, points, 30.0))
    np.testing.assert_allclose(bones(found.figure)[:6], bones(figure)[:6], atol=0.01)
    assert np.abs(found.spread).max() < 0.01 and found.missing == ("head",)


# --- complaints -----------------------------------------------------------------------------------


def test_a_set_without_a_pelvis_says_what_would_do():
    """Two markers of the pelvis are not enough: named, with what would be."""
    worn = wear(seed=1)
    names = [n for n in CMU if n[1:] in ["FWT", "THI", "KNE", "SHN", "ANK"] and n != "RFWT"]
    with pytest.raises(TargetError, match=r"LFWT \(l_asis, seen in 100%.*enough would be both anterior"):
        calibrate_markers(worn.markers.selected(names))


def test_pelvis_markers_must_be_seen_together():
    """Four markers of which never three are seen at once."""
    worn = wear([n for n in CMU if n[1:] in ["FWT", "BWT", "THI", "KNE", "SHN", "ANK"]], seed=1)
    points = np.array(worn.markers.positions)
    points[::2, [worn.markers.index(n) for n in ("LFWT", "LBWT")]] = np.nan
    points[1::2, [worn.markers.index(n) for n in ("RFWT", "RBWT")]] = np.nan
    with pytest.raises(TargetError, match=r"in no frame.*seen in 50%"):
        calibrate_markers(replace(worn.markers, positions=points))


def test_nothing_seen_and_nothing_known_are_said():
    """All-missing markers, and labels of no set."""
    worn = wear(seed=1, motion=range_of_motion)
    few = worn.markers.sliced(slice(0, 10))
    with pytest.raises(TargetError, match="none of the markers is ever seen"):
        calibrate_markers(replace(few, positions=np.full_like(few.positions, np.nan)))
    with pytest.raises(TargetError, match=r"no label is of a known marker set.*layout"):
        calibrate_markers(replace(few, names=tuple(f"u{k}" for k in range(len(few.names)))))


@pytest.mark.parametrize(("unit", "name"), [(1000.0, "millimetres"), (100.0, "centimetres")])
def test_a_giant_is_a_wrong_unit(unit, name):
    """A person of 1.8 km: the message guesses the unit."""
    worn = wear(seed=1, motion=range_of_motion)
    few = worn.markers.sliced(slice(0, 20))
    with pytest.raises(TargetError, match=f"a person .* m tall; expected 0.6 to 2.5 m.*{name}"):
        calibrate_markers(replace(few, positions=few.positions * unit))


def test_exchanged_sides_are_reported():
    """A mirrored file, and one swapped pair by name."""
    worn, _ = sweeping()
    swap = {n: {"L": "R", "R": "L"}[n[0]] + n[1:] for n in CMU if n not in ("RBAC",) and n[0] in "LR"}
    with pytest.raises(TargetError, match="left and right are mirrored"):
        calibrate_markers(shuffled(worn.markers, swap))
    with pytest.raises(TargetError, match="LKNE and RKNE"):
        calibrate_markers(shuffled(worn.markers, {"LKNE": "RKNE", "RKNE": "LKNE"}))
    with pytest.raises(TargetError, match="swapped: LWRA and RWRA;"):
        calibrate_markers(shuffled(worn.markers, {"LWRA": "RWRA", "RWRA": "LWRA"}))
    with pytest.raises(TargetError, match="swapped: LANK and RANK;"):
        calibrate_markers(shuffled(worn.markers, {"LANK": "RANK", "RANK": "LANK"}))


# --- recordings -----------------------------------------------------------------------------------


BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
QUIETLY = pytest.mark.filterwarnings("ignore::UserWarning")


@QUIETLY
@pytest.mark.parametrize("layout", [None, "markers24"])
def test_a_real_take_is_calibrated_from_its_markers(data, monkeypatch, layout):
    """CMU 02_05: markers within 0.8 cm of their places, joints within 4 cm of its AMC's, hips within 2.5."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    from takes import compare_take, find_lag

    markers = load_markers(data / "c3d" / "02_05.c3d")
    if layout:
        markers = markers.selected(list(find_marker_roles(markers.names, layout).roles))
    found = calibrate_markers(markers)
    assert np.sqrt(np.nanmean(found.spread**2)) < 0.008 and found.missing == ()
    assert 1.6 < stature_of(found.figure) < 1.75
    posed = pose_markers(found, markers.sliced(slice(None, None, 8)))
    take = load(data / "cmu" / "02_05.amc").sliced(slice(None, None, 8))
    apart = compare_take(posed.motion, take)
    assert posed.rms < 0.008 and apart.mean < 0.038
    distance = dict(zip(apart.names, apart.distance.mean(axis=0), strict=True))
    assert max(distance["l_hip"], distance["r_hip"]) < 0.025 and max(distance.values()) < 0.09
    assert find_lag(posed.motion, take) == 0


@QUIETLY
@pytest.mark.parametrize(
    ("path", "bounds"),
    [
        ("c3d/opensim_walking2.c3d", {"hip": 0.04, "knee": 0.03, "ankle": 0.015}),
        ("trc/nimblephysics_OpenCapUnfiltered_walking2.trc", {"hip": 0.03}),
        ("trc/nimblephysics_Subject4_squats1.trc", {"hip": 0.017}),
    ],
)
def test_centres_of_joints_in_real_files_are_found_without_them(data, path, bounds):
    """Hips, knees and ankles that the laboratory computed; without these labels in the calibration."""
    markers = load_markers(data / path)
    roles = find_marker_roles(markers.names)
    models = ("_centre", "_centre_regression")
    skin = markers.selected([n for n in markers.names if not roles.roles.get(n, "").endswith(models)])
    posed = pose_markers(calibrate_markers(skin), skin.sliced(slice(None, None, 4)))
    assert posed.rms < 0.007
    for joint, bound in bounds.items():
        for side in "lr":
            truth = markers.positions[::4, markers.index(roles.labels[f"{side}_{joint}_centre"])]
            ours = posed.motion.positions[:, posed.motion.skeleton.index(f"{side}_{joint}")]
            assert np.nanmean(np.linalg.norm(ours - truth, axis=1)) < bound, (side, joint)


@QUIETLY
@pytest.mark.parametrize("path", ["c3d/02_05.c3d", "c3d/opensim_walking2.c3d"])
def test_feet_are_level_in_the_neutral_pose(data, path):
    """From heel to toe as in standing, within 8 degrees: a level axis of inversion tilts them by 30."""
    markers = load_markers(data / path)
    found = calibrate_markers(markers)
    labels = find_marker_roles(markers.names).labels
    for side in "lr":
        ends = [labels[f"{side}_{role}"] for role in ("heel", "toe")]
        sole = np.subtract(*(found.offsets[found.names.index(name)] for name in ends[::-1]))
        heights = [np.nanpercentile(markers.positions[:, markers.index(name), 1], 5) for name in ends]
        slope = np.arcsin((heights[1] - heights[0]) / np.linalg.norm(sole))
        assert abs(np.arctan2(sole[1], np.hypot(sole[0], sole[2])) - slope) < np.radians(8.0)


@QUIETLY
def test_a_label_that_leaves_its_foot_does_little(data):
    """nick_freeform: in the last 126 frames RTOE is a point at the height of the shoulders."""
    markers = load_markers(data / "c3d" / "nimblephysics_nick_freeform_001.c3d")
    markers = markers.selected([name for name in markers.names if not name.endswith("HIP")])  # of the thigh
    found = calibrate_markers(markers)
    posed = pose_markers(found, markers.sliced(slice(None, None, 8)))
    toe = posed.residuals[:, found.names.index("Nick01:RTOE")]
    near = posed.residuals[posed.residuals < 0.1]
    assert np.nanmax(toe) > 1.0 and np.sqrt(np.mean(near**2)) < 0.014
