"""Roles are found from names, else from structure, else a mapping tells them."""

import random
import string
import time

import numpy as np
import pytest

import sixpoint as sp
from body_rigs import FAMILIES, family_skeleton, load, real_rigs, renamed
from sixpoint.body.rig_names import split_name
from sixpoint.body.roles import find_roles
from sixpoint.errors import FigureError, FormatError

RIGS = [pytest.param(p, id=p.name) for p in real_rigs()] or [
    pytest.param(None, marks=pytest.mark.skip(reason="no recordings: set $SIXPOINT_DATA"))
]
EXPECTED = {
    "pelvis": 0, "spine_1": 1, "spine_2": 2, "head": 3, "l_clavicle": 7, "r_clavicle": 14,
    "l_hip": 4, "r_hip": 11,
    "l_knee": 5, "r_knee": 12, "l_ankle": 6, "r_ankle": 13, "l_shoulder": 8, "r_shoulder": 15, "l_elbow": 9,
    "r_elbow": 16, "l_wrist": 10, "r_wrist": 17,
}  # fmt: skip


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize(
    ("prefix", "suffix"),
    [("", ""), ("mixamorig:", ""), ("mixamorig_", ""), ("Character1_", ""), ("", "_056")],
)
def test_every_naming_family_is_read(family, prefix, suffix):
    """All naming families give the same roles, with and without namespace, prefix and numbers."""
    roles = find_roles(family_skeleton(family, prefix, suffix))
    assert roles.named() == EXPECTED
    assert roles.found_by == "names"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("LeftUpLeg", ("l", "upleg")),
        ("mixamorig:RightArm", ("r", "arm")),
        ("thigh_l", ("l", "thigh")),
        ("rfemur", ("r", "femur")),
        ("L_Hip", ("l", "hip")),
        ("head", ("", "head")),
        ("lowerback", ("", "lowerback")),
        ("rig|Bip01 R Thigh", ("r", "bip01thigh")),
    ],
)
def test_a_name_is_a_side_and_a_base(name, expected):
    """Sides are read at the start, in the middle or at the end of a name."""
    assert split_name(name) == expected


@pytest.mark.parametrize("kind", ["numbered", "random"])
@pytest.mark.parametrize("path", RIGS)
def test_nameless_rigs_are_found_by_structure(path, kind):
    """Real rigs under meaningless names get the limb roles that their true names tell."""
    motion = load(path)
    rng = random.Random(path.name)
    names = [f"joint_{j}" for j in range(len(motion.skeleton))]
    if kind == "random":
        names = ["".join(rng.choices(string.ascii_letters, k=9)) + str(j) for j in range(len(names))]
    roles = find_roles(renamed(motion.skeleton, names), None, motion)
    expected = find_roles(motion.skeleton)
    assert roles.found_by == "structure"
    assert roles.limbs == expected.limbs
    assert roles.pelvis == expected.pelvis
    assert roles.clavicle == expected.clavicle


@pytest.mark.parametrize("path", RIGS)
def test_real_rigs_are_found_by_name(path):
    """All real rigs are read by name, with clavicles and a spine."""
    roles = find_roles(load(path).skeleton)
    assert roles.found_by == "names"
    assert len(roles.clavicle) == 2
    assert len(roles.spine) >= 2


def test_left_is_left_by_structure():
    """Feet tell left from right; turned and mirrored rigs are read rightly."""
    s = family_skeleton("unity")
    plain = renamed(s, [f"b{j}" for j in range(len(s))])
    assert find_roles(plain).named() == EXPECTED
    turned = sp.Skeleton(
        plain.names, plain.parents, plain.offsets * [-1, 1, -1], plain.site_names, plain.site_parents,
        plain.site_offsets * [-1, 1, -1],
    )  # fmt: skip
    assert find_roles(turned).named() == EXPECTED
    mirrored = sp.Skeleton(
        plain.names, plain.parents, plain.offsets * [-1, 1, 1], plain.site_names, plain.site_parents,
        plain.site_offsets * [-1, 1, 1],
    )  # fmt: skip
    assert find_roles(mirrored).hip == (11, 4)
    assert find_roles(mirrored).wrist == (17, 10)


def test_names_of_legs_decide_the_sides_of_nameless_arms():
    """Where names tell one pair only, structure tells the other and follows the named sides."""
    s = family_skeleton("unity")
    names = [n if j < 7 or 11 <= j < 14 else f"b{j}" for j, n in enumerate(s.names)]
    assert find_roles(renamed(s, names)).named() == EXPECTED


def test_a_mapping_overrides(tmp_path):
    """A dict, a TOML table at top level and one under [roles] all override what is found."""
    s = family_skeleton("unity")
    names = [f"b{j}" for j in range(len(s))]
    names[3], names[2] = "head", "myhead"
    rig = renamed(s, names)
    (tmp_path / "a.toml").write_text('head = "myhead"\n')
    (tmp_path / "b.toml").write_text('[roles]\nhead = "myhead"\n')
    for mapping in ({"head": "myhead"}, tmp_path / "a.toml", str(tmp_path / "b.toml")):
        roles = sp.Figure.from_skeleton(rig, mapping).roles
        assert roles.head == 2
        assert roles.found_by == "structure and mapping"


