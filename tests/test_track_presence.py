"""People who walk into view, out of it and back: where following begins, ends and begins anew."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conftest import recordings
from sixpoint.calibration.markers import calibrate_markers
from sixpoint.formats.markers import load_markers
from sixpoint.jobs.track.models import columns_of
from sixpoint.solvers.tracking.solver import LOST, REJECTED, USED, MarkerTracker
from track_bodies import body


def errors(result, truth):
    return np.linalg.norm(result.motion.positions - truth, axis=-1)


@pytest.mark.parametrize("two_sided", [False, True])
def test_markers_that_come_and_go_one_by_one(two_sided):
    """Markers that appear within a second, and vanish within one, leave the frames between as they were."""
    case = body("walk")
    markers = case.markers[:240].copy()
    order = np.random.default_rng(0).permutation(markers.shape[1])
    for k, marker in enumerate(order):
        markers[: 20 + k, marker] = np.nan
        markers[220 - k :, marker] = np.nan
    result = MarkerTracker(case.model).solve_frames(markers, 60.0, two_sided=two_sided)
    whole = MarkerTracker(case.model).solve_frames(case.markers[:240], 60.0, two_sided=False)
    apart = errors(result, whole.motion.positions)[65:175][:, case.posed]
    assert apart.max() < 0.02
    assert np.all(result.flags[~np.isfinite(markers[..., 0])] == LOST)
    used = result.flags == USED
    assert np.sqrt(np.mean(result.residual[used] ** 2)) < 0.01
    if two_sided:  # the way back follows them to the last one
        assert np.mean(used[30:40].sum(axis=1) / np.isfinite(markers[30:40, :, 0]).sum(axis=1)) > 0.9
    else:
        assert np.all(result.flags[25][np.isfinite(markers[25, :, 0])] == REJECTED)


def test_a_person_who_comes_back_elsewhere_is_found_again():
    """Two seconds later, three metres away and facing the other way: followed from the first frame on."""
    case = body("walk")
    turn = Rotation.from_euler("y", 170, degrees=True)
    there = turn.apply(case.markers[:90].reshape(-1, 3)).reshape(case.markers[:90].shape) + [3.0, 0.0, 1.0]
    nobody = np.full((120, *there.shape[1:]), np.nan)
    markers = np.concatenate([case.markers[:90], nobody, there])
    tracker = MarkerTracker(case.model)
    truth = turn.apply(case.motion.positions[:90].reshape(-1, 3)).reshape(90, -1, 3) + [3.0, 0.0, 1.0]
    result = tracker.solve_frames(markers, 60.0)
    assert np.linalg.norm(result.motion.positions[210:] - truth, axis=-1)[:, case.posed].max() < 0.03
    frame = None
    for row in markers:
        frame = tracker.solve(row, frame, 1 / 60)
    assert np.linalg.norm(frame.pose.compute_transforms()[0] - truth[-1], axis=-1)[case.posed].max() < 0.03
    assert frame.adrift == 0.0


def test_who_was_lost_is_begun_with_anew():
    """A state that has nothing to do with the markers is given up after a moment."""
    case = body("walk")
    tracker = MarkerTracker(case.model)
    far = case.markers[200] @ Rotation.from_euler("xyz", [150, 60, 0], degrees=True).as_matrix().T
    frame = tracker.solve(far)
    for row in case.markers[:60]:
        frame = tracker.solve(row, frame, 1 / 60)
    assert (
        np.linalg.norm(frame.pose.compute_transforms()[0] - case.motion.positions[59], axis=-1)[
            case.posed
        ].max()
        < 0.03
    )


@pytest.mark.filterwarnings("ignore:.*labels that repeat")
@pytest.mark.parametrize(
    "path", [*recordings("c3d/btk_others_Gait.c3d"), *recordings("c3d/opensim_walking2.c3d")]
)
def test_people_who_cross_a_laboratory(path):
    """Recordings that begin and end with nobody, or a few markers: an RMS residual within a centimetre."""
    markers = load_markers(path)
    model = calibrate_markers(markers)
    positions = columns_of(model, markers)
    result = MarkerTracker(model).solve_frames(positions, markers.rate)
    used = result.flags == USED
    assert np.sqrt(np.mean(result.residual[used] ** 2)) < 0.01
    assert np.mean(used[np.isfinite(positions[..., 0])]) > 0.98
