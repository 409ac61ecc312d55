"""People who walk into view, out of it and back: where following begins, ends and begins anew."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conftest import recordings
from sixpoint.calibration.markers import calibrate_markers
from sixpoint.errors import TargetError
from sixpoint.formats.markers import load_markers
from sixpoint.jobs.track.models import columns_of
from sixpoint.solvers.tracking.limits import widen_limits
from sixpoint.solvers.tracking.running import Followed
from sixpoint.solvers.tracking.solver import LOST, REJECTED, USED, MarkerTracker
from sixpoint.solvers.tracking.two_sided import doubt_of
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


@pytest.mark.parametrize("rate", [10.0, 60.0])
def test_a_person_who_is_elsewhere_from_one_frame_to_the_next_is_found(rate):
    """Three metres away in no time: followed again after two thirds of a second, in files and live."""
    case = body("walk")
    there = case.markers[60:120] @ Rotation.from_euler("y", 170, degrees=True).as_matrix().T + [3.0, 0.0, 0.0]
    markers = np.concatenate([case.markers[:60], there])
    tracker, late = MarkerTracker(case.model), 60 + round(0.67 * rate)
    result, frame, live = tracker.solve_frames(markers, rate, two_sided=False), None, []
    for row in markers:
        frame = tracker.solve(row, frame, 1 / rate)
        live.append(frame.residual)
    assert np.median(result.residual[late:], axis=1).max() < 0.05
    assert np.median(live[late:], axis=1).max() < 0.05


@pytest.mark.parametrize("count", [19, 24])
def test_a_body_that_comes_back_is_right_from_its_first_frame(count):
    """Also in the middle of what is followed at once, and with fewer than half of the model's markers."""
    case = body("walk")
    some = np.random.default_rng(1).permutation(case.markers.shape[1])[:count]
    markers, shift = np.full_like(case.markers[:150], np.nan), np.array([2.0, 0.0, 0.0])
    markers[:40, some] = case.markers[:40, some]
    markers[97:, some] = case.markers[97:150, some] + shift
    motion = MarkerTracker(case.model).solve_frames(markers, 60.0, two_sided=False).motion
    off = np.linalg.norm(motion.positions[97:] - case.motion.positions[97:150] - shift, axis=-1)
    assert off[:, case.model.figure.roles.pelvis].max() < 0.05


def test_a_stream_that_begins_with_nobody_finds_whoever_comes():
    """The first frame of a live loop is empty: the first with markers is begun with."""
    case = body("walk")
    tracker = MarkerTracker(case.model)
    frame = tracker.solve(np.full_like(case.markers[0], np.nan))
    assert frame.adrift == np.inf
    frame = tracker.solve(case.markers[0] + [3.0, 0.0, 0.0], frame, 1 / 60)
    assert frame.residual.max() < 0.05 and frame.adrift == 0.0


def test_a_ghost_in_the_first_frame_has_its_distance():
    """A marker that is left out of a first pose is refused, and its residual says how far it is."""
    case = body("walk")
    markers = case.markers[0].copy()
    markers[7] += [0.4, 0.3, 0.0]
    frame = MarkerTracker(case.model).solve(markers)
    assert frame.flags[7] == REJECTED and frame.residual[7] == pytest.approx(0.5, abs=0.05)


def test_limits_widen_as_much_when_nobody_is_there_for_long():
    """Empty frames say nothing of limits."""
    case = body("jump_kick")
    nobody = np.full((len(case.markers) + 20, *case.markers.shape[1:]), np.nan)
    alone = widen_limits(case.model, case.markers, 60.0)[1]
    after = widen_limits(case.model, np.concatenate([case.markers, nobody]), 60.0)[1]
    assert alone and after == pytest.approx(alone, abs=np.radians(1.0))
    with pytest.raises(TargetError, match="rate"):
        widen_limits(case.model, case.markers, np.nan)


def test_a_way_that_lost_its_markers_has_no_say():
    """Both ways are mixed by how well they follow: one that is 20 cm off counts as if it saw nothing."""
    flags, good, bad = np.zeros((60, 3), np.int64), np.full((60, 3), 0.01), np.full((60, 3), 0.2)
    ways = [Followed(np.zeros((60, 1, 4)), np.zeros((60, 3)), flags, off, flags[:, 0]) for off in (good, bad)]
    doubts = [doubt_of(way, 60.0) for way in ways]
    assert doubts[0].max() == 0.0 and doubts[1][-1].min() > 1.0


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
