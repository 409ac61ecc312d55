"""Plain JSON: what it says, what it refuses, and that nothing else can happen."""

from __future__ import annotations

import contextlib
import json
import math
import random
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sixpoint.errors import PacketError
from sixpoint.live import plain
from sixpoint.live.readings import LOST, NO_ROTATION, Reading

GOOD = {
    "sixpoint": 1,
    "time": 12.5,
    "trackers": {"l_wrist": {"p": [0.3, 1.2, 0.4], "r": [0, 0, 0, 2]}, "head": {"p": [0, 1.7, 0]}, "x": None},
}


def read(table):
    return plain.read_packet(json.dumps(table).encode())


def changed(**more):
    return {**GOOD, **more}


def test_what_is_said():
    """Positions, rotations made unit, trackers without rotation, and lost ones."""
    packet = read(GOOD)
    wrist, head, lost = packet.readings
    assert packet.time == 12.5
    assert wrist == Reading("tracker", "l_wrist", (0.3, 1.2, 0.4), (0.0, 0.0, 0.0, 1.0))
    assert head == Reading("tracker", "head", (0.0, 1.7, 0.0), None)
    assert lost.lost and np.isnan(lost.rotation).all()
    assert read({"sixpoint": 1, "trackers": {}}).time is None


def test_units_and_up():
    """Centimetres, and a world with Z up: its up is our up, and its X is ours; the order of hands stays."""
    half = math.sqrt(0.5)
    table = {
        "sixpoint": 1,
        "unit": "cm",
        "up": "z",
        "trackers": {"a": {"p": [100, 200, 300], "r": [0, 0, half, half]}},
    }
    (reading,) = read(table).readings
    np.testing.assert_allclose(reading.position, [1, 3, -2])
    to_ours = Rotation.from_matrix([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    expected = to_ours * Rotation.from_rotvec([0, 0, math.pi / 2])
    assert (Rotation.from_quat(reading.rotation) * expected.inv()).magnitude() < 1e-9


def test_not_finite_and_null_are_lost():
    """As in every protocol: the tracker is lost, the packet is good."""
    for bad in ("NaN", "Infinity", "-Infinity", "null", "1e999", "1" + "0" * 400, "1e9"):
        text = f'{{"sixpoint": 1, "trackers": {{"a": {{"p": [0, {bad}, 0], "r": [0, 0, 0, 1]}}}}}}'
        (reading,) = plain.read_packet(text.encode()).readings
        assert reading.lost
    for p in ("null", "[null, null, null]"):
        (reading,) = plain.read_packet(f'{{"sixpoint":1,"trackers":{{"a":{{"p":{p}}}}}}}'.encode()).readings
        assert reading.lost
    (reading,) = read({"sixpoint": 1, "trackers": {"a": {"p": [0, 1, 0], "r": [0, 0, 0, 0]}}}).readings
    assert np.isnan(reading.rotation).all() and not reading.lost


def tracker(entry):
    return changed(trackers={"a": entry})


REFUSED = [
    ([], "the packet is a list of 0"),
    ({"trackers": {}}, '"sixpoint" is None, expected the version, 1'),
    (changed(sixpoint=2), "expected the version, 1"),
    (changed(sixpoint=True), "expected the version"),
    (changed(units="m"), "unknown keys 'units'; keys: sixpoint, time, unit, up, trackers"),
    (changed(unit="furlong"), "\"unit\" is 'furlong', expected m, cm, mm"),
    (changed(unit=["m"]), '"unit" is a list of 1'),
    (changed(up="x"), "expected y, z"),
    (changed(time="now"), "expected seconds"),
    (changed(time=math.inf), "expected seconds"),
    (changed(trackers=[1]), '"trackers" is a list of 1, expected {name:'),
    (changed(trackers={str(k): None for k in range(65)}), "65 trackers, expected at most 64"),
    (changed(trackers={"": None}), "printable"),
    (changed(trackers={"\x1b[2J": None}), "printable"),
    (tracker(3), "tracker 'a' is 3, expected an object with p, r"),
    (tracker({}), "tracker 'a' has no \"p\"; null says that it is lost"),
    (tracker({"pos": [0, 0, 0]}), "unknown keys 'pos'; keys: p, r"),
    (tracker({"p": [0, 0]}), "\"p\" of 'a' is a list of 2, expected 3 numbers"),
    (tracker({"p": [0, 0, "0"]}), "holds '0', expected 3 numbers"),
    (tracker({"p": [0, 0, False]}), "holds False"),
    (tracker({"p": [0, 0, 0], "r": [0, 0, 1]}), "expected 4 numbers"),
]


@pytest.mark.parametrize(("table", "text"), REFUSED, ids=[text[:30] for _, text in REFUSED])
def test_errors_say_what_would_work(table, text):
    """Each names the place, what is there, and what was expected."""
    with pytest.raises(PacketError) as error:
        read(table)
    assert text in str(error.value)


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "no JSON"),
        (b"\xff{}", "byte 0 is not UTF-8"),
        (b"{'a': 1}", "at character 1"),
        (b"[" * 10_000, "JSON|nested"),
        (b'{"sixpoint":' + b"9" * 9_000 + b"}", "too long"),
        (b" " * 20_000, "expected at most 16384"),
        (b'{"sixpoint":1,"trackers":{"a":{"p":' + b"[" * 900 + b"]" * 900 + b"}}}", "expected 3 numbers"),
    ],
)
def test_hostile_bytes(data, text):
    """Depth, digits and size are limited."""
    with pytest.raises(PacketError, match=text):
        plain.read_packet(data)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from("pra"), inner, max_size=3),
    max_leaves=8,
)


