"""C3D files: every flavour against ezc3d, bad ones against clear errors, damaged ones against crashes."""

from __future__ import annotations

import struct
import warnings
from dataclasses import replace

import ezc3d
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import recordings
from marker_bodies import walking_markers
from sixpoint.body.markers.recording import Markers
from sixpoint.body.motion import FileSpace
from sixpoint.errors import FormatError
from sixpoint.formats import load
from sixpoint.formats.markers import load_markers, save_markers

WALK = walking_markers(50)
RNG = np.random.default_rng(5)


def with_gaps(markers: Markers) -> Markers:
    positions = np.array(markers.positions)
    positions[10:20, 3] = np.nan
    positions[RNG.random(positions.shape[:2]) < 0.1] = np.nan
    residuals = np.where(np.isnan(positions[..., 0]), np.nan, RNG.integers(1, 9, positions.shape[:2]) * 1e-3)
    return replace(markers, positions=positions, residuals=residuals)


def make_file(path, positions, labels, *, rate=100.0, unit="mm", residuals=None, extra=()):
    """A file by ezc3d: positions (F, M, 3) in file units."""
    file = ezc3d.c3d()
    points = np.ones((4, positions.shape[1], len(positions)))
    points[:3] = positions.transpose(2, 1, 0)
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(labels)
    for group, name, value in extra:
        file.add_parameter(group, name, value)
    file["data"]["points"] = points
    if residuals is not None:
        file["data"]["meta_points"]["residuals"] = residuals.T[None]
        file["data"]["meta_points"]["camera_masks"] = np.zeros((7, points.shape[1], points.shape[2]), bool)
    file.write(str(path))
    return path


def ezc3d_positions(path) -> np.ndarray:
    """(F, M, 3) in file units as ezc3d reads them."""
    file = ezc3d.c3d(str(path))
    points = file["data"]["points"][:3].transpose(2, 1, 0).copy()
    points[file["data"]["meta_points"]["residuals"][0].T < 0] = np.nan
    return points


def to_integers(data: bytes, scale: float) -> bytes:
    """The same file with 16-bit coordinates: what was a float is a multiple of the scale."""
    points, analogs = struct.unpack("<HH", data[2:6])
    frames = struct.unpack("<H", data[8:10])[0] - struct.unpack("<H", data[6:8])[0] + 1
    begin = (struct.unpack("<H", data[16:18])[0] - 1) * 512
    width = 4 * points + analogs
    values = np.frombuffer(data[begin : begin + 4 * width * frames], "<f4").reshape(frames, width).copy()
    block = values[:, : 4 * points].reshape(frames, points, 4)
    block[..., :3] = np.round(block[..., :3] / scale)
    body = data[:begin] + values.astype("<i2").tobytes()
    place = body.index(b"\x05\x01SCALE") if b"\x05\x01SCALE" in body else body.index(b"SCALE") - 2
    at = place + 2 + 5 + 2 + 1
    at += 1 + body[at]  # past the number of dimensions and the dimensions
    body = body[:12] + struct.pack("<f", scale) + body[16:]
    return body[:at] + struct.pack("<f", scale) + body[at + 4 :]


def to_processor(data: bytes, processor: int) -> bytes:
    """The same file as an SGI (86) or DEC (85) would write it: every number turned, by walking the format."""

    def integer(raw: bytes) -> bytes:
        return raw[::-1] if processor == 86 else raw

    def float_(raw: bytes) -> bytes:
        if processor == 86:
            return raw[::-1]
        value = np.frombuffer(raw, "<f4")[0] * np.float32(4.0)
        turned = value.tobytes()
        return turned[2:] + turned[:2]

    out = bytearray(data)
    begin = (struct.unpack("<H", data[16:18])[0] - 1) * 512
    for k in range(2, 512, 2):
        out[k : k + 2] = integer(data[k : k + 2])
    for k in (12, 20):
        out[k : k + 4] = float_(data[k : k + 4])
    place = (data[0] - 1) * 512 + 4
    out[place - 1] = processor
    while data[place]:
        length, number = abs(struct.unpack("b", data[place : place + 1])[0]), data[place + 1]
        step_at = place + 2 + length
        step = struct.unpack("<H", data[step_at : step_at + 2])[0]
        out[step_at : step_at + 2] = integer(data[step_at : step_at + 2])
        if number < 128:  # a parameter
            kind, dims = struct.unpack("b", data[step_at + 2 : step_at + 3])[0], data[step_at + 3]
            count = int(np.prod(list(data[step_at + 4 : step_at + 4 + dims]))) if dims else 1
            at = step_at + 4 + dims
            for k in range(count if kind in (2, 4) else 0):
                turn = integer if kind == 2 else float_
                out[at + k * kind : at + (k + 1) * kind] = turn(data[at + k * kind : at + (k + 1) * kind])
        if not step:
            break
        place = step_at + step
    for k in range(begin, len(data) - 3, 4):
        out[k : k + 4] = float_(data[k : k + 4])
    return bytes(out)


