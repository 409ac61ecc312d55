from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sixpoint import formats
from sixpoint.body.targets import EFFECTORS, Targets
from sixpoint.errors import FormatError
from sixpoint.formats.tables import HEADER, POSITION_COLUMNS, ROTATION_COLUMNS


def make_targets(frames: int = 9, rotations: bool = False, rate: float = 60.0) -> Targets:
    """Random points, some lost."""
    rng = np.random.default_rng(frames)
    positions = rng.normal(size=(frames, 6, 3))
    positions[frames // 2, 3] = np.nan
    turned = None
    if rotations:
        turned = Rotation.random(frames * 6, random_state=1).as_quat().reshape(frames, 6, 4)
        turned[0, 2] = np.nan
    return Targets(positions, rate, turned)


CSV = "\n".join([HEADER, *(",".join([f"{k / 50:g}", *["0.5"] * 18]) for k in range(4))]) + "\n"


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "t.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", ["a.csv", "a.npz"])
@pytest.mark.parametrize("rotations", [False, True])
@pytest.mark.parametrize("rate", [60.0, 29.97, 1 / 3])
def test_round_trip(tmp_path: Path, name: str, rotations: bool, rate: float) -> None:
    """Positions, rotations, lost points and rate come back."""
    targets = make_targets(rotations=rotations, rate=rate)
    formats.save_targets(targets, tmp_path / name)
    again = formats.load_targets(tmp_path / name)
    np.testing.assert_allclose(again.positions, targets.positions, atol=1e-8)
    np.testing.assert_array_equal(again.tracked, targets.tracked)
    assert again.rate == pytest.approx(rate, rel=1e-7) and again.name == "a"
    assert (again.rotations is not None) == rotations
    if rotations:
        np.testing.assert_allclose(again.rotations, targets.rotations, atol=1e-8)


@pytest.mark.parametrize("name", ["a.csv", "a.npz"])
def test_a_single_frame_keeps_its_rate(tmp_path: Path, name: str) -> None:
    """One frame has no time step; the rate is kept all the same."""
    formats.save_targets(replace(make_targets(), positions=np.ones((1, 6, 3)), rate=24.0), tmp_path / name)
    assert formats.load_targets(tmp_path / name).rate == 24.0


def test_columns_in_any_order(tmp_path: Path) -> None:
    """Columns are found by name, whatever their order and case; spaces and quotes are no part of them."""
    names = list(reversed(["time", *POSITION_COLUMNS]))
    rows = [[k if n == "time" else POSITION_COLUMNS.index(n) for n in names] for k in range(3)]
    text = ", ".join(f'"{n.upper()}"' for n in names) + "\n"
    path = write(tmp_path, text + "\n".join(",".join(map(str, row)) for row in rows))
    targets = formats.load_targets(path)
    np.testing.assert_array_equal(targets.positions[1].ravel(), np.arange(18))
    assert targets.rate == 1.0


def test_lost_points(tmp_path: Path) -> None:
    """An empty cell or NaN loses the whole point, and only that."""
    lines = CSV.split("\n")
    lines[2] = "0.02,0.5,,0.5," + ",".join(["0.5"] * 14) + ",NaN"
    tracked = formats.load_targets(write(tmp_path, "\n".join(lines))).tracked
    assert np.argwhere(~tracked).tolist() == [[1, 0], [1, 5]]


def test_rate_from_a_comment(tmp_path: Path) -> None:
    """Without times a comment gives the rate; without either the error says how."""
    text = CSV.replace("time", "frame")
    for k in range(4):
        text = text.replace(f"\n{k / 50:g},", f"\n{k + 7},")
    assert formats.load_targets(write(tmp_path, f"# rate 90\n{text}")).rate == 90.0
    with pytest.raises(FormatError, match="# rate 60"):
        formats.load_targets(write(tmp_path, text))
    assert formats.load_targets(tmp_path / "t.csv", rate=30).rate == 30.0


