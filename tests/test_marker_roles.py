"""Roles of markers from their labels, over all sets that ship."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from conftest import recordings
from marker_bodies import misplaced_roles, walking_markers
from sixpoint.body.markers.roles import _sets, find_marker_roles, segments_of_roles
from sixpoint.errors import FormatError, TargetError
from sixpoint.formats.markers import load_markers

WALK = walking_markers(60)

SIDED_GAIT = "ASI PSI THI KNE TIB ANK HEE TOE FHD BHD SHO UPA ELB FRM WRA WRB FIN"
SIDED_CMU = "FWT BWT THI KNE SHN ANK HEE TOE MT5 FHD BHD SHO UPA ELB FRM WRA WRB FIN"
SIDED_RIZZOLI = "ASIS PSIS GT LE HF TT LM CA FM SM VM ME MM"
SIDED_HAYES = "Shoulder Elbow Wrist ASIS Thigh Knee Shank Ankle Heel Toe"
BODY = """nose left_eye_inner left_eye left_eye_outer right_eye_inner right_eye right_eye_outer left_ear
    right_ear mouth_left mouth_right left_shoulder right_shoulder left_elbow right_elbow left_wrist
    right_wrist left_pinky right_pinky left_index right_index left_thumb right_thumb left_hip
    right_hip left_knee right_knee left_ankle right_ankle left_heel right_heel left_foot_index
    right_foot_index"""
BASELINE = """HeadTop HeadFront HeadSide BackTop Chest BackLeft BackRight WaistLFront WaistRFront WaistLBack
    WaistRBack LShoulderBack RShoulderBack LShoulderTop RShoulderTop LElbowOut RElbowOut LUArmHigh
    RUArmHigh LWristOut RWristOut LWristIn RWristIn LHandOut RHandOut LThighFront RThighFront
    LKneeOut RKneeOut LShin RShin LAnkleOut RAnkleOut LToeOut RToeOut LToeIn RToeIn"""

PLUG_IN_GAIT = [f"{s}{name}" for s in "LR" for name in SIDED_GAIT.split()]
PLUG_IN_GAIT += ["C7", "T10", "CLAV", "STRN", "RBAK"]
CMU = [f"{s}{name}" for s in "LR" for name in SIDED_CMU.split()] + ["C7", "T10", "CLAV", "STRN", "RBAC"]
RIZZOLI = [f"{s}{name}" for s in "LR" for name in SIDED_RIZZOLI.split()]
HAYES = [f"{s}.{name}" for s in "LR" for name in SIDED_HAYES.split()]
HAYES += ["Top.Head", "Front.Head", "Rear.Head", "V.Sacral", "R.Offset", "R.Knee.Medial", "L.Knee.Medial"]
LANDMARKS, OPTITRACK = BODY.split(), BASELINE.split()
SETS = {
    "Plug-in Gait": PLUG_IN_GAIT,
    "CMU 41": CMU,
    "OptiTrack": OPTITRACK,
    "Rizzoli": RIZZOLI,
    "Helen Hayes": HAYES,
    "pose landmarks": LANDMARKS,
}


def test_every_set_names_known_roles_and_segments():
    """The table has no role that it does not explain, and each role has one segment."""
    known = segments_of_roles()
    for name, labels in _sets().items():
        assert set(labels.values()) <= set(known), name
    assert known["l_knee_lateral"] == "l_thigh" and known["r_asis"] == "pelvis"


@pytest.mark.parametrize("name", _sets())
def test_a_set_is_recognised_by_its_own_labels(name):
    """The whole of a set is found to be that set, each role once, whatever the case and the signs."""
    one_each = {role: label for label, role in _sets()[name].items()}
    found = find_marker_roles([label.upper() for label in one_each.values()])
    assert set(found.labels) == set(one_each) and not found.unknown
    assert found.set_name == name and found.share == 1.0


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("prefix", ["", "Subject:", "nick_", "Jim.", "S 1:"])
def test_usual_files_are_recognised_whole(name, prefix):
    """Labels as the vendors write them have all their roles, with or without a subject before them."""
    labels = [prefix + label for label in SETS[name]]
    found = find_marker_roles(labels)
    assert found.set_name == name and not found.unknown and list(found.roles) == labels
    assert len(set(found.roles.values())) == len(labels)
    for label, role in found.roles.items():
        bare = label.removeprefix(prefix)
        if bare[:4].lower() in ("left", "righ") or (bare[0] in "LR" and bare != "Rear.Head"):
            assert role[:2] == f"{bare[0].lower()}_", label


def test_a_label_means_what_its_set_says():
    """LME is the knee among Rizzoli's labels; RKnee is a centre in a video and a marker in the laboratory."""
    assert find_marker_roles(RIZZOLI).roles["LME"] == "l_knee_medial"
    assert find_marker_roles(["RKnee", "RHip", "RAnkle", "Neck"]).roles["RKnee"] == "r_knee_centre"
    assert find_marker_roles(HAYES).roles["R.Knee"] == "r_knee_lateral"
    both = find_marker_roles(
        ["RKnee", "RHip", "r_knee_study", "r.ASIS_study", "L.ASIS_study", "r_calc_study", "C7_study"]
    )
    assert both.roles["RKnee"] == "r_knee_centre" and both.roles["r_knee_study"] == "r_knee_lateral"
    assert both.set_name == "OpenCap augmented" and both.share == 5 / 7