@pytest.mark.parametrize("unit", ["m", "cm", "mm"])
@pytest.mark.parametrize("up", ["y", "z", "-y", "x", "-x", "-z"])
def test_what_is_written_is_read_back(tmp_path, unit, up):
    """In any unit and with any up axis: positions, gaps, residuals and events; nothing needs to be said."""
    markers = with_gaps(WALK)
    save_markers(markers, tmp_path / "a.c3d", unit=unit, up=up)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        back = load_markers(tmp_path / "a.c3d")
    assert back.names == markers.names and back.rate == markers.rate and back.events == markers.events
    assert (back.space.up, back.space.unit_source, back.space.up_source) == (up, "file", "file")
    np.testing.assert_array_equal(back.tracked, markers.tracked)
    np.testing.assert_allclose(back.positions, markers.positions, atol=2e-6)
    if unit == "mm":  # residuals are whole numbers of the file's unit
        np.testing.assert_allclose(back.residuals, markers.residuals, atol=1e-9)


@pytest.mark.parametrize("flavour", ["float", "integer", "sgi", "dec"])
def test_every_flavour_is_read_as_ezc3d_reads_it(tmp_path, flavour):
    """Floats, 16-bit integers, and the numbers of other processors: what an independent reader finds."""
    markers = with_gaps(WALK)
    save_markers(markers, tmp_path / "a.c3d", unit="mm", up="z")
    data = (tmp_path / "a.c3d").read_bytes()
    if "integer" in flavour:
        data = to_integers(data, 0.1)
    if flavour in ("sgi", "dec"):
        data = to_processor(data, {"sgi": 86, "dec": 85}[flavour])
    path = tmp_path / "b.c3d"
    path.write_bytes(data)
    back = load_markers(path)
    if flavour not in ("dec", "sgi"):  # which ezc3d 1.7 reads wrongly, or not at all
        truth = ezc3d_positions(path)
        turned = np.stack([truth[..., 0], truth[..., 2], -truth[..., 1]], axis=-1) / 1000
        np.testing.assert_allclose(back.positions, turned, rtol=1e-12)
    if flavour != "integer":
        np.testing.assert_allclose(back.residuals, markers.residuals, atol=1e-9)
    np.testing.assert_allclose(
        back.positions, markers.positions, atol=1.01e-4 if "integer" in flavour else 1e-6
    )
    assert back.events == markers.events and back.rate == markers.rate


def test_more_than_255_labels(tmp_path):
    """POINT:LABELS2 goes on where LABELS ends."""
    positions = RNG.normal(1000, 200, (3, 300, 3))
    path = make_file(tmp_path / "a.c3d", positions, [f"M{k}" for k in range(300)])
    back = load_markers(path)
    assert back.names == tuple(f"M{k}" for k in range(300))
    np.testing.assert_allclose(back.positions[:, 299, 0], positions[:, 299, 0] / 1000, rtol=1e-6)


def body(frames: int = 5) -> np.ndarray:
    """(F, M, 3) in millimetres, Z up."""
    p = WALK.positions[:frames]
    return np.stack([p[..., 0], -p[..., 2], p[..., 1]], axis=-1) * 1000


