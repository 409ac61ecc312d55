"""Open Sound Control 1.0: bytes to messages and bundles, with errors that say which byte is wrong.

Types: ``i f s b`` of the standard, ``h d t T F N I`` and arrays of its extensions. Strings are UTF-8, as VMC
wants them. Nothing received is evaluated, no address pattern is matched, and no size is believed before it is
checked; a datagram is decoded whole or not at all.

Reference: Wright 2002, "Open Sound Control 1.0 Specification" (opensoundcontrol.stanford.edu).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

from sixpoint.errors import OscError

MAX_SIZE = 65_507
"""Largest UDP datagram over IPv4 [bytes]; nothing larger is read or written."""
MAX_DEPTH = 8
"""How deep bundles and arrays may be nested."""
IMMEDIATELY = 1
"""The time tag that means "now"."""

BUNDLE = b"#bundle\0"
CONSTANTS = {"T": True, "F": False, "N": None, "I": math.inf}
"""Types that have no bytes but their tag."""

Plan = tuple[struct.Struct | str, ...]

_SHORT = 64  # longer heads and type tags are not remembered: a flood must not fill the memory
_ZEROS = b"\0\0\0\0"
_NUMBERS = {"i": "i", "f": "f", "h": "q", "d": "d", "t": "Q"}
_TYPES = "i, f, s, b, h, d, t, T, F, N, I or an array of them"
_NTP_TO_UNIX = 2_208_988_800  # seconds from 1900 to 1970


class Message(NamedTuple):
    """One OSC message.

    Attributes:
        address: ``"/VMC/Ext/T"``.
        tags: Type tags without the comma, ``"sff"``.
        args: The arguments: int, float, str, bytes, bool, None ("N"), ``math.inf`` ("I"), a time tag as its
            64-bit number ("t"); an array is a tuple.
    """

    address: str
    tags: str
    args: tuple[Any, ...]


class Bundle(NamedTuple):
    """Messages that belong together.

    Attributes:
        time: Time tag, 64 bits: seconds since 1900 and their fraction; ``IMMEDIATELY``.
        elements: Messages and bundles.
    """

    time: int
    elements: tuple[Message | Bundle, ...]

    @property
    def seconds(self) -> float | None:
        """The time since 1970 [s]; None for "immediately"."""
        return None if self.time <= IMMEDIATELY else self.time / 2**32 - _NTP_TO_UNIX


def make_message(address: str, *args: Any) -> Message:
    """A message with the usual types: int is "i" or "h", float "f", str "s", bytes "b", a tuple an array.

    Raises:
        OscError: A value has none of these types.
    """
    return Message(address, "".join(map(_tag_of, args)), args)


def _tag_of(value: Any) -> str:
    if value is None or value is True or value is False:
        return "N" if value is None else "T" if value else "F"
    if isinstance(value, int):
        return "i" if -(2**31) <= value < 2**31 else "h"
    if isinstance(value, tuple):
        return "[" + "".join(map(_tag_of, value)) + "]"
    for kind, tag in ((float, "f"), (str, "s"), (bytes, "b")):
        if isinstance(value, kind):
            return tag
    raise OscError(f"no OSC type for {type(value).__name__}", expected="int, float, str, bytes, bool, None")


def messages_in(packet: Message | Bundle) -> Iterator[Message]:
    """All messages of a packet in order, those of nested bundles in their place."""
    if isinstance(packet, Message):
        yield packet
        return
    for element in packet.elements:
        yield from messages_in(element)


def decode(data: bytes) -> Message | Bundle:
    """Read one datagram.

    Raises:
        OscError: It is not OSC, or it is larger than ``MAX_SIZE``; the offset says where.
    """
    if len(data) > MAX_SIZE:
        raise OscError(f"{len(data)} bytes are no datagram", offset=0, expected=f"at most {MAX_SIZE}")
    return _read_packet(data, 0, len(data), 0)


def _read_packet(data: bytes, at: int, end: int, depth: int) -> Message | Bundle:
    if (end - at) % 4 or end == at:
        raise OscError(f"a packet of {end - at} bytes", offset=at, expected="a positive multiple of 4")
    if data[at] == 0x2F:  # "/"
        return _read_message(data, at, end)
    if not data.startswith(BUNDLE, at, end):
        raise OscError("neither message nor bundle", offset=at, expected='"/" or "#bundle"')
    if depth >= MAX_DEPTH:
        raise OscError("bundles are nested too deeply", offset=at, expected=f"at most {MAX_DEPTH}")
    if end - at < 16:
        raise OscError("the bundle ends before its time tag", offset=end, expected="8 bytes")
    time = int.from_bytes(data[at + 8 : at + 16], "big")
    elements = []
    at += 16
    while at < end:
        size = int.from_bytes(data[at : at + 4], "big")  # there are 4 bytes: all sizes are multiples of 4
        at += 4
        if size > end - at:
            raise OscError(
                f"an element of {size} bytes", offset=at - 4, expected=f"at most {end - at}, what is left"
            )
        elements.append(_read_packet(data, at, at + size, depth + 1))
        at += size
    return Bundle(time, tuple(elements))


def _read_message(data: bytes, at: int, end: int) -> Message:
    stop = data.find(b"\0", at, end)
    stop = data.find(b"\0", at + (stop - at) // 4 * 4 + 4, end)
    after = at + (stop - at) // 4 * 4 + 4
    if 0 < after - at <= _SHORT:
        try:
            address, tags, plan, size = _read_short_head(data[at:after])
            at += size
        except OscError:
            address, tags, plan, at = _read_head(data, at, end)  # says where it is
    else:
        address, tags, plan, at = _read_head(data, at, end)
    values: list[Any] = []
    for step in plan:
        if isinstance(step, struct.Struct):
            if step.size > end - at:
                raise OscError(f"numbers of {tags[:40]!r} are cut", offset=at, expected=f"{step.size} bytes")
            values += step.unpack_from(data, at)
            at += step.size
        elif step == "s":
            value, at = _read_string(data, at, end)
            values.append(value)
        elif step == "b":
            blob, at = _read_blob(data, at, end)
            values.append(blob)
        else:
            values.append(CONSTANTS[step])
    if at != end:
        raise OscError(f"{end - at} bytes after the arguments {tags[:40]!r}", offset=at, expected="the end")
    return Message(address, tags, _nested(tags, values) if "[" in tags else tuple(values))


def _read_head(data: bytes, at: int, end: int) -> tuple[str, str, Plan, int]:
    """Address, tags, how to read the arguments, and where they start."""
    address, at = _read_string(data, at, end)
    if at == end:  # "receivers should be robust in the case of a missing type tag string"
        return address, "", (), at
    if data[at] != 0x2C:  # ","
        raise OscError("no type tags", offset=at, expected='","')
    tags, after = _read_string(data, at, end)
    try:
        return address, tags[1:], plan_of(tags[1:]), after
    except OscError as error:
        raise OscError(str(error), offset=at) from None


@lru_cache(maxsize=512)
def _read_short_head(head: bytes) -> tuple[str, str, Plan, int]:
    """The same for what a stream repeats in every packet."""
    return _read_head(head, 0, len(head))


def plan_of(tags: str) -> Plan:
    """Steps that read arguments: a struct for each run of numbers, else the type's letter.

    Raises:
        OscError: A type is unknown, or brackets do not match.
    """
    return _short_plan(tags) if len(tags) <= _SHORT else _make_plan(tags)


@lru_cache(maxsize=256)
def _short_plan(tags: str) -> Plan:
    return _make_plan(tags)


def _make_plan(tags: str) -> Plan:
    steps: list[struct.Struct | str] = []
    run = ""
    depth = 0
    for tag in tags:
        if tag in _NUMBERS:
            run += _NUMBERS[tag]
            continue
        if tag in "[]":
            depth += 1 if tag == "[" else -1
            if not 0 <= depth <= MAX_DEPTH:
                raise OscError(f"brackets of {tags[:40]!r} do not match, or are nested too deeply")
            continue
        if tag not in "sb" and tag not in CONSTANTS:
            raise OscError(f"unknown type {tag!r} in {tags[:40]!r} (expected {_TYPES})")
        if run:
            steps.append(struct.Struct(">" + run))
            run = ""
        steps.append(tag)
    if depth:
        raise OscError(f"brackets of {tags[:40]!r} do not match")
    return (*steps, struct.Struct(">" + run)) if run else tuple(steps)


def _nested(tags: str, values: list[Any]) -> tuple[Any, ...]:
    """Put values that were read one after the other into the arrays of the tags."""
    open_arrays: list[list[Any]] = [[]]
    rest = iter(values)
    for tag in tags:
        if tag == "[":
            open_arrays.append([])
        elif tag == "]":
            array = tuple(open_arrays.pop())
            open_arrays[-1].append(array)
        else:
            open_arrays[-1].append(next(rest))
    return tuple(open_arrays[0])


def _read_string(data: bytes, at: int, end: int) -> tuple[str, int]:
    """The text that starts at ``at``, and where what follows it starts."""
    stop = data.find(b"\0", at, end)
    if stop < 0:
        raise OscError("a string does not end", offset=at, expected="a zero byte")
    after = at + (stop - at) // 4 * 4 + 4
    if data[stop:after] != _ZEROS[: after - stop]:
        raise OscError(
            "a string is not padded with zeros", offset=stop, expected=f"{after - stop} zero bytes"
        )
    try:
        return data[at:stop].decode(), after
    except UnicodeDecodeError as error:
        raise OscError("a string is not UTF-8", offset=at + error.start, expected="UTF-8") from None


def _read_blob(data: bytes, at: int, end: int) -> tuple[bytes, int]:
    if end - at < 4:
        raise OscError("a blob has no size", offset=at, expected="4 bytes")
    size = int.from_bytes(data[at : at + 4], "big")
    padded = (size + 3) // 4 * 4
    if padded > end - at - 4:
        raise OscError(f"a blob of {size} bytes", offset=at, expected=f"at most {end - at - 4}")
    start = at + 4
    if data[start + size : start + padded].strip(b"\0"):
        raise OscError("a blob is not padded with zeros", offset=start + size, expected="zero bytes")
    return data[start : start + size], start + padded