def test_pieces_of_trajectories_have_the_role_of_the_whole():
    """CMU numbers pieces behind a hyphen; the first of them takes the role."""
    found = find_marker_roles(["LFWT-3", "RFWT", "LFWT-7", "LBWT", "C7"])
    assert found.roles["LFWT-3"] == "l_asis" and found.unknown == ("LFWT-7",)


def test_of_two_people_the_one_with_more_markers_is_taken():
    """The other's labels are listed as unknown."""
    found = find_marker_roles(["anna:LASI", "nick:LASI", "nick:RASI", "nick:C7", "anna:C7"])
    assert found.subject == "nick" and found.labels["l_asis"] == "nick:LASI"
    assert found.unknown == ("anna:LASI", "anna:C7")


@pytest.mark.parametrize("labels", [PLUG_IN_GAIT, CMU])
def test_twenty_four_markers_ship(labels):
    """The layout takes 24 roles of either set and nothing else."""
    found = find_marker_roles(["X:" + label for label in labels], "markers24")
    assert len(found.roles) == 24 and found.set_name == "24 markers"
    assert {"l_asis", "l_psis", "c7", "l_acromion", "r_toe"} <= set(found.labels)
    assert len(found.unknown) == len(labels) - 24


def test_a_users_layout(tmp_path):
    """Labels get roles, or only segments; other labels are still looked for, unless it is the only one."""
    path = tmp_path / "mine.toml"
    path.write_text(
        '[markers]\nM1 = "l_knee_lateral"\nM2 = {segment = "l_shank"}\n"M 3" = {role = "r_toe"}\n'
    )
    found = find_marker_roles(["M1", "M2", "m_3", "LASI", "M9"], path)
    assert found.roles == {"M1": "l_knee_lateral", "M2": "marker_m2", "m_3": "r_toe", "LASI": "l_asis"}
    assert found.segments["M2"] == "l_shank" and found.segments["m_3"] == "r_foot"
    assert found.unknown == ("M9",) and found.set_name == "mine"
    path.write_text('only = true\n[markers]\nM1 = "l_knee_lateral"\n')
    assert find_marker_roles(["M1", "LASI"], path).unknown == ("LASI",)


def test_mistakes_in_layouts_say_what_would_be_right(tmp_path):
    """The message names layout and label, and lists the roles or segments that there are."""
    with pytest.raises(TargetError, match=r"M1 has the unknown role 'knee'.*l_knee_lateral"):
        find_marker_roles(["M1"], {"markers": {"M1": "knee"}})
    with pytest.raises(TargetError, match=r"unknown segment 'leg'.*l_thigh"):
        find_marker_roles(["M1"], {"markers": {"M1": {"segment": "leg"}}})
    with pytest.raises(TargetError, match="must be a role"):
        find_marker_roles(["M1"], {"markers": {"M1": 3}})
    with pytest.raises(TargetError, match=r"needs a table \[markers\]"):
        find_marker_roles(["M1"], {"name": "x"})
    with pytest.raises(FormatError, match=r"no such layout.*markers24"):
        find_marker_roles(["M1"], "markers99")
    (tmp_path / "bad.toml").write_text("[markers\n")
    with pytest.raises(FormatError, match="not a TOML file"):
        find_marker_roles(["M1"], tmp_path / "bad.toml")
    with pytest.raises(TargetError, match="unknown marker role 'nonsense'"):
        find_marker_roles(["LASI"]).label("nonsense")