def test_events_are_counted_from_the_first_frame(tmp_path):
    """EVENT:TIMES are minutes and seconds since frame 1, also where the recording was cut."""
    times = np.array([[0.0, 1.0], [2.5, 1.25]])
    extra = [
        ("EVENT", "USED", [2]),
        ("EVENT", "LABELS", ["Foot Strike", "Foot Off"]),
        ("EVENT", "TIMES", times),
    ]
    path = make_file(
        tmp_path / "a.c3d", body(), WALK.names, extra=[*extra, ("EVENT", "CONTEXTS", ["Left", "Right"])]
    )
    data = bytearray(path.read_bytes())
    data[6:10] = struct.pack("<HH", 101, 105)
    path.write_bytes(data)
    events = load_markers(path).events
    assert [(e.label, e.context) for e in events] == [("Foot Strike", "Left"), ("Foot Off", "Right")]
    np.testing.assert_allclose([e.time for e in events], [1.5, 60.25])


def test_events_of_old_headers(tmp_path):
    """Four-letter events of the header block are kept where there is no group EVENT."""
    path = make_file(tmp_path / "a.c3d", body(), WALK.names)
    data = bytearray(path.read_bytes())
    data[298:302] = struct.pack("<HH", 12345, 1)
    data[304:308] = struct.pack("<f", 0.03)
    data[396:400] = b"RHS "
    path.write_bytes(data)
    assert [(e.label, round(e.time, 6)) for e in load_markers(path).events] == [("RHS", 0.03)]
    assert ezc3d.c3d(str(path))["header"]["events"]["events_label"][0].strip() == "RHS"


def test_results_of_models_are_no_markers(tmp_path):
    """Points that POINT:ANGLES or FORCES name are left out, and that is said."""
    labels = [*WALK.names[:-2], "LHipAngles", "LGroundForce"]
    extra = [("POINT", "ANGLES", ["LHipAngles"]), ("POINT", "FORCES", ["LGroundForce"])]
    path = make_file(tmp_path / "a.c3d", body(), labels, extra=extra)
    with pytest.warns(UserWarning, match="2 points are angles, forces"):
        assert load_markers(path).names == WALK.names[:-2]


def test_labels_that_repeat_or_are_missing(tmp_path):
    """They get distinct names, which are said."""
    labels = list(WALK.names)
    labels[1], labels[4], labels[7] = labels[0], "", labels[0]
    with pytest.warns(UserWarning) as said:
        names = load_markers(make_file(tmp_path / "a.c3d", body(), labels)).names
    assert names[1] == f"{labels[0]}_2" and names[4] == "unlabelled_5" and names[7] == f"{labels[0]}_3"
    assert any("labels that repeat" in str(w.message) for w in said)
    assert any("1 point without a label: named unlabelled_5" in str(w.message) for w in said)
    path = make_file(tmp_path / "b.c3d", body(), labels)
    path.write_bytes(path.read_bytes().replace(b"LABELS", b"LABXLS"))
    with pytest.warns(UserWarning, match=r"no labels \(POINT:LABELS\); they are numbered"):
        assert load_markers(path).names[:2] == ("M001", "M002")


def test_a_person_of_a_kilometre_has_another_unit(tmp_path):
    """Metres stated, millimetres meant: the body decides, and it is said; --unit overrules."""
    path = make_file(tmp_path / "a.c3d", body(), WALK.names, unit="m")
    with pytest.warns(UserWarning, match=r"states 'm', .*about 1\.\d+e\+03 m tall: mm is taken"):
        markers = load_markers(path)
    assert markers.space.unit == 0.001 and markers.space.unit_source == "guessed"
    np.testing.assert_allclose(markers.positions, WALK.positions[:5], atol=1e-6)
    assert load_markers(path, unit="m").space == FileSpace(1.0, "z", "given", "guessed")
    for unit in ("", "furlong"):
        path = make_file(tmp_path / f"u{unit}.c3d", body() / 10, WALK.names, unit=unit)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            assert load_markers(path).space.unit == 0.01


def test_the_body_overrules_a_wrong_screen(tmp_path):
    """Y_SCREEN says +Y, the head is above the feet along Z: Z, and it is said."""
    extra = [("POINT", "X_SCREEN", ["+X"]), ("POINT", "Y_SCREEN", ["+Y"])]
    path = make_file(tmp_path / "a.c3d", body(), WALK.names, extra=extra)
    with pytest.warns(UserWarning, match="the file says y is up, but the body stands along z"):
        np.testing.assert_allclose(load_markers(path).positions, WALK.positions[:5], atol=1e-6)
    with pytest.warns(UserWarning, match="left and right look exchanged"):
        np.testing.assert_allclose(load_markers(path, up="y").positions, body() / 1000, atol=1e-6)


