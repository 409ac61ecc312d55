"""Open Sound Control 1.0: messages and bundles to bytes; the other way is ``osc.py``."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from typing import Any

from sixpoint.errors import OscError
from sixpoint.live.osc import (
    BUNDLE,
    CONSTANTS,
    IMMEDIATELY,
    MAX_DEPTH,
    MAX_SIZE,
    Bundle,
    Message,
    plan_of,
)


def encode(packet: Message | Bundle) -> bytes:
    """Write one datagram; ``decode(encode(packet)) == packet``, up to the precision of "f".

    Raises:
        OscError: An address, type or value that OSC cannot say, or more than ``MAX_SIZE`` bytes.
    """
    data = _encode_message(packet) if isinstance(packet, Message) else _encode_bundle(packet, 0)
    if len(data) > MAX_SIZE:
        raise OscError(f"{len(data)} bytes are no datagram", expected=f"at most {MAX_SIZE}")
    return data


def _encode_bundle(bundle: Bundle, depth: int) -> bytes:
    if depth >= MAX_DEPTH:
        raise OscError("bundles are nested too deeply", expected=f"at most {MAX_DEPTH}")
    parts = [
        _encode_message(e) if isinstance(e, Message) else _encode_bundle(e, depth + 1)
        for e in bundle.elements
    ]
    return join_bundle(parts, bundle.time)


def join_bundle(parts: Iterable[bytes], time: int = IMMEDIATELY) -> bytes:
    """A bundle of packets that are encoded already."""
    if not 0 <= time < 2**64:
        raise OscError(f"time tag {time}", expected="64 bits")
    return b"".join((BUNDLE, time.to_bytes(8, "big"), *(len(p).to_bytes(4, "big") + p for p in parts)))


def join_bundles(parts: Iterable[bytes], limit: int) -> list[bytes]:
    """As few bundles as hold encoded packets in their order, each of at most ``limit`` bytes.

    Raises:
        OscError: One packet is too large for any bundle.
    """
    bundles: list[bytes] = []
    inside: list[bytes] = []
    size = 16
    for part in parts:
        if 20 + len(part) > limit:
            raise OscError(f"a message of {len(part)} bytes", expected=f"at most {limit - 20}")
        if size + 4 + len(part) > limit:
            bundles.append(join_bundle(inside))
            inside, size = [], 16
        inside.append(part)
        size += 4 + len(part)
    return [*bundles, join_bundle(inside)] if inside else bundles


def pad_string(text: str) -> bytes:
    """A string as OSC writes it: UTF-8, one to four zero bytes, a multiple of four.

    Raises:
        OscError: The text holds a zero character or a lone surrogate.
    """
    try:
        data = text.encode()
    except UnicodeEncodeError as error:
        raise OscError(f"not writable as UTF-8: {error}") from None
    if 0 in data:
        raise OscError(f"a zero in the text {text[:40]!r}", expected="none: it ends a string")
    return data + b"\0" * (4 - len(data) % 4)


def _encode_message(message: Message) -> bytes:
    address, tags, args = message
    if not address.startswith("/"):
        raise OscError(f"address {address[:40]!r}", expected='"/" first')
    flat = _flattened(tags, args)
    parts = [pad_string(address), pad_string("," + tags)]
    try:
        for step in plan_of(tags):
            if isinstance(step, struct.Struct):
                count = len(step.format) - 1
                parts.append(step.pack(*flat[:count]))
                del flat[:count]
                continue
            value = flat.pop(0)
            if step == "s":
                parts.append(pad_string(value))
            elif step == "b":
                parts.append(len(value).to_bytes(4, "big") + value + b"\0" * (-len(value) % 4))
            elif value != CONSTANTS[step]:
                raise TypeError(f"{value!r} at type {step!r}")
    except (struct.error, OverflowError, TypeError, AttributeError) as error:
        raise OscError(f"{address}: arguments do not fit the types {tags[:40]!r}: {error}") from None
    return b"".join(parts)


def _flattened(tags: str, args: tuple[Any, ...]) -> list[Any]:
    """Arguments one after the other, checked to have the arrays that the tags say."""
    flat: list[Any] = []
    stack: list[Iterator[Any]] = [iter(args)]
    nothing = object()
    for tag in tags:
        if tag == "]":
            fits = next(stack.pop(), nothing) is nothing and bool(stack)
        else:
            value = next(stack[-1], nothing)
            fits = value is not nothing and isinstance(value, tuple) == (tag == "[")
            if fits and tag == "[":
                stack.append(iter(value))  # type: ignore[call-overload]
            elif fits:
                flat.append(value)
        if not fits:
            break
    else:
        if len(stack) == 1 and next(stack[0], nothing) is nothing:
            return flat
    raise OscError(f"{len(args)} arguments do not fit the types {tags[:40]!r}", expected="one for each type")