@given(st.lists(st.text(max_size=12), max_size=30, unique=True))
def test_any_labels_are_divided_into_known_and_unknown(labels):
    """Whatever a file calls its markers, each label is either known, with a role of its own, or listed."""
    found = find_marker_roles(labels)
    assert sorted([*found.roles, *found.unknown]) == sorted(labels)
    assert len(set(found.roles.values())) == len(found.roles) == len(found.segments)


def test_the_check_of_places_finds_exchanged_labels():
    """Markers where they belong are not complained about; exchanged ones are."""
    roles = find_marker_roles(WALK.names).labels
    assert misplaced_roles(WALK, roles) == []
    assert misplaced_roles(WALK, {**roles, "l_asis": roles["r_asis"], "r_asis": roles["l_asis"]})
    assert misplaced_roles(WALK, {**roles, "l_knee_lateral": roles["l_ankle_lateral"]})


FILE_SETS = {
    "c3d/02_05.c3d": "CMU 41",
    "c3d/btk_others_Gait.c3d": "Helen Hayes",
    "c3d/nimblephysics_nick_freeform_001.c3d": "Vicon 53",
    "c3d/opensim_walking2.c3d": "OpenSim Rajagopal",
    "trc/nimblephysics_OpenCapUnfiltered_walking2.trc": "OpenCap",
    "trc/nimblephysics_Subject4_squats1.trc": "OpenCap",
    "trc/opensim_subject01_static.trc": "OpenSim gait2392",
    "trc/opensim_subject01_walk.trc": "OpenSim gait2392",
}


@pytest.mark.parametrize("path", [*recordings("c3d/*.c3d"), *recordings("trc/*.trc")])
def test_real_files_are_recognised_and_their_roles_are_where_they_belong(path):
    """Every label has a role, left is on the left, and bones have the length of bones."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        markers = load_markers(path)
    found = find_marker_roles(markers.names)
    assert found.set_name == FILE_SETS[f"{path.parent.name}/{path.name}"]
    assert found.unknown == () and len(found.roles) == len(markers.names)
    assert misplaced_roles(markers, found.labels) == []


@pytest.mark.parametrize("path", [*recordings("c3d/*.c3d"), *recordings("trc/*.trc")])
def test_markers_of_a_segment_move_with_it(path):
    """Segments by the roles are rigid but for skin: distances within one vary by less than 3 cm."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        markers = load_markers(path)
    if path.stem == "opensim_subject01_static":
        pytest.skip("a static trial: everything is rigid")
    segments = find_marker_roles(markers.names).segments
    ways = markers.positions[:, :, None] - markers.positions[:, None]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        spread = np.nanstd(np.linalg.norm(ways, axis=3), axis=0)
    names = list(markers.names)
    for name in names:
        same = [k for k, other in enumerate(names) if other != name and segments[other] == segments[name]]
        if same and np.isfinite(spread[names.index(name)]).any():
            assert np.nanmedian(spread[names.index(name), same]) < 0.03, (name, segments[name])


def test_a_label_of_landmarks_is_no_centre_among_skin_markers():
    """LHIP is a marker on the thigh of one set and the hip itself for a pose estimator."""
    skin = ["LFWT", "RFWT", "LBWT", "RBWT", "LHIP", "RHIP", "LKNI", "RKNI", "LOWR", "LIWR", "C7", "T10"]
    assert find_marker_roles(skin).roles["LHIP"] == "l_thigh"
    plug_in = ["LASI", "RASI", "LPSI", "RPSI", "LKNE", "RKNE", "LANK", "RANK", "LTOE", "RTOE", "L_Hip"]
    assert find_marker_roles(plug_in).unknown == ("L_Hip",)
    landmarks = ["nose", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle"]
    assert find_marker_roles(landmarks).roles["left_hip"] == "l_hip_centre"
    both = [
        "LHip",
        "RHip",
        *(f"{s}_{p}_study" for s in "Lr" for p in ("knee", "mknee", "ankle", "calc", "toe")),
    ]
    assert find_marker_roles(both).roles["LHip"] == "l_hip_centre"
