"""Skeletons, motions and targets refuse what is inconsistent and cannot be changed."""

import numpy as np
import pytest

import sixpoint as sp
from sixpoint.body import rotations as rot
from sixpoint.body.skeleton import FEW
from sixpoint.errors import SkeletonError, TargetError

NAMES, PARENTS, OFFSETS = ("a", "b", "c"), [-1, 0, 1], np.eye(3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"names": ()}, "at least one"),
        ({"names": ("a", "b", "b")}, "repeated: b"),
        ({"parents": [-1, 0]}, "need parents"),
        ({"parents": [-1, 2, 1]}, "wrong at: b"),
        ({"parents": [-1, -1, 1]}, "wrong at: b"),
        ({"parents": [0, 0, 1]}, "wrong at: a"),
        ({"offsets": np.full((3, 3), np.nan)}, "finite"),
        ({"site_names": ("s",)}, "site names need"),
        ({"site_names": ("s",), "site_parents": [7], "site_offsets": [[0, 0, 0]]}, "does not exist"),
    ],
)
def test_bad_skeletons_are_errors(changes, words):
    """Names, parents, offsets and sites must fit together."""
    with pytest.raises(SkeletonError, match=words):
        sp.Skeleton(**({"names": NAMES, "parents": PARENTS, "offsets": OFFSETS} | changes))


def test_an_absent_joint_lists_the_others():
    """A wrong name is answered with the right ones."""
    with pytest.raises(SkeletonError, match="a, b, c"):
        sp.Skeleton(NAMES, PARENTS, OFFSETS).index("z")


def test_arrays_are_copied_and_read_only():
    """The caller's arrays stay writable and do not reach into the skeleton or motion."""
    offsets, quats = np.eye(3), np.tile(rot.IDENTITY, (2, 3, 1))
    skeleton = sp.Skeleton(NAMES, PARENTS, offsets)
    motion = sp.Motion(skeleton, quats, np.zeros((2, 1, 3)), 60)
    offsets[0], quats[0] = 7.0, 7.0
    assert skeleton.offsets[0, 0] == 1.0
    assert motion.rotations[0, 0, 3] == 1.0
    for array in (skeleton.offsets, skeleton.parents, motion.rotations, motion.translations):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rotations": np.zeros((2, 2, 4))}, "rotations must be"),
        ({"rotations": np.zeros((0, 3, 4)), "translations": np.zeros((0, 1, 3))}, "at least one frame"),
        ({"translations": np.zeros((1, 1, 3))}, "translations must be"),
        ({"moving": (1,)}, "moving joints"),
        ({"rate": 0.0}, "positive"),
        ({"rate": float("nan")}, "positive"),
        ({"translations": np.full((2, 1, 3), np.inf)}, "finite"),
    ],
)
def test_bad_motions_are_errors(changes, words):
    """Shapes, rates and numbers of a motion are checked."""
    good = {"rotations": np.tile(rot.IDENTITY, (2, 3, 1)), "translations": np.zeros((2, 1, 3)), "rate": 60.0}
    with pytest.raises(SkeletonError, match=words):
        sp.Motion(sp.Skeleton(NAMES, PARENTS, OFFSETS), **(good | changes))


def test_bad_targets_are_errors():
    """Six effectors of three numbers each, a positive rate and rotations of the same length."""
    with pytest.raises(TargetError, match="frames, 6, 3"):
        sp.Targets(np.zeros((2, 5, 3)), 60.0)
    with pytest.raises(TargetError, match="rate"):
        sp.Targets(np.zeros((2, 6, 3)), -1.0)
    with pytest.raises(TargetError, match="rotations must be"):
        sp.Targets(np.zeros((2, 6, 3)), 60.0, np.zeros((1, 6, 4)))
    lost = np.zeros((1, 6, 3))
    lost[0, 2] = np.nan
    assert list(sp.Targets(lost, 60.0).tracked[0]) == [True, True, False, True, True, True]


def test_slices_keep_the_time():
    """Every second frame has half the rate; no frames left is an error that says how many there were."""
    motion = sp.Motion(
        sp.Skeleton(NAMES, PARENTS, OFFSETS), np.tile(rot.IDENTITY, (9, 3, 1)), np.zeros((9, 1, 3)), 60
    )
    assert motion.sliced(slice(None, None, 2)).rate == 30.0
    with pytest.raises(SkeletonError, match="0 to 8"):
        motion.sliced(slice(20, None))


def test_walks_over_the_tree():
    """Paths, subtrees, common ancestors and longest ways agree with the tree."""
    s = sp.Skeleton(
        ("a", "b", "c", "d", "e"), [-1, 0, 1, 0, 3], [[0, 0, 0], [1, 0, 0], [1, 0, 0], [5, 0, 0], [0, 0, 0]]
    )
    assert s.path(0, 2) == [0, 1, 2]
    assert s.path(3, 2) == []
    assert list(s.subtree(1)) == [1, 2]
    assert list(s.subtree(0)) == [0, 1, 2, 3, 4]
    assert s.common_ancestor([2, 4]) == 0
    assert [j for j, _ in s.longest_chain(0)] == [0, 3, 4]
    assert list(s.ways_down[0]) == [5.0, 1.0, 0.0, 0.0, 0.0]


def test_one_frame_and_many_give_the_same_bits():
    """Forward kinematics by depth, for few frames, and by joint, for many, do the same sums."""
    figure = sp.Figure.from_stature()
    motion = sp.make_sample("walk", figure)
    assert len(motion) > FEW
    for frame in (0, 7, len(motion) - 1):
        positions, world = motion.pose(frame).compute_transforms()
        np.testing.assert_array_equal(positions, motion.transforms[0][frame])
        np.testing.assert_array_equal(world, motion.transforms[1][frame])