def test_a_mirrored_file_is_said(tmp_path):
    """Exchanged labels or a left-handed world: left is on the right."""
    path = make_file(tmp_path / "a.c3d", body() * [-1, 1, 1], WALK.names)
    with pytest.warns(UserWarning, match="left and right look exchanged"):
        load_markers(path)


def test_samples_at_the_origin_are_gaps(tmp_path):
    """Three exact zeros are what some programs write for a marker they do not see."""
    positions = body()
    positions[2, 7] = 0
    with pytest.warns(UserWarning, match="1 samples exactly at 0 0 0"):
        markers = load_markers(make_file(tmp_path / "a.c3d", positions, WALK.names))
    assert not markers.tracked[2, 7] and markers.tracked.sum() == markers.tracked.size - 1


def test_bad_files_say_what_is_wrong(tmp_path):
    """All gaps, no rate, analog only, cut, no C3D at all, unknown axis or unit."""
    nothing = np.full((5, 2, 3), 0.0)
    path = make_file(tmp_path / "gaps.c3d", nothing, ["LASI", "RASI"], residuals=np.full((5, 2), -1.0))
    with pytest.raises(FormatError, match="no marker is seen in any frame"):
        load_markers(path)
    path = make_file(tmp_path / "rate.c3d", body(), WALK.names)
    path.write_bytes(path.read_bytes().replace(struct.pack("<f", 100.0), struct.pack("<f", 0.0)))
    with pytest.raises(FormatError, match=r"no frame rate above zero.*--rate"):
        load_markers(path)
    assert load_markers(path, rate=50).rate == 50
    data = bytearray(make_file(tmp_path / "analog.c3d", body(), WALK.names).read_bytes())
    data[2:4] = b"\0\0"
    (tmp_path / "analog.c3d").write_bytes(data)
    with pytest.raises(FormatError, match="no points, only 0 analog channels"):
        load_markers(tmp_path / "analog.c3d")
    path = make_file(tmp_path / "cut.c3d", body(50), WALK.names)
    path.write_bytes(path.read_bytes()[:-3000])
    with pytest.raises(FormatError, match=r"the file is cut: 50 frames are stated and there is room for 4\d"):
        load_markers(path)
    (tmp_path / "text.c3d").write_text("Frame# Time" * 100)
    with pytest.raises(FormatError, match="not a C3D file"):
        load_markers(tmp_path / "text.c3d")
    with pytest.raises(FormatError, match="no such file"):
        load_markers(tmp_path / "none.c3d")
    path = make_file(tmp_path / "a.c3d", body(), WALK.names)
    with pytest.raises(FormatError, match="unknown up axis 'w'; axes: x, -x"):
        load_markers(path, up="w")
    with pytest.raises(FormatError, match="unknown unit 'yard'"):
        load_markers(path, unit="yard")
    with pytest.raises(FormatError, match=r"holds no markers; formats: \.c3d"):
        load_markers(tmp_path / "a.bvh")


def test_one_frame_is_a_recording(tmp_path):
    """A static trial of a single frame is read."""
    assert len(load_markers(make_file(tmp_path / "a.c3d", body(1), WALK.names))) == 1


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> bytes:
    path = tmp_path_factory.mktemp("c3d") / "a.c3d"
    save_markers(with_gaps(WALK.sliced(slice(0, 8))), path)
    return path.read_bytes()


@settings(max_examples=300)
@given(
    changes=st.lists(st.tuples(st.integers(0, 1), st.floats(0, 1), st.integers(0, 255)), max_size=8),
    cut=st.floats(0, 1),
)
def test_damage_never_crashes(tmp_path_factory, sound, changes, cut):
    """Whatever bytes change and wherever the file ends: markers, or an error that names the file."""
    data = bytearray(sound)
    for everywhere, place, value in changes:
        data[int(place * ((len(data) if everywhere else 3000) - 1))] = value
    data = data[: int(len(data) * cut)] if cut < 0.3 else data
    path = tmp_path_factory.getbasetemp() / "damaged.c3d"
    path.write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            markers = load_markers(path)
        except FormatError as error:
            assert str(path) in str(error)
        else:
            assert markers.positions.shape == (len(markers), len(markers.names), 3)


