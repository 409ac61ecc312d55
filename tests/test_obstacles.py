"""Obstacles of prioritized IK that are meshes, and those that a part of the body carries."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import sixpoint as sp
from prioritized_bodies import figure as make_body
from sixpoint.body.surface.distance_grid import build_grid, check_closed
from sixpoint.body.surface.flesh import build_shape
from sixpoint.errors import SixpointError
from sixpoint.kernels.distance import grid_distance
from sixpoint.solvers.prioritized.blocks import pack_grid
from sixpoint.solvers.prioritized.self_avoidance import fit_capsules, stay_out
from sixpoint.solvers.prioritized.tasks import Mesh

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("rtree")


def ball(radius=0.2):
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=radius)
    return mesh.vertices, mesh.faces


@pytest.mark.parametrize(
    "mesh",
    [trimesh.creation.box((0.4, 0.3, 0.2)), trimesh.creation.torus(0.3, 0.08, 16, 12)],
    ids=["box", "torus"],
)
def test_a_grid_holds_signed_distances(mesh):
    """At its corners a grid has trimesh's distances: corners, edges and the hole of a torus included."""
    grid = build_grid(mesh.vertices, mesh.faces, 0.03)
    axes = [grid.origin[k] + grid.spacing * np.arange(grid.values.shape[k]) for k in range(3)]
    corners = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    pick = np.random.default_rng(1).choice(len(corners), 600, replace=False)
    wanted = -trimesh.proximity.signed_distance(mesh, corners[pick])
    np.testing.assert_allclose(grid.values.ravel()[pick], wanted, atol=1e-5)


GRID = build_grid(*ball(), 0.05)


