"""Recordings of live sessions replay exactly, and survive a cut."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sixpoint.errors import FormatError
from sixpoint.live.record import Datagram, Recording, RecordingWriter

DATAGRAMS = st.lists(
    st.builds(
        Datagram,
        st.floats(allow_nan=False, allow_infinity=False),
        st.sampled_from(["vmc", "vrchat", "plain"]),
        st.text(max_size=20),
        st.binary(max_size=200),
    ),
    max_size=8,
)
SOME = [Datagram(k / 90, "vmc", "127.0.0.1:50123", bytes([k]) * 30) for k in range(10)]


def record(path, datagrams, **options):
    with RecordingWriter(path, **options) as writer:
        for datagram in datagrams:
            writer.write(datagram)


@given(DATAGRAMS, DATAGRAMS)
def test_a_recording_replays_exactly(tmp_path_factory, first, second):
    """Times, sources and bytes come back to the last bit, of what was appended too, as often as asked."""
    path = tmp_path_factory.mktemp("live") / "session"
    record(path, first)
    record(path, second, append=True)
    recording = Recording(path)
    assert list(recording) == first + second == list(recording)
    assert not recording.cut


def test_any_cut_is_noticed_and_the_rest_is_read(tmp_path):
    """Whatever byte the file ends at, whole lines before it are read; appending goes on behind them."""
    path = tmp_path / "session"
    record(path, SOME)
    data = path.read_bytes()
    header = data.index(b"\n") + 1
    for end in range(header, len(data), 7):
        path.write_bytes(data[:end])
        recording = Recording(path)
        whole = data[:end].count(b"\n") - 1
        assert list(recording) == SOME[:whole]
        assert recording.cut == (not data[:end].endswith(b"\n"))
        record(path, SOME[-1:], append=True)
        assert list(Recording(path)) == [*SOME[:whole], SOME[-1]]


def test_it_is_readable_while_it_is_written(tmp_path):
    """Every datagram is on its way to the disk when ``write`` returns."""
    path = tmp_path / "session"
    with RecordingWriter(path) as writer:
        for k, datagram in enumerate(SOME):
            writer.write(datagram)
            assert list(Recording(path)) == SOME[: k + 1]
    with pytest.raises(FormatError, match="closed"):
        writer.write(SOME[0])


def test_nothing_is_overwritten(tmp_path):
    """A file that exists is appended to when asked for, and only if it is a recording."""
    path = tmp_path / "session"
    record(path, SOME)
    with pytest.raises(FormatError, match="append to it"):
        RecordingWriter(path)
    other = tmp_path / "notes"
    other.write_text("dear diary\n")
    with pytest.raises(FormatError, match="no recording of a live session"):
        RecordingWriter(other, append=True)
    assert other.read_text() == "dear diary\n"
    record(tmp_path / "new", SOME, append=True)
    assert list(Recording(tmp_path / "new")) == SOME
    with pytest.raises(FormatError, match="cannot be written"):
        RecordingWriter(tmp_path / "no" / "folder")


@pytest.mark.parametrize(
    "line",
    [
        b"{}",
        b"[1]",
        b"nonsense",
        b"[" * 5000,
        b'{"t":"x","as":"vmc","from":"","data":""}',
        b'{"t":NaN,"as":"vmc","from":"","data":""}',
        b'{"t":0,"as":1,"from":"","data":""}',
        b'{"t":0,"as":"vmc","from":"","data":"?"}',
        b'{"t":0,"as":"vmc","from":"","data":5}',
        b'{"t":0,"as":"vmc","from":"\xff","data":""}',
        b" " * 200_000,
    ],
)
def test_damage_in_the_middle_is_an_error(tmp_path, line):
    """It names the file and the line, after what comes before it was read."""
    path = tmp_path / "session"
    record(path, SOME[:1])
    path.write_bytes(path.read_bytes() + line + b"\n" + b"more\n")
    datagrams = iter(Recording(path))
    assert next(datagrams) == SOME[0]
    with pytest.raises(FormatError, match="session:3: a damaged line"):
        next(datagrams)


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "no recording"),
        (b"\x00" * 500, "no recording"),
        (b'{"sixpoint": "live recording"', "no recording"),
        (b'{"sixpoint": "live recording", "version": 2}\n', "version that is not known"),
    ],
)
def test_other_files_are_refused(tmp_path, data, text):
    """Also such that do not exist."""
    path = tmp_path / "session"
    path.write_bytes(data)
    with pytest.raises(FormatError, match=text):
        list(Recording(path))
    with pytest.raises(FormatError, match="cannot be read"):
        list(Recording(tmp_path / "nothing"))