def test_rounded_times_are_uniform(tmp_path: Path) -> None:
    """Times rounded to milliseconds give the rate without a warning; uneven ones warn."""
    rows = [",".join([f"{k / 60:.3f}", *["0"] * 18]) for k in range(600)]
    rate = formats.load_targets(write(tmp_path, "\n".join([HEADER, *rows]))).rate
    assert rate == pytest.approx(60, rel=1e-3)
    del rows[100:150]
    with pytest.warns(UserWarning, match="not uniform"):
        rate = formats.load_targets(write(tmp_path, "\n".join([HEADER, *rows]))).rate
    assert rate == pytest.approx(60, rel=0.03)


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("pelvis_x", "pelvis_u", 1, "unknown columns: pelvis_u; columns: time, frame, pelvis_x"),
        (",pelvis_x", "", 1, "missing: pelvis_x"),
        ("pelvis_x", "pelvis_y", 1, "twice: pelvis_y"),
        (",r_ankle_z", ",r_ankle_z,head_qx", 1, "missing: head_qy, head_qz, head_qw"),
        (HEADER + "\n", "", 1, "no header; add this first line: time,pelvis_x"),
        (",", ";", 1, "comma|unknown columns"),
        ("0.02,0.5", "0.02,x", 3, "not a number"),
        ("0.02,0.5", "0.02,inf", 3, "not finite"),
        ("0.02,0.5", "0.02,1e13", 3, "far too large"),
        ("0.02,0.5", "0.02,0.5,0.5", 3, "expected 19, got '20'"),
        ("0.04,", "0.01,", 4, "time must increase"),
        ("0.04,", ",", 4, "time must increase"),
        (CSV[len(HEADER) :], "\n", 0, "no rows"),
        (CSV, "# rate 60\n", 0, "no rows"),
        ("time", "# rate -3\ntime", 1, "positive"),
    ],
)
def test_mistakes_have_a_line(tmp_path: Path, old: str, new: str, line: int, message: str) -> None:
    """Each mistake in a CSV is a FormatError at its line."""
    with pytest.raises(FormatError, match=message) as caught:
        formats.load_targets(write(tmp_path, CSV.replace(old, new, 1)))
    assert caught.value.line == line


def test_headerless_tables_say_what_to_add(tmp_path: Path) -> None:
    """Eighteen bare columns are refused with the header to add."""
    with pytest.raises(FormatError, match=f"add this first line: {HEADER}"):
        formats.load_targets(write(tmp_path, ",".join(["1.0"] * 18) + "\n"))


def test_rotations_must_be_unit(tmp_path: Path) -> None:
    """A quaternion that is none is refused with the effector and the line."""
    rows = [f"{k}," + ",".join(["1"] * 18 + (["0", "0", "0", "1"] * 6)) for k in range(3)]
    header = ",".join(["time", *POSITION_COLUMNS, *ROTATION_COLUMNS])
    assert formats.load_targets(write(tmp_path, "\n".join([header, *rows]))).rotations is not None
    rows[1] = rows[1][:-1] + "0"
    with pytest.raises(FormatError, match="r_ankle is not a unit quaternion") as caught:
        formats.load_targets(write(tmp_path, "\n".join([header, *rows])))
    assert caught.value.line == 3


def test_wrong_archives(tmp_path: Path) -> None:
    """NPZ files with missing, misshaped, pickled or textual arrays are FormatErrors."""
    path = tmp_path / "a.npz"
    good = np.zeros((3, 6, 3))
    wrong = [
        ({"positions": good}, "'rate' is missing"),
        ({"rate": 60.0}, "'positions' is missing"),
        ({"positions": good[:, :5], "rate": 60.0}, r"must be \(frames, 6, 3\)"),
        ({"positions": good, "rate": 0.0}, "must be positive"),
        ({"positions": good, "rate": [1.0, 2.0]}, "one number"),
        ({"positions": good.astype(object), "rate": 60.0}, "damaged|not an NPZ"),
        ({"positions": good.astype(str), "rate": 60.0}, "not numeric"),
        ({"positions": good + np.inf, "rate": 60.0}, "far too large"),
        ({"positions": good + 1e13, "rate": 60.0}, "far too large"),
        ({"positions": good, "rate": 60.0, "rotations": np.zeros((3, 6, 4))}, "unit quaternion"),
        ({"positions": good, "rate": 60.0, "rotations": np.zeros((2, 6, 5))}, "rotations must be"),
    ]
    for arrays, message in wrong:
        np.savez(path, **arrays)  # type: ignore[arg-type]
        with pytest.raises(FormatError, match=message):
            formats.load_targets(path)
    path.write_bytes(b"PK nonsense")
    with pytest.raises(FormatError, match="not an NPZ"):
        formats.load_targets(path)


def test_suffixes_and_overwriting(tmp_path: Path) -> None:
    """Unknown suffixes list the known ones; existing files are kept without force."""
    with pytest.raises(FormatError, match=r"unknown suffix '\.txt'; formats of targets: \.csv, \.npz"):
        formats.load_targets(tmp_path / "a.txt")
    with pytest.raises(FormatError, match="does not hold targets"):
        formats.load_targets(tmp_path / "a.bvh")
    path = tmp_path / "a.csv"
    formats.save_targets(make_targets(), path)
    with pytest.raises(FormatError, match="exists"):
        formats.save_targets(make_targets(), path)
    formats.save_targets(make_targets(3), path, force=True)
    assert len(formats.load_targets(path)) == 3
    assert path.read_text().startswith(f"time,{EFFECTORS[0]}_x") and list(tmp_path.iterdir()) == [path]
