"""Open Sound Control: our codec against python-osc, and against arbitrary bytes."""

from __future__ import annotations

import math
import random
import struct
import tracemalloc

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder
from pythonosc.osc_packet import OscPacket

from sixpoint.errors import OscError, SixpointError
from sixpoint.live import osc
from sixpoint.live.osc import Bundle, Message, make_message
from sixpoint.live.osc_write import encode, join_bundles

TEXT = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=20)
SCALARS = {
    "i": st.integers(-(2**31), 2**31 - 1),
    "h": st.integers(-(2**63), 2**63 - 1),
    "f": st.floats(width=32, allow_nan=False),
    "d": st.floats(allow_nan=False),
    "t": st.integers(0, 2**64 - 1),
    "s": TEXT,
    "b": st.binary(max_size=20),
    "T": st.just(True),
    "F": st.just(False),
    "N": st.none(),
    "I": st.just(math.inf),
}
VALUES = st.sampled_from(sorted(SCALARS)).flatmap(lambda tag: st.tuples(st.just(tag), SCALARS[tag]))
ARGUMENTS = st.recursive(
    st.lists(VALUES, max_size=6).map(
        lambda pairs: ("".join(t for t, _ in pairs), tuple(v for _, v in pairs))
    ),
    lambda inner: st.lists(inner, max_size=3).map(
        lambda parts: ("".join(f"[{t}]" for t, _ in parts), tuple(v for _, v in parts))
    ),
    max_leaves=4,
)
MESSAGES = st.builds(lambda name, a: Message("/" + name, *a), TEXT, ARGUMENTS)
PACKETS = st.recursive(
    MESSAGES,
    lambda inner: st.builds(Bundle, st.integers(0, 2**64 - 1), st.lists(inner, max_size=4).map(tuple)),
    max_leaves=8,
)


@given(PACKETS)
def test_what_is_written_is_read(packet):
    """Any message or bundle of any types comes back as it was."""
    data = encode(packet)
    assert len(data) % 4 == 0
    assert osc.decode(data) == packet


def plain(value):
    """A tuple as the list that python-osc makes of an array."""
    return [plain(v) for v in value] if isinstance(value, tuple) else value


@given(st.lists(MESSAGES.filter(lambda m: not set("It") & set(m.tags)), min_size=1, max_size=4))
def test_python_osc_reads_what_we_write(messages):
    """The independent peer finds the same addresses and arguments in our bundle."""
    found = OscPacket(encode(Bundle(osc.IMMEDIATELY, tuple(messages)))).messages
    assert [m.message.address for m in found] == [m.address for m in messages]
    assert [m.message.params for m in found] == [plain(m.args) for m in messages]


@given(TEXT, st.lists(VALUES.filter(lambda pair: pair[0] not in "It" and pair[1] != b""), max_size=8))
def test_we_read_what_python_osc_writes(name, values):
    """And we find the same in its messages and bundles; it writes no empty blobs."""
    builder = OscMessageBuilder("/" + name)
    for tag, value in values:
        builder.add_arg(value, tag)
    message = builder.build()
    bundle = OscBundleBuilder(IMMEDIATELY)
    bundle.add_content(message)
    expected = Message("/" + name, "".join(t for t, _ in values), tuple(v for _, v in values))
    assert osc.decode(message.dgram) == expected
    assert osc.decode(bundle.build().dgram) == Bundle(osc.IMMEDIATELY, (expected,))


def test_python_osc_arrays_and_time_tags():
    """Arrays and the time of a bundle agree with the peer as well."""
    builder = OscMessageBuilder("/a")
    builder.add_arg([1, [2.0, "x"]])
    data = builder.build().dgram
    assert osc.decode(data) == make_message("/a", (1, (2.0, "x")))
    bundle = OscBundleBuilder(1_700_000_000.25)
    bundle.add_content(builder.build())
    assert osc.decode(bundle.build().dgram).seconds == pytest.approx(1_700_000_000.25, abs=1e-6)
    timed = Message("/t", "t", (osc.decode(bundle.build().dgram).time,))
    (read, _fraction) = OscMessage(encode(timed)).params[0]
    assert read.timestamp() % 60 == pytest.approx(1_700_000_000 % 60, abs=1)