@given(JSON, JSON, JSON)
def test_any_json_is_read_or_refused(time, trackers, entry):
    """No value in any place raises anything else."""
    for table in (
        trackers,
        changed(time=time, trackers=trackers),
        tracker(entry),
        tracker({"p": trackers, "r": entry}),
    ):
        with contextlib.suppress(PacketError):
            read(table)


def test_mutated_packets():
    """Nor do bytes that are damaged."""
    chance = random.Random(2)
    seed = json.dumps(GOOD).encode()
    for _ in range(20_000):
        data = bytearray(seed)
        for _ in range(chance.randrange(1, 4)):
            data[chance.randrange(len(data))] = chance.choice(b'{}[],:"\\0eE-nN\xff')
        with contextlib.suppress(PacketError):
            plain.read_packet(bytes(data[: chance.choice((None, chance.randrange(len(data))))]))


def test_what_is_written_is_read():
    """Readings go out and come in exactly; what is lost is null."""
    sent = [
        Reading("tracker", "a", (0.1, 0.2, 0.3), (0.5, 0.5, 0.5, 0.5)),
        Reading("tracker", "b", (0.1, 0.2, 0.3)),
        Reading("tracker", "c", LOST, NO_ROTATION),
    ]
    data = plain.write_packet(sent, 1.5)
    packet = plain.read_packet(data)
    assert packet.time == 1.5 and packet.readings[:2] == tuple(sent[:2]) and packet.readings[2].lost
    assert json.loads(data)["trackers"]["c"] is None
    with pytest.raises(PacketError, match="fewer trackers"):
        plain.write_packet([Reading("tracker", f"{k:060}", (0.0, 0.0, 0.0)) for k in range(300)])


def test_the_documentation_is_true(capsys):
    """The packet that docs/live.md shows is read, and its Python runs as it stands."""
    text = (Path(__file__).resolve().parents[1] / "docs" / "live.md").read_text("utf-8")
    (shown,) = re.findall(r"```json\n(.*?)```", text, re.DOTALL)
    assert [r.lost for r in plain.read_packet(shown.encode()).readings] == [False, True]
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(compile(block, "live.md", "exec"), {})
    position, sizes = capsys.readouterr().out.splitlines()
    np.testing.assert_allclose(
        json.loads(position.replace("(", "[").replace(")", "]")), [0.3, 1.2, 0.4], atol=1e-6
    )
    assert max(json.loads(sizes)) < 1400
