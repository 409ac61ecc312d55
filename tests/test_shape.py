"""Surfaces on skeletons, and markers: what may be, and how a skinned vertex moves."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sixpoint as sp
from sixpoint.body.markers.recording import Event, Markers
from sixpoint.body.surface.shape import Shape
from sixpoint.errors import FigureError, TargetError


def random_shape(joints, rng, vertices=30):
    weights = rng.random((vertices, 4))
    return Shape(
        rng.normal(size=(vertices, 3)),
        rng.integers(0, vertices, (10, 3)),
        rng.integers(0, joints, (vertices, 4)),
        weights / weights.sum(axis=1, keepdims=True),
        rng.normal(size=(joints, 3)),
        Rotation.random(joints, rng=rng).as_quat(),
    )


def test_skinning_is_the_sum_of_matrices():
    """Vertices are where weighted 4x4 matrices put them (SciPy's rotations)."""
    rng = np.random.default_rng(0)
    shape = random_shape(7, rng)
    positions, world = rng.normal(size=(5, 7, 3)), Rotation.random(35, rng=rng).as_quat().reshape(5, 7, 4)
    placed = shape.place(positions, world)
    bind = np.tile(np.eye(4), (7, 1, 1))
    bind[:, :3, :3], bind[:, :3, 3] = (
        Rotation.from_quat(shape.bind_rotations).as_matrix(),
        shape.bind_positions,
    )
    for f in range(5):
        now = np.tile(np.eye(4), (7, 1, 1))
        now[:, :3, :3], now[:, :3, 3] = Rotation.from_quat(world[f]).as_matrix(), positions[f]
        skin = now @ np.linalg.inv(bind)
        ones = np.column_stack([shape.vertices, np.ones(len(shape.vertices))])
        expected = np.einsum("vk,vkab,vb->va", shape.weights, skin[shape.joints], ones)[:, :3]
        np.testing.assert_allclose(placed[f], expected, atol=1e-12)


def test_the_bind_pose_gives_the_vertices_back():
    """Joints as they are bound leave the surface as it is."""
    shape = random_shape(7, np.random.default_rng(1))
    np.testing.assert_allclose(
        shape.place(shape.bind_positions, shape.bind_rotations), shape.vertices, atol=1e-12
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"triangles": [[0, 1, 99]]}, "triangle"),
        ({"weights": np.full((30, 4), 0.3)}, "sum to one"),
        ({"joints": np.full((30, 4), 9)}, "joint that does not exist"),
        ({"vertices": np.full((30, 3), np.nan)}, "finite"),
        ({"bind_rotations": np.zeros((3, 4))}, "bind pose"),
    ],
)
def test_what_is_no_shape_is_said(change, message):
    """A shape that cannot be drawn is refused with the reason."""
    shape = random_shape(7, np.random.default_rng(2))
    with pytest.raises(FigureError, match=message):
        Shape(**({name: getattr(shape, name) for name in shape.__dataclass_fields__} | change))


def test_a_figure_takes_only_a_shape_of_its_joints():
    """A shape bound to another number of joints is refused."""
    figure = sp.Figure.from_stature()
    with pytest.raises(FigureError, match="bound to 7 joints"):
        figure.with_shape(random_shape(7, np.random.default_rng(3)))
    shape = random_shape(len(figure.skeleton), np.random.default_rng(3))
    assert figure.with_shape(shape).shape is shape
    assert figure.with_shape(shape).with_shape(None).shape is None


def test_markers_half_known_are_unknown():
    """A marker with one coordinate missing is a gap; selection and slices keep columns and events."""
    positions = np.arange(24.0).reshape(4, 2, 3)
    positions[1, 0, 2] = np.nan
    markers = Markers(("LASI", "RASI"), positions, 100.0, events=(Event("Foot Strike", 0.02, "Left"),))
    assert not markers.tracked[1, 0]
    assert np.isnan(markers.positions[1, 0]).all()
    assert markers.selected(["RASI"]).positions.shape == (4, 1, 3)
    part = markers.sliced(slice(1, None))
    assert part.events[0].time == pytest.approx(0.01)
    with pytest.raises(TargetError, match="LASI"):
        markers.index("nose")
    with pytest.raises(TargetError, match="repeated"):
        Markers(("A", "A"), positions, 100.0)
