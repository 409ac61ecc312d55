"""Extremities that are turned too: their rows, and SIK+ with measured rotations."""

from __future__ import annotations

import numpy as np
import pytest

import sixpoint as sp
from body_rigs import family_skeleton
from sixpoint.body.spine_chain import COINCIDENT
from sixpoint.solvers.six_points.model import build_model
from sixpoint.solvers.six_points.packing import LIMB_ROWS, end_row


def without_clavicles() -> sp.Skeleton:
    """A rig whose arms hang on the spine joint that carried the clavicles."""
    rig = family_skeleton("cmu-bvh")
    kept = [j for j, name in enumerate(rig.names) if not name.endswith("Shoulder")]
    parents, offsets = [], []
    for j in kept:
        parent, offset = int(rig.parents[j]), rig.offsets[j].copy()
        while parent >= 0 and parent not in kept:
            offset, parent = offset + rig.offsets[parent], int(rig.parents[parent])
        parents.append(kept.index(parent) if parent >= 0 else -1)
        offsets.append(offset)
    sites = np.array([kept.index(int(j)) for j in rig.site_parents])
    names = tuple(rig.names[j] for j in kept)
    return sp.Skeleton(names, np.array(parents), np.array(offsets), rig.site_names, sites, rig.site_offsets)


FIGURES = {
    "built-in": sp.Figure.from_stature(1.75),
    "no clavicles": sp.Figure.from_skeleton(without_clavicles()),
    "head an end site": sp.Figure.from_skeleton(family_skeleton("xsens")),
}


@pytest.mark.parametrize("name", FIGURES)
def test_only_who_asks_for_them_has_rows_of_the_ends(name):
    """Head, wrists and ankles follow the limbs' rows, and only where they are asked for."""
    figure = FIGURES[name]
    plain, model = build_model(figure), build_model(figure, ends=True)
    s, r = len(plain.segments), figure.roles
    assert len(plain.balls) == s + LIMB_ROWS and plain.row.max() < s + LIMB_ROWS
    assert len(model.balls) == s + LIMB_ROWS + 5
    for end, joint in enumerate((r.head, *r.wrist, *r.ankle)):
        site = joint == r.head and np.linalg.norm(figure.head_offset) > COINCIDENT
        assert model.row[joint] == (plain.row[joint] if site else end_row(s, end))
    others = np.delete(np.arange(len(model.row)), [r.head, *r.wrist, *r.ankle])
    np.testing.assert_array_equal(model.row[others], plain.row[others])
