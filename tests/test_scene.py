"""Pictures of a figure among things: what is drawn where, and what is refused."""

import numpy as np
import pytest
from matplotlib.image import imread

from sixpoint.body.figure import Figure
from sixpoint.body.rotations import from_axis_angle
from sixpoint.errors import SixpointError
from sixpoint.samples import make_sample
from sixpoint.study.scene import Shot, Thing, draw_scene

FIGURE = Figure.from_stature(1.75)
MOTION = make_sample("reach", FIGURE).sliced(slice(0, 300, 60))
QUARTER = from_axis_angle([0, 0, 1], np.pi / 2)


def coloured(path, colour, nearness=0.02):
    """Rows and columns of the pixels of a colour (r, g, b)."""
    return np.argwhere(np.abs(imread(path)[..., :3] - colour).max(axis=-1) < nearness)


def test_a_box_has_its_size_and_place():
    """Corners lie half a side from the centre, also when it is turned."""
    box = Thing.box((1.0, 2.0, 3.0), (1.0, 0.0, 0.0))
    assert np.allclose(box.centres.min(axis=0), [0.5, -1.0, -1.5])
    turned = Thing.box((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, *QUARTER))
    assert np.allclose(np.ptp(turned.centres, axis=0), [2.0, 1.0, 3.0])


def test_a_capsule_lies_along_y():
    """Its axis is as long as asked for, and turns with it."""
    assert np.allclose(Thing.capsule(0.1, 2.0, (0, 1, 0)).centres, [[0, 0, 0], [0, 2, 0]])
    assert np.allclose(np.ptp(Thing.capsule(0.1, 2.0, (0, 0, 0, *QUARTER)).centres, axis=0), [2, 0, 0])


def test_a_picture_has_a_row_per_view_and_marks_on_top(tmp_path):
    """The mark, of a colour of its own, is drawn once per view, and more shots make a flatter picture."""
    things = [Thing.box((0.8, 0.03, 0.4), (0, 1.0, 0.6)), Thing.capsule(0.03, 1.8, (0.3, 0.9, 0.5))]
    mark = ((0.0, 1.2, 0.6), "#ff00ff")
    shot = Shot(1, "one\ntwo", (mark,), [[0, 1, 0], [0, 1.2, 0.6]])
    both = draw_scene(FIGURE, MOTION, tmp_path / "both.png", [shot], things, title="a", note="b")
    one = draw_scene(FIGURE, MOTION, tmp_path / "one.png", [shot], things, views={"front": (0, 0)})
    rows = coloured(both, (1.0, 0.0, 1.0))[:, 0]
    assert np.count_nonzero(np.diff(np.unique(rows)) > 50) == 1  # one ring in each of two rows
    assert len(coloured(one, (1.0, 0.0, 1.0))) > 50
    many = draw_scene(FIGURE, MOTION, tmp_path / "many.png", [shot] * 3, things)
    assert imread(many).shape[0] < imread(both).shape[0]
    assert imread(many).shape[1] == imread(both).shape[1] == 1600


def test_the_side_view_is_from_the_right(tmp_path):
    """Seen from the right, what is ahead of the figure is on the right of the picture."""
    shots = [Shot(0, marks=(((0.0, 1.0, 2.0), "#ff00ff"), ((0.0, 1.0, -2.0), "#00ff00")))]
    path = draw_scene(FIGURE, MOTION, tmp_path / "side.png", shots, views={"side": (-90.0, 0.0)})
    ahead, behind = coloured(path, (1, 0, 1)), coloured(path, (0, 1, 0))
    assert ahead[:, 1].mean() > behind[:, 1].mean() + 500


@pytest.mark.parametrize("shots", [[], [Shot(99)], [Shot(-1)]])
def test_wrong_shots_are_refused(tmp_path, shots):
    """A message says which frames there are, and nothing is written."""
    with pytest.raises(SixpointError, match="frames 0 to"):
        draw_scene(FIGURE, MOTION, tmp_path / "no.png", shots)
    assert not list(tmp_path.iterdir())
