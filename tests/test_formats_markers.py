"""TRC, CSV, NPZ and JSON of markers: round trips, an independent reading, quirks of real files, bad input."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import recordings
from marker_bodies import walking_markers
from sixpoint.body.markers.recording import Markers
from sixpoint.errors import FormatError
from sixpoint.formats.markers import holds_markers, load_markers, save_markers
from sixpoint.formats.markers.landmarks import LANDMARKS

WALK = walking_markers(20)


def with_gaps(markers: Markers) -> Markers:
    positions = np.array(markers.positions)
    positions[5:9, 3] = np.nan
    positions[:, 7] = np.nan
    positions[0, 0] = positions[-1, -1] = np.nan
    return replace(markers, positions=positions)


def load_quietly(path, **options) -> Markers:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return load_markers(path, **options)


@pytest.mark.parametrize("suffix", [".trc", ".csv", ".npz"])
@pytest.mark.parametrize(("unit", "up"), [("m", "y"), ("mm", "z"), ("cm", "-x")])
def test_what_is_written_is_read_back(tmp_path, suffix, unit, up):
    """Names, rate, gaps and positions, in any unit and with any up axis; only the lost marker is said."""
    markers, path = with_gaps(WALK), tmp_path / f"a{suffix}"
    save_markers(markers, path, unit=unit, up=up)
    with pytest.warns(UserWarning) as said:
        back = load_markers(path)
    assert [str(w.message) for w in said] == [f"{path}: never seen: {markers.names[7]}"]
    assert back.names == markers.names and back.rate == markers.rate
    np.testing.assert_array_equal(back.tracked, markers.tracked)
    np.testing.assert_allclose(back.positions, markers.positions, atol=1e-8)
    assert suffix != ".npz" or back.events == markers.events
    assert holds_markers(path)
    with pytest.raises(FormatError, match="exists; choose another name, or use --force"):
        save_markers(markers, path)


def write_trc(path, positions, names, *, rate=60, unit="mm", head=None, end="\n"):
    """A TRC as OpenSim has it: positions (F, M, 3) in file units."""
    count = len(names)
    frames = head or (len(positions), count)
    lines = [
        "PathFileType\t4\t(X/Y/Z)\tx.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate:.2f}\t{rate:.2f}\t{frames[0]}\t{frames[1]}\t{unit}\t{rate:.2f}\t1\t{frames[0]}",
        "Frame#\tTime\t" + "".join(f"{name}\t\t\t" for name in names),
        "\t\t" + "\t".join(f"{axis}{k + 1}" for k in range(count) for axis in "XYZ"),
        "",
    ]
    for k, row in enumerate(positions):
        cells = ["" if np.isnan(v) else f"{v:.6f}" for v in row.ravel()]
        lines.append(f"{k + 1}\t{k / rate:.6f}\t" + "\t".join(cells))
    path.write_bytes(end.join(lines).encode() + end.encode())
    return path


NAMES = ["LASI", "RASI", "C7", "LKNE", "LANK"]
NAN = float("nan")


def five(frames: int = 4) -> np.ndarray:
    """(F, 5, 3) of a standing body in millimetres, Y up."""
    still = [[120, 1000, 90], [-120, 1000, 90], [0, 1500, -60], [150, 500, 0], [150, 90, 0]]
    return np.array(still, float) + np.arange(frames)[:, None, None]


def test_numpy_reads_the_same_numbers(tmp_path):
    """A TRC that we wrote, read by genfromtxt alone."""
    save_markers(with_gaps(WALK), tmp_path / "a.trc", unit="mm")
    table = np.genfromtxt(tmp_path / "a.trc", delimiter="\t", skip_header=6)
    np.testing.assert_allclose(table[:, 1], np.arange(20) / WALK.rate, atol=1e-9)
    np.testing.assert_allclose(
        table[:, 2:].reshape(20, -1, 3), with_gaps(WALK).positions * 1000, rtol=1e-8, atol=1e-6
    )


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("unit", ["m", "mm", "cm"])
def test_trc_units_and_line_ends(tmp_path, end, unit):
    """Metres, centimetres and millimetres; blank cells are gaps."""
    positions = five()
    positions[1, 2] = positions[3, 4] = NAN
    size = {"m": 1000, "mm": 1, "cm": 10}[unit]
    markers = load_markers(write_trc(tmp_path / "a.trc", positions / size, NAMES, unit=unit, end=end))
    np.testing.assert_allclose(markers.positions, positions / 1000, atol=1e-8)
    assert (markers.rate, markers.space.unit_source, markers.space.up) == (60, "file", "y")
    assert np.argwhere(~markers.tracked).tolist() == [[1, 2], [3, 4]]


def test_quirks_of_real_trc_files(tmp_path):
    """Byte-order mark, trailing tabs, tabs missing between labels, commas, decimal commas, NaN, cut rows."""
    path, whole = tmp_path / "a.trc", five()
    text = write_trc(path, whole, NAMES).read_text()
    expected = load_markers(path).positions
    quirks = {
        "bom": "\ufeff" + text,
        "trailing": "\n".join(line + "\t\t\t" for line in text.split("\n")),
        "label tabs": text.replace("LASI\t\t\tRASI\t\t\t", "LASI\t\t\tRASI\t\t"),
        "one tab": text.replace("\t\t\t", "\t").replace("PathFile", "Path", 0),
        "comma": text.replace("\t", ","),
        "decimal comma": "\n".join(
            [*text.split("\n")[:6], *(t.replace(".", ",") for t in text.split("\n")[6:])]
        ),
        "blank lines": text.replace("\n1\t0", "\n\n\t\t\t\n1\t0"),
        "spaces": text.replace("\t", " ").replace("DataRate", " DataRate", 1),
        "no axes": "\n".join(line for line in text.split("\n") if "X1\tY1" not in line),
    }
    for name, quirk in quirks.items():
        path.write_text(quirk, encoding="utf-8")
        markers = load_markers(path)
        np.testing.assert_allclose(markers.positions, expected, err_msg=name)
        assert markers.names == tuple(NAMES) and markers.rate == 60, name
    lines = text.split("\n")
    lines[6] = "\t".join(lines[6].split("\t")[:-3])  # the last marker's blank cells were cut off
    lines[7] = lines[7].replace("1501.000000\t-59.000000", "NaN\tNaN")
    path.write_text("\n".join(lines))
    assert np.argwhere(~load_markers(path).tracked).tolist() == [[0, 4], [1, 2]]


def test_unlabelled_columns_of_trc(tmp_path):
    """A marker without a label between labelled ones keeps its place."""
    path = write_trc(tmp_path / "a.trc", five(), ["LASI", "RASI", "", "LKNE", "LANK"])
    with pytest.warns(UserWarning, match="1 point without a label: named unlabelled_3"):
        markers = load_markers(path)
    assert markers.names == ("LASI", "RASI", "unlabelled_3", "LKNE", "LANK")
    np.testing.assert_allclose(markers.positions, five() / 1000)


def test_wrong_counts_are_said_and_the_table_counts(tmp_path):
    """NumMarkers and NumFrames are checked; the rate of the times wins over that of the header."""
    path = write_trc(tmp_path / "a.trc", five(), NAMES, head=(7, 6))
    with pytest.warns(UserWarning) as said:
        assert load_markers(path).positions.shape == (4, 5, 3)
    text = " ".join(str(w.message) for w in said)
    assert "states 6 markers, the table has 5" in text and "states 7 frames, the table has 4" in text
    path.write_text(path.read_text().replace("60.00\t60.00\t7\t6", "30.00\t30.00\t4\t5"))
    with pytest.warns(UserWarning, match="the header states 30 Hz, the times say 60 Hz"):
        assert load_markers(path).rate == 60
    path.write_text(path.read_text().replace("30.00\t30.00", "0\t0"))
    with pytest.warns(UserWarning, match="states no rate: 60 Hz by the times"):
        assert load_markers(path).rate == 60


def test_bad_trc_has_line_numbers(tmp_path):
    """Words for numbers, rows of the wrong length, no frames, labels that do not fit, no rate."""
    path = write_trc(tmp_path / "a.trc", five(), NAMES)
    text = path.read_text()
    for old, new, message in (
        ("1501.000000", "high", r"a.trc:8: not a number \(expected a coordinate of C7, got 'high'\)"),
        ("\n3\t", "\nthree\t", r"a.trc:9: not a number \(expected a frame number, got 'three'\)"),
        (
            "1501.000000",
            "1501.0\t7",
            r"a.trc:8: wrong number of cells for 5 markers .*17: frame, time and three",
        ),
        ("1501.000000\t", "", r"a.trc:8: wrong number of cells"),
        ("C7\t\t\t", "C7\t\t\tT10\t\t\tT11\t\t\t", r"a.trc:4: 7 labels for 5 columns of X, Y and Z"),
        ("Frame#", "Fram", "not a TRC file"),
        ("1501.000000", "1e300", r"a.trc:8: number is not finite or far too large"),
    ):
        path.write_text(text.replace(old, new, 1))
        with pytest.raises(FormatError, match=message):
            load_markers(path)
    path.write_text("\n".join(text.split("\n")[:6]))
    with pytest.raises(FormatError, match="holds no frames"):
        load_markers(path)
    single = write_trc(path, five(1), NAMES)
    assert len(load_markers(single)) == 1
    single.write_text(single.read_text().replace("60.00", "0"))
    with pytest.raises(FormatError, match=r"no frame rate above zero; give it: --rate"):
        load_markers(single)
    assert load_quietly(single, rate=30).rate == 30


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_csv_with_one_or_two_rows_of_header(tmp_path, separator):
    """NAME_x in one row, or names above X, Y, Z; the unit follows from the body."""
    positions = five()
    positions[2, 1] = NAN
    rows = [
        separator.join([f"{k / 50:.3f}", *("" if np.isnan(v) else f"{v:.4f}" for v in row.ravel())])
        for k, row in enumerate(positions)
    ]
    one = separator.join(["Time", *(f"{name}_{axis}" for name in NAMES for axis in "XYZ")])
    two = separator.join(["", *(cell for name in NAMES for cell in (name, "", ""))])
    three = separator.join(["", *(name for name in NAMES for _ in range(3))])
    axes = separator.join(["time", *("XYZ" * len(NAMES))])
    for k, header in enumerate(([one], [two, axes], [three, axes])):
        path = tmp_path / f"{k}.csv"
        path.write_text("\n".join([*header, *rows]))
        markers = load_markers(path)
        assert markers.names == tuple(NAMES) and markers.rate == 50
        assert markers.space.unit == 0.001 and markers.space.unit_source == "guessed"
        np.testing.assert_allclose(markers.positions, positions / 1000)
        assert holds_markers(path)


def test_csv_with_visibility_and_comments(tmp_path):
    """Below one half is a gap; comments give rate, unit and up axis."""
    path = tmp_path / "a.csv"
    path.write_text(
        "# rate 25\n# unit m\n# up z\n"
        "left_hip_x,left_hip_y,left_hip_z,left_hip_visibility\n1,2,3,0.9\n1,2,4,0.1\n"
    )
    markers = load_markers(path)
    np.testing.assert_array_equal(markers.positions, [[[1, 3, -2]], [[NAN] * 3]])
    assert (markers.rate, markers.space.up, markers.space.up_source) == (25, "z", "file")


def test_bad_csv(tmp_path):
    """Each mistake has its line or column."""
    path = tmp_path / "a.csv"
    for text, message in (
        ("time,A_x,A_y,A_z\n0,1,2,x\n", r"a.csv:2: not a number \(expected a number for A_z"),
        ("time,A_x,A_y,A_z\n0,1,2\n", r"a.csv:2: wrong number of cells"),
        ("time,A_x,A_y\n0,1,2\n", r"a.csv:1: columns are missing: A_z"),
        ("time,A_x,A_y,A_z,A_x\n0,1,2,3,4\n", r"a.csv:1: column 'A_x' appears twice"),
        ("time,A_x,A_y,A_z,mood\n0,1,2,3,4\n", r"neither coordinates nor time: mood"),
        ("time,A_x,A_y,A_z\n", "holds no frames"),
        ("A,B\n1,2\n", r"a.csv:1: no columns NAME_x"),
        ("A_x,A_y,A_z\n1,2,3\n", "no frame rate above zero"),
        (",,,\nX,Y,Z\n1,2,3\n", "no columns NAME_x|no name above"),
    ):
        path.write_text(text)
        with pytest.raises(FormatError, match=message):
            load_markers(path)
    path.write_text(
        "time," + ",".join(f"{e}_{a}" for e in ("pelvis", "head") for a in "xyz") + "\n0,1,2,3,4,5,6\n"
    )
    assert not holds_markers(path)


def landmark_frames(frames: int = 3) -> np.ndarray:
    """(F, 33, 4) world landmarks of someone upright: x right, y down, z away; visibility last."""
    points = np.zeros((frames, 33, 4))
    height = {
        "nose": -0.6,
        "shoulder": -0.5,
        "elbow": -0.2,
        "wrist": 0.0,
        "hip": 0.0,
        "knee": 0.42,
        "ankle": 0.83,
    }
    for k, name in enumerate(LANDMARKS):
        side = 0.15 if name.startswith("left") else -0.15
        row = next((h for part, h in height.items() if part in name), -0.6 if k < 11 else 0.1)
        points[:, k] = [side, 0.9 if "heel" in name or "foot" in name else row, 0.01 * k, 1.0]
    points[:, :, 0] += np.arange(frames)[:, None] * 0.01
    return points


@pytest.mark.parametrize("style", ["lists", "objects", "lines", "frames", "people"])
def test_landmarks_of_pose_estimators(tmp_path, style):
    """Every style of JSON: metres, y down becomes Y up, and a hidden landmark is a gap."""
    points = landmark_frames()
    points[1, 0, 3] = 0.2
    timed = [{"time": k / 30, "landmarks": frame.tolist()} for k, frame in enumerate(points)]
    named = [
        [dict(zip(("x", "y", "z", "visibility"), p, strict=True)) for p in frame.tolist()] for frame in points
    ]
    text = {
        "lists": json.dumps({"fps": 30, "frames": points.tolist()}),
        "objects": json.dumps({"fps": 30, "frames": [{"worldLandmarks": frame} for frame in named]}),
        "lines": "\n".join(json.dumps(entry) for entry in timed),
        "frames": json.dumps(timed),
        "people": json.dumps({"rate": 30, "frames": [{"landmarks": [frame]} for frame in named]}),
    }[style]
    path = tmp_path / "a.json"
    path.write_text(text)
    markers = load_markers(path)
    assert markers.names == LANDMARKS and round(markers.rate, 6) == 30
    expected = points[..., :3] * [1, -1, -1]
    expected[1, 0] = NAN
    np.testing.assert_allclose(markers.positions, expected)
    assert markers.space.up == "-y" and markers.space.unit == 1.0


def test_bad_landmarks(tmp_path):
    """Frame and landmark are named."""
    path, good = tmp_path / "a.json", landmark_frames().tolist()
    text_for_number = json.loads(json.dumps(good))
    text_for_number[1][5][0] = "left"
    for document, message in (
        ({"rate": 30, "frames": text_for_number}, r"frame 1, landmark 5: not a number"),
        ({"rate": 30, "frames": [good[0], good[1][:20]]}, r"frame 1 has 20 landmarks \(expected 33"),
        ({"rate": 30, "frames": []}, "no frames"),
        ({"rate": -1, "frames": good}, "the rate must be frames per second"),
        ({"rate": 30, "frames": [{"points": good[0]}]}, "frame 0 has none of: landmarks.*it has: points"),
        ({"rate": 30, "frames": [[], None]}, "no marker is seen in any frame"),
        (good, "no frame rate above zero"),
        ({"rate": 30, "frames": [[[1, 2]] * 33]}, r"frame 0, landmark 0 must be \[x, y, z, visibility\]"),
    ):
        path.write_text(json.dumps(document))
        with pytest.raises(FormatError, match=message):
            load_markers(path)
    for text, message in (
        ("{", "not JSON"),
        ('{"time": 0}\n{', r"a.json:2: not JSON"),
        ("[" * 9999, "not JSON"),
    ):
        path.write_text(text)
        with pytest.raises(FormatError, match=message):
            load_markers(path)
    path.write_text(json.dumps({"rate": 30, "frames": [good[0], [], None]}))
    assert load_markers(path).tracked.sum(axis=1).tolist() == [33, 0, 0]


def test_bad_archives(tmp_path):
    """Missing arrays, wrong shapes and types, pickles and no archive at all."""
    path, names = tmp_path / "a.npz", np.array(["A", "B"])
    good = {"names": names, "positions": np.ones((3, 2, 3)), "rate": np.array(50.0)}
    for change, message in (
        ({"rate": None}, "array 'rate' is missing"),
        ({"positions": np.ones((3, 3, 3))}, r"positions must be \(frames, 2, 3\), got \(3, 3, 3\)"),
        ({"positions": names}, "array 'positions' has the wrong type"),
        ({"names": np.array([1, 2])}, r"array 'names' has the wrong type \(expected texts"),
        ({"names": np.array([{}, {}])}, "not an NPZ file, or a damaged one"),
        ({"rate": np.array([1.0, 2.0])}, "rate must be one number"),
        ({"residuals": np.ones(3)}, "residuals must be"),
        ({"event_labels": names}, "events: 2 labels, 0 times"),
    ):
        arrays = {name: array for name, array in {**good, **change}.items() if array is not None}
        np.savez(path, **arrays)
        with pytest.raises(FormatError, match=message):
            load_markers(path)
    path.write_bytes(b"PK\x03\x04 no")
    with pytest.raises(FormatError, match="not an NPZ file"):
        load_markers(path)


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("markers")
    for suffix in (".trc", ".csv"):
        save_markers(WALK.sliced(slice(0, 3)).selected(WALK.names[:6]), folder / f"a{suffix}")
    frames = [{"time": k / 30, "landmarks": frame.tolist()} for k, frame in enumerate(landmark_frames(2))]
    (folder / "a.json").write_text(json.dumps(frames))
    return {path.suffix: path.read_bytes() for path in folder.iterdir()}


PIECES = st.sampled_from(
    [b"\t", b"\n", b",", b"", b"nan", b"-", b"1e999", b"X", b"[", b"}", b"\xff", b"Frame#", b'"']
)


@settings(max_examples=300)
@given(
    st.sampled_from([".trc", ".csv", ".json"]),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 9), PIECES), max_size=5),
)
def test_damage_ends_in_markers_or_an_error(tmp_path_factory, sound, suffix, changes):
    """Whatever is put into a text or taken out of it: markers, or an error that names the file."""
    data = sound[suffix]
    for place, length, piece in changes:
        at = int(place * len(data))
        data = data[:at] + piece + data[at + length :]
    path = tmp_path_factory.getbasetemp() / f"damaged{suffix}"
    path.write_bytes(data)
    try:
        markers = load_quietly(path)
    except FormatError as error:
        assert str(path) in str(error)
    else:
        assert markers.positions.shape == (len(markers), len(markers.names), 3)


TRC_FILES = {  # markers, frames, rate, unit, height of the highest marker [m], samples that are missing
    "nimblephysics_OpenCapUnfiltered_walking2": (51, 136, 100.0, 1.0, 1.58, 104),
    "nimblephysics_Subject4_squats1": (51, 1346, 100.0, 1.0, 1.46, 0),
    "opensim_subject01_static": (49, 300, 60.0, 0.001, 1.82, 0),
    "opensim_subject01_walk": (41, 151, 60.0, 0.001, 1.81, 0),
}


@pytest.mark.parametrize("path", recordings(*(f"trc/{name}.trc" for name in TRC_FILES)))
def test_real_trc_files_are_what_a_split_of_their_lines_reads(path):
    """Names, counts, rate and every number of real recordings: metres and millimetres, Y up."""
    markers = load_quietly(path)
    count, frames, rate, unit, top, missing = TRC_FILES[path.stem]
    lines = path.read_text("latin-1").splitlines()
    names = [name for name in lines[3].split("\t")[2:] if name.strip()]
    assert list(markers.names) == names and len(names) == count
    start = next(k for k, line in enumerate(lines) if line.split("\t")[0].strip() == "1")
    rows = [line.split("\t") for line in lines[start:] if line.strip()]
    width = 2 + 3 * count
    cells = [[float(c) if c.strip() else NAN for c in (row + [""] * width)[:width]] for row in rows]
    truth = np.array(cells)[:, 2:].reshape(len(rows), -1, 3) * unit
    assert truth.shape == markers.positions.shape == (frames, count, 3)
    np.testing.assert_allclose(markers.positions, truth, atol=1e-12)
    assert (markers.rate, markers.space.unit, markers.space.unit_source) == (rate, unit, "file")
    assert markers.space.up == "y" and int((~markers.tracked).sum()) == missing
    assert np.nanmax(markers.positions[..., 1]) == pytest.approx(top, abs=0.01)