WORLDS = {"z": [0, 2, 1], "y": [0, 1, 2]}  # axes of a file that become X, Y and Z, but for the sign of Z
SPACES = {  # up axis, and the subject before the labels; all are in millimetres, and begin with frame 1
    "02_05": ("z", "TakeoMonday:"),
    "btk_others_Gait": ("z", ""),
    "nimblephysics_nick_freeform_001": ("y", "Nick01:"),
    "opensim_walking2": ("z", ""),
}


@pytest.mark.parametrize("path", recordings(*(f"c3d/{name}.c3d" for name in SPACES)))
def test_real_files_are_what_ezc3d_reads(path):
    """Names, rate, frames, gaps and positions of real recordings, against the independent reader."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        markers = load_markers(path)
    file, (up, subject) = ezc3d.c3d(str(path)), SPACES[path.stem]
    labels = file["parameters"]["POINT"]["LABELS"]["value"]
    renamed = [name for name, label in zip(markers.names, labels, strict=True) if name != label]
    assert all(labels.count(label) == 1 for label in set(labels) & set(markers.names))
    assert len(renamed) == (12 if path.stem == "btk_others_Gait" else 0)
    assert all(name.startswith(subject) for name in markers.names)
    assert markers.rate == pytest.approx(file["header"]["points"]["frame_rate"], rel=1e-6)
    assert (markers.space.unit, markers.space.unit_source, markers.space.up) == (0.001, "file", up)
    assert markers.events == ()
    truth = ezc3d_positions(path) * 0.001
    np.testing.assert_array_equal(np.isnan(truth[..., 0]), ~markers.tracked)
    turned = truth[..., WORLDS[up]] * [1, 1, -1 if up == "z" else 1]
    np.testing.assert_allclose(markers.positions, turned, atol=1e-9)


RESIDUALS = {  # block of the data, floats or not, points, analog samples per frame, scale and worst [mm]
    "btk_others_Gait": (11, False, 33, 280, 0.0744075, 3.94),
    "02_05": (13, True, 41, 0, 0.05, 12.7),
}


@pytest.mark.parametrize("path", recordings(*(f"c3d/{name}.c3d" for name in RESIDUALS)))
def test_real_residuals_are_the_lower_byte(path):
    """The format's own rule, read without our reader: an integer file of a DEC, a float file of an Intel."""
    start, floats, points, analogs, scale, worst = RESIDUALS[path.stem]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        markers = load_markers(path)
    raw = path.read_bytes()[(start - 1) * 512 :]
    words = np.frombuffer(raw[: len(raw) // 4 * 4], "<f4" if floats else "<i2")
    width = 4 * points + analogs
    fourth = words[: len(markers) * width].reshape(-1, width)[:, 3 : 4 * points : 4].astype(int)
    seen = fourth >= 0
    np.testing.assert_array_equal(seen, markers.tracked)
    np.testing.assert_allclose(
        markers.residuals[seen], (fourth[seen] % 256) * scale * 1e-3, rtol=1e-5, atol=1e-12
    )
    assert np.nanmax(markers.residuals) * 1000 == pytest.approx(worst, abs=0.01)


@pytest.mark.filterwarnings("ignore:.*labels that repeat")
def test_repeated_labels_are_told_apart_by_their_descriptions(tmp_path):
    """R.Knee and R.Knee.Medial that are both called RKNE; where descriptions do not help, by a number."""
    labels = ["KNE", "KNE", "ANK", "ANK", "FOO", "FOO", *WALK.names[6:]]
    said = ["R.Knee", "R.Knee.Medial", "same", "same", "R.Ankle", "", *[""] * len(WALK.names[6:])]
    path = make_file(tmp_path / "a.c3d", body(), labels, extra=[("POINT", "DESCRIPTIONS", said)])
    with pytest.warns(UserWarning, match=r"as they are described: KNE \(R\.Knee, R\.Knee\.Medial\)"):
        names = load_markers(path).names
    assert names[:6] == ("R.Knee", "R.Knee.Medial", "ANK", "ANK_2", "FOO", "FOO_2")


def test_one_take_as_markers_and_as_skeleton(data):
    """CMU's 02_05 was exported twice: the C3D and the AMC have one rate and one length."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        markers = load_markers(data / "c3d" / "02_05.c3d")
    motion = load(data / "cmu" / "02_05.amc")
    assert markers.rate == pytest.approx(motion.rate) and abs(len(markers) - len(motion)) <= 2