@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3))
@settings(max_examples=200)
def test_the_normal_is_the_distance_s_derivative(point):
    """Within a cube and beside the grid, the interpolated distance changes as the normal says."""
    rows, p, eps = pack_grid(GRID), np.array(point), 1e-6
    cube = (p - GRID.origin) / GRID.spacing
    if np.any(np.abs(cube - np.round(cube)) < 1e-3):  # the derivative jumps from cube to cube
        return
    distance, *normal = grid_distance(rows, 0, tuple(p))

    def at(shift):
        return grid_distance(rows, 0, tuple(p + shift))[0]

    rate = [(at(eps * e) - at(-eps * e)) / (2.0 * eps) for e in np.eye(3)]
    assert np.isfinite(distance)
    if np.linalg.norm(rate) > 1e-3:
        np.testing.assert_allclose(normal, rate, atol=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_rows_of_a_mesh_are_derivatives(seed):
    """A ball as a mesh has the row of a ball, to the spacing of its grid."""
    body, rng = make_body(), np.random.default_rng(seed)
    state = body.random(rng)
    positions, _ = body.world(state)
    joint = body.joint("l_wrist")
    goal = np.array([*(positions[joint] + [0.05, 0.12, -0.06]), 0, 0, 0, 1.0])
    steps = [
        body.solver([sp.ObstacleTask("l_wrist", shape)], limits=False).compute_step(
            {"l_wrist obstacle": goal}, start=body.pose(state)
        )
        for shape in (sp.Sphere(0.2), Mesh(*ball()))
    ]
    np.testing.assert_allclose(steps[0].jacobian, steps[1].jacobian, atol=0.12)
    assert steps[0].active == steps[1].active == [True]


@pytest.mark.parametrize("seed", range(3))
def test_rows_of_a_carried_shape_are_derivatives(seed):
    """The row is how fast the gap between a point and a ball on another joint changes (differences)."""
    body, rng = make_body(), np.random.default_rng(seed)
    state = body.random(rng)
    joint, carrier = body.joint("l_wrist"), body.joint("pelvis")
    offset = np.array([0.1, 0.3, 0.05])

    def gap(positions, world):
        centre = positions[:, carrier] + world[:, carrier] @ offset
        return (np.linalg.norm(positions[:, joint] - centre, axis=1) - 0.2)[:, None]

    goal = np.array([*offset, 0, 0, 0, 1.0])
    task = sp.ObstacleTask("l_wrist", sp.Sphere(0.2), on="pelvis", goal=goal)
    step = body.solver([task], limits=False).compute_step({}, start=body.pose(state))
    np.testing.assert_allclose(step.jacobian, body.differences(state, gap), atol=1e-6)


def test_a_hand_goes_around_a_mesh():
    """A wrist whose goal is inside a mesh stays at its surface, as far as trimesh can tell."""
    figure = sp.Figure.from_stature(1.75)
    box = trimesh.creation.box((0.3, 0.3, 0.3))
    rest = figure.rest_positions
    shoulder = rest[figure.roles.shoulder[0]]
    centre = shoulder + [0.0, -0.1, 0.45]
    obstacle = sp.ObstacleTask("l_wrist", Mesh(box.vertices, box.faces), level=0, goal=centre)
    solver = sp.PrioritizedIK(
        figure, [sp.PositionTask("pelvis", level=0), obstacle, sp.PositionTask("l_wrist", level=1)]
    )
    solution = None
    for _ in range(30):
        goals = {"pelvis": rest[figure.roles.pelvis], "l_wrist": centre + [0.02, 0.0, -0.1]}
        solution = solver.solve(goals, solution)
    positions, _ = solution.pose.compute_transforms()
    wrist = positions[figure.roles.wrist[0]] - centre
    depth = trimesh.proximity.signed_distance(box, wrist[None])[0]
    assert depth < 2e-3
    assert solution.residual[list(solver.names).index("l_wrist")] < 0.09


def test_an_elbow_stays_out_of_its_own_trunk():
    """Capsules fitted to the surface, carried by the spine, keep an elbow out of the trunk's mesh."""
    plain = sp.Figure.from_stature(1.75)
    figure = plain.with_shape(build_shape(plain))
    rest, roles = figure.rest_positions, figure.roles
    wrist = rest[roles.shoulder[0]] + [-0.2, -0.28, 0.2]
    goal = {"pelvis": rest[roles.pelvis], "l_wrist": wrist, "l_elbow": wrist + [0.0, 0.0, -0.25]}

    def depth(more):
        tasks = [sp.PositionTask("pelvis"), *more]
        tasks += [sp.PositionTask("l_wrist", level=1), sp.PositionTask("l_elbow", level=2)]
        solver, solution = sp.PrioritizedIK(figure, tasks), None
        for _ in range(40):
            solution = solver.solve(goal, solution)
        positions, world = solution.pose.compute_transforms()
        vertices = figure.shape.place(positions, world)
        ids, faces = np.unique(figure.shape.triangles[figure.shape.parts["trunk"]], return_inverse=True)
        mesh = trimesh.Trimesh(vertices[ids], faces.reshape(-1, 3), process=False)
        elbow = positions[roles.elbow[0]]
        return trimesh.proximity.signed_distance(mesh, elbow[None])[0], solution

    before, _ = depth([])
    after, solution = depth(stay_out(figure, "l_elbow", level=0, margin=0.04))
    assert before > 0.02
    assert after < -0.01
    assert solution.residual[1:].min() >= 0.0


def test_capsules_hold_what_they_are_fitted_to():
    """Each capsule lies around vertices of its joint; parts without a surface and unknown ones are errors."""
    plain = sp.Figure.from_stature(1.75)
    figure = plain.with_shape(build_shape(plain))
    trunk = fit_capsules(figure)
    assert len(trunk) >= 3 and all(0.05 < body.capsule.radius < 0.2 for body in trunk)
    for body in trunk:
        turn = Rotation.from_quat(body.place[3:])
        assert np.linalg.norm(turn.apply([0.0, 1.0, 0.0])) == pytest.approx(1.0)
    with pytest.raises(SixpointError, match="no part 'tail'"):
        fit_capsules(figure, "tail")
    with pytest.raises(SixpointError, match="surface"):
        fit_capsules(plain)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v, t: (v, t[1:]), "not closed"),
        (lambda v, t: (v[:, :2], t), r"vertices \(V, 3\)"),
        (lambda v, t: (v, t + 1000), "numbers of its"),
        (lambda v, t: (np.where(v > 0.15, np.nan, v), t), "finite"),
        (lambda v, t: (v, t.astype(float)), "numbers of its"),
    ],
)
def test_a_mesh_that_is_none_is_said(change, message):
    """Open, flat, torn and infinite meshes are errors that say what is wrong."""
    with pytest.raises(SixpointError, match=message):
        check_closed(*change(*map(np.asarray, ball())))


def test_a_shape_on_its_own_joint_is_an_error():
    """A point cannot leave a shape that its own joint carries."""
    figure = sp.Figure.from_stature(1.75)
    with pytest.raises(SixpointError, match="always where it is"):
        sp.PrioritizedIK(figure, [sp.ObstacleTask("l_wrist", sp.Sphere(0.1), on="l_wrist")])