@pytest.mark.parametrize(
    ("mapping", "words"),
    [
        ({"tail": "head"}, ["tail", "l_hip"]),
        ({"head": "nose"}, ["nose", "leftUpperLeg"]),
        ({"head": 3}, ["head"]),
        ({"l_hip": "rightUpperLeg"}, ["not one below the other"]),
        ({"head": "hips"}, ["no spine"]),
    ],
)
def test_a_wrong_mapping_says_what_would_work(mapping, words):
    """Unknown roles and joints are errors that list the known ones."""
    with pytest.raises(FigureError) as error:
        sp.Figure.from_skeleton(family_skeleton("unity"), mapping)
    assert all(word in str(error.value) for word in words)


@pytest.mark.parametrize("text", ["= nonsense", "head = 3", "roles = 3", "[roles]\nhead = ['a']"])
def test_a_broken_mapping_file_is_named(tmp_path, text):
    """A broken or absent mapping file gives a FormatError with its path."""
    path = tmp_path / "map.toml"
    path.write_text(text)
    for wrong in (path, tmp_path / "absent.toml"):
        with pytest.raises(FormatError, match=wrong.name):
            sp.Figure.from_skeleton(family_skeleton("unity"), wrong)


def test_what_is_missing_is_listed():
    """A rig that is not a human's gives a FigureError with its joints and the roles missing."""
    rig = sp.Skeleton(("base", "arm", "tip"), [-1, 0, 1], np.eye(3))
    with pytest.raises(FigureError) as error:
        find_roles(rig)
    assert all(word in str(error.value) for word in ("base", "tip", "l_hip", "r_wrist", "mapping"))


def test_helper_joints_do_no_harm():
    """Twist bones, weapons and mesh helpers neither hide nor become limbs."""
    s = family_skeleton("unreal")
    extra = [
        ("upperarm_twist_01_l", 8, [0.15, 0, 0]),
        ("weapon_r", 17, [-0.5, 0, 0.3]),
        ("mesh", 9, [0.0, 0, 0]),
    ]
    rig = sp.Skeleton(
        s.names + tuple(n for n, _, _ in extra), [*s.parents, *(p for _, p, _ in extra)],
        np.vstack([s.offsets, [o for _, _, o in extra]]), s.site_names, s.site_parents, s.site_offsets,
    )  # fmt: skip
    assert find_roles(rig).named() == EXPECTED
    assert find_roles(renamed(rig, [f"b{j}" for j in range(len(rig))])).named() == EXPECTED


@pytest.mark.parametrize("clavicles", [True, False])
@pytest.mark.parametrize("count", [1, 2, 3, 7, 25])
def test_any_spine(count, clavicles):
    """Spines of 1 to 25 joints, with and without clavicles, become figures; one joint carries an end site."""
    names, parents, offsets = ["Hips"], [-1], [[0.0, 1, 0]]
    for k in range(count):
        names, parents, offsets = [*names, f"Spine{k}"], [*parents, k], [*offsets, [0, 0.5 / count, 0]]
    chest = max(1, count - 2)
    for word, sign in (("Left", 1.0), ("Right", -1.0)):
        n = len(names)
        names += [f"{word}{w}" for w in ("UpLeg", "Leg", "Foot")]
        parents += [0, n, n + 1]
        offsets += [[sign * 0.1, -0.05, 0], [0, -0.4, 0], [0, -0.4, 0]]
        arm = len(names)
        if clavicles:
            names, parents, offsets = (
                [*names, f"{word}Shoulder"],
                [*parents, chest],
                [*offsets, [sign * 0.05, 0.1, 0]],
            )
        names += [f"{word}{w}" for w in ("Arm", "ForeArm", "Hand")]
        parents += [arm if clavicles else chest, len(names) - 3, len(names) - 2]
        offsets += [[sign * 0.15, 0.05, 0], [sign * 0.3, 0, 0], [sign * 0.25, 0, 0]]
    rig = sp.Skeleton(tuple(names), parents, offsets, ("top",), [count], [[0, 0.2, 0]])
    figure = sp.Figure.from_skeleton(rig)
    assert figure.roles.spine == tuple(range(1, count + 1))
    assert figure.roles.head_offset == (0, 0.2, 0)
    assert len(figure.roles.clavicle) == 2 * clavicles
    assert figure.spine_chain.segments.sum(axis=0) == pytest.approx([0, 0.7, 0])


def test_long_chains_are_read_fast():
    """A chain of 2000 joints is refused at once, without running out of stack."""
    n = 2000
    start = time.perf_counter()
    rig = sp.Skeleton(tuple(f"j{k}" for k in range(n)), np.arange(n) - 1, np.tile([0, 0.1, 0], (n, 1)))
    with pytest.raises(FigureError, match="not found"):
        find_roles(rig)
    assert time.perf_counter() - start < 2.0
    assert len(rig.subtree(1000)) == 1000