@given(st.binary(max_size=200) | st.binary(max_size=100).map(lambda b: b"/a\0\0," + b))
def test_arbitrary_bytes_raise_nothing_else(data):
    """Whatever comes is a packet, or an OscError."""
    try:
        packet = osc.decode(data)
    except OscError:
        return
    assert osc.decode(encode(packet)) == packet or "nan" in repr(packet)


def test_a_hundred_thousand_mutated_packets():
    """Flipped, cut, doubled and inflated packets raise nothing but OscError."""
    chance = random.Random(1)
    bones = [
        make_message("/VMC/Ext/Bone/Pos", f"Bone{k}", 0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0) for k in range(3)
    ]
    inner = Bundle(1, (make_message("/VMC/Thru/x", b"blob", (1, True), None),))
    seed = encode(Bundle(1, (*bones, inner, make_message("/VMC/Ext/T", 1.5))))
    read = 0
    for _ in range(100_000):
        data = bytearray(seed)
        for _ in range(chance.randrange(1, 4)):
            where = chance.randrange(len(data))
            if chance.random() < 0.7:
                data[where] = chance.choice((0, 0x2C, 0x2F, 0x5B, 0x5D, 0x73, 0xFF, chance.randrange(256)))
            else:
                del data[where // 4 * 4 :][: chance.choice((1, 4, 40))]
        try:
            osc.decode(bytes(data))
            read += 1
        except OscError:
            pass
    assert 1_000 < read < 99_000


def test_a_flood_of_ever_new_tags_fills_no_memory():
    """What is remembered between packets is bounded: long or changing heads leave nothing behind."""
    tracemalloc.start()
    try:
        osc.decode(b"/a\0\0,\0\0\0")
        before = tracemalloc.get_traced_memory()[0]
        for k in range(600):
            digits = format(k, "010b").replace("0", "T").replace("1", "F")
            osc.decode(encode(Message("/a", digits, tuple(d == "T" for d in digits))))
            long = "N" * 4_000 + digits
            osc.decode(encode(Message("/a", long, (None,) * 4_000 + tuple(d == "T" for d in digits))))
        assert tracemalloc.get_traced_memory()[0] - before < 1_000_000
    finally:
        tracemalloc.stop()


WRONG = {
    "empty": (b"", 0, "positive multiple of 4"),
    "no start": (b"abcd", 0, "neither message nor bundle"),
    "odd": (b"/a\0", 0, "multiple of 4"),
    "endless address": (b"/abc", 0, "does not end"),
    "no comma": (b"/a\0\0abcd", 4, "no type tags"),
    "unknown type": (b"/a\0\0,q\0\0", 4, "unknown type 'q'"),
    "cut number": (b"/a\0\0,d\0\0\0\0\0\0", 8, "8 bytes"),
    "cut string": (b"/a\0\0,s\0\0abcd", 8, "does not end"),
    "blob without size": (b"/a\0\0,b\0\0", 8, "no size"),
    "blob beyond the end": (b"/a\0\0,b\0\0\x7f\xff\xff\xff", 8, "2147483647 bytes"),
    "padding": (b"/a\0x,\0\0\0", 2, "not padded"),
    "not UTF-8": (b"/\xff\0\0,\0\0\0", 1, "UTF-8"),
    "more than told": (b"/a\0\0,\0\0\0abcd", 8, "the end"),
    "open array": (b"/a\0\0,[\0\0", 4, "do not match"),
    "closed array": (b"/a\0\0,]\0\0", 4, "do not match"),
    "bundle without time": (b"#bundle\0", 8, "time tag"),
    "element beyond the end": (b"#bundle\0" + bytes(8) + b"\0\0\x01\0", 16, "at most 0"),
    "element of odd size": (b"#bundle\0" + bytes(8) + b"\0\0\0\x03/a\0\0", 20, "multiple of 4"),
    "in the second element": (b"#bundle\0" + bytes(8) + b"\0\0\0\x08/a\0\0,q\0\0", 24, "unknown type"),
}


@pytest.mark.parametrize(("data", "offset", "text"), WRONG.values(), ids=WRONG)
def test_errors_say_where(data, offset, text):
    """Each kind of damage is an OscError with the byte and what was expected there."""
    with pytest.raises(OscError) as error:
        osc.decode(data)
    assert error.value.offset == offset
    assert text in str(error.value)
    assert isinstance(error.value, SixpointError)


def test_nothing_is_too_large_or_too_deep():
    """Size and nesting are limited both ways."""
    with pytest.raises(OscError, match="at most 65507"):
        osc.decode(bytes(70_000))
    packet = make_message("/a")
    for _ in range(osc.MAX_DEPTH):
        packet = Bundle(1, (packet,))
    assert osc.decode(encode(packet)) == packet
    with pytest.raises(OscError, match="deep"):
        encode(Bundle(1, (packet,)))
    data = encode(packet)
    with pytest.raises(OscError, match="deep"):
        osc.decode(b"#bundle\0" + bytes(8) + struct.pack(">I", len(data)) + data)
    with pytest.raises(OscError, match="nested too deeply"):
        osc.decode(b"/a\0\0" + b"," + b"[" * 9 + b"]" * 9 + b"\0")
    with pytest.raises(OscError, match="at most"):
        encode(make_message("/a", bytes(70_000)))


@pytest.mark.parametrize(
    "message",
    [
        Message("a", "", ()),
        Message("/a\0b", "", ()),
        Message("/a", "i", ()),
        Message("/a", "", (1,)),
        Message("/a", "i", (2**31,)),
        Message("/a", "i", (1.5,)),
        Message("/a", "f", ("x",)),
        Message("/a", "f", (1e300,)),
        Message("/a", "s", (1,)),
        Message("/a", "s", ("\ud800",)),
        Message("/a", "b", (1,)),
        Message("/a", "T", (False,)),
        Message("/a", "[i]", (1,)),
        Message("/a", "i", ((1,),)),
        Message("/a", "[i", ((1,),)),
        Message("/a", "i]", (1,)),
        Message("/a", "q", (1,)),
    ],
    ids=repr,
)
def test_what_osc_cannot_say_is_refused(message):
    """Writing checks addresses, types and values."""
    with pytest.raises(OscError):
        encode(message)


def test_values_without_a_type_are_refused():
    """``make_message`` names the types there are."""
    with pytest.raises(OscError, match="no OSC type for dict"):
        make_message("/a", {})
    assert make_message("/a", 2**40, 1, True, None).tags == "hiTN"


def test_a_message_without_type_tags_is_read():
    """Old senders leave them out where there are no arguments."""
    assert osc.decode(b"/VMC/Ext/Blend/Apply\0\0\0\0") == make_message("/VMC/Ext/Blend/Apply")


@given(st.lists(st.binary(max_size=30).map(lambda b: encode(make_message("/a", b))), max_size=30))
def test_bundles_are_filled_in_order(parts):
    """No bundle exceeds the limit, nothing is lost or exchanged, and no two neighbours would fit in one."""
    bundles = join_bundles(parts, 200)
    assert all(len(b) <= 200 for b in bundles)
    assert [encode(m) for b in bundles for m in osc.messages_in(osc.decode(b))] == parts
    firsts = [4 + len(encode(osc.decode(b).elements[0])) for b in bundles]
    assert all(len(a) + first > 200 for a, first in zip(bundles, firsts[1:], strict=False))
    with pytest.raises(OscError, match="at most 180"):
        join_bundles([encode(make_message("/a", bytes(190)))], 200)
