"""Joint limits: the shipped table, splines, spines of any length, a user's own file."""

from importlib import resources

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import sixpoint as sp
from sixpoint.body.limits import Limits
from sixpoint.errors import FormatError

TEXT = resources.files("sixpoint.body").joinpath("data/joint_limits.toml").read_text("utf-8")
TABLE = [  # flexion, extension, lateral, axial of the six-joint spine
    (39, 23, 12, 3), (41, 23, 15, 5), (18, 10, 9, 20), (15, 18, 11, 17), (19, 36, 26, 15), (13, 25, 7, 28),
]  # fmt: skip


def ranges(balls):
    """(n, 4) flexion, extension, lateral, axial [degrees]."""
    angles = np.array([0, np.pi, np.pi / 2])
    rows = [[*ball.limit.compute_limit(angles), ball.limit.twist[1]] for ball in balls]
    return np.degrees(rows)


@pytest.mark.parametrize("count", [1, 2, 3, 6, 10, 25, 40])
def test_spine_limits_add_up(count):
    """Ranges of all joints add up to those of the spine, however many joints share them."""
    total = ranges(Limits.default().spine(np.linspace(0, 1, count))).sum(axis=0)
    assert total == pytest.approx([145, 135, 80, 87.5])


def test_the_six_joint_spine_has_its_published_ranges():
    """vl5, vl1, vt6, vt1, vc4 and skullbase absorb the levels next to them."""
    heights = [0, 0.289, 0.596, 0.779, 0.900, 1]
    assert ranges(Limits.default().spine(heights)) == pytest.approx(np.array(TABLE, float), abs=0.51)


@pytest.mark.parametrize("role", ["shoulder", "hip"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_splines_are_cubic_with_equal_end_slopes(role, side):
    """The limit is the clamped spline with the slopes of eq. 3, continuous at the seam, and clipped."""
    limit = getattr(Limits.default(), role)(side).limit
    t, p = limit.theta, limit.psi
    slope = 0.5 * ((p[1] - p[0]) / (t[1] - t[0]) + (p[-1] - p[-2]) / (t[-1] - t[-2]))
    theta = np.linspace(-np.pi, np.pi, 721)
    expected = np.clip(CubicSpline(t, p, bc_type=((1, slope), (1, slope)))(theta), p.min(), p.max())
    assert limit.compute_limit(theta) == pytest.approx(expected, abs=1e-9)
    assert limit.compute_limit(-np.pi) == pytest.approx(limit.compute_limit(np.pi))
    assert limit.compute_limit(t) == pytest.approx(p)


def test_a_users_table_changes_the_limit(tmp_path):
    """A copied and edited file is what the figure then obeys; the default stays."""
    path = tmp_path / "mine.toml"
    path.write_text(TEXT.replace("flexion = [0, 145]", "flexion = [10, 90]"))
    figure = sp.Figure.from_stature().with_limits(Limits.load(path))
    elbow = figure.dofs[figure.roles.elbow[0]]
    assert np.degrees([elbow.lower[0], elbow.upper[0]]) == pytest.approx([-90, -10])
    assert np.degrees(Limits.default().elbow().lower[0]) == pytest.approx(-145)


@pytest.mark.parametrize(
    "text",
    [
        "= broken",
        "",
        TEXT.replace("[knee]", "[kneee]"),
        TEXT.replace("[0, 145]", '"much"'),
        TEXT.replace("[0, 145]", "[145, 0]"),
        TEXT.replace("twist = 30", "twist = -30"),
        TEXT.replace("[-180, 50]", "[-170, 50]"),
    ],
)
def test_a_broken_table_is_named(tmp_path, text):
    """What is missing or makes no sense gives a FormatError that names the file."""
    path = tmp_path / "mine.toml"
    path.write_text(text)
    for wrong in (path, tmp_path / "absent.toml"):
        with pytest.raises(FormatError, match=wrong.name):
            Limits.load(wrong)
