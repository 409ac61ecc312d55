"""Degrees of freedom: coordinates and rotations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sixpoint as sp

X, Y, Z = np.eye(3)
angles = st.floats(-1.4, 1.4)


def hinges(*axes):
    """Hinges with a wide range."""
    return sp.Hinges(np.array(axes), np.full(len(axes), -3.0), np.full(len(axes), 3.0))


@settings(deadline=None, max_examples=60)
@given(st.lists(angles, min_size=9, max_size=9))
def test_coordinates_survive(values):
    """One, two and three hinges and a ball: q -> rotations -> q is the identity."""
    dofs = sp.Dofs({1: hinges(X), 2: hinges(Z, X), 3: hinges(Z, X, Y), 5: sp.Ball(), 6: sp.Fixed()})
    assert dofs.size == 9
    q = np.array(values)
    assert dofs.compute_coordinates(dofs.compute_rotations(q, 8)) == pytest.approx(q, abs=1e-7)


@pytest.mark.parametrize(
    ("axes", "lower", "upper", "words"),
    [
        (np.zeros((0, 3)), [], [], "one to three"),
        (np.eye(3)[[0, 1, 2, 0]], [0] * 4, [1] * 4, "one to three"),
        ([X], [0, 0], [1], "lower and an upper"),
        ([X], [1], [0], "above"),
        ([2 * X], [0], [1], "unit length"),
        ([X, X], [0, 0], [1, 1], "perpendicular"),
    ],
)
def test_bad_hinges_are_errors(axes, lower, upper, words):
    """Wrong numbers of hinges, limits or directions are refused."""
    with pytest.raises(sp.FigureError, match=words):
        sp.Hinges(axes, lower, upper)


def test_a_wrong_number_of_coordinates_is_an_error():
    """Q must have as many entries as the joints have freedoms."""
    with pytest.raises(sp.FigureError, match="3 coordinates"):
        sp.Dofs({0: sp.Ball()}).compute_rotations([0.0], 1)
