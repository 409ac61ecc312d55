"""Plain JSON over UDP, in and out: what a microcontroller or a camera script can say with one ``print``.

    {"sixpoint": 1, "time": 12.345, "trackers": {"l_wrist": {"p": [0.3, 1.2, 0.4], "r": [0, 0, 0, 1]},
                                                 "head": null}}

One object per datagram. ``p`` is a position, ``r`` (optional) a unit quaternion xyzw, world<-tracker; both in
a right-handed space, metres and Y up unless ``"unit"`` and ``"up"`` say otherwise. A tracker that is null, or
whose numbers are null or not finite, is lost. Everything else that does not fit is an error that says what
would.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from typing import Any

from sixpoint.errors import PacketError, listed
from sixpoint.live.readings import (
    LOST,
    NO_ROTATION,
    Packet,
    Quaternion,
    Reading,
    Vector,
    as_name,
    as_position,
    as_rotation,
)

VERSION = 1
MAX_SIZE = 16_384
"""Largest datagram [bytes]."""
MAX_TRACKERS = 64
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Metres per unit."""
UPS = ("y", "z")
_KEYS = ("sixpoint", "time", "unit", "up", "trackers")
_HALF = math.sqrt(0.5)


def read_packet(data: bytes) -> Packet:
    """Read one datagram; the readings are of kind "tracker".

    Raises:
        PacketError: It is too large, no JSON, or not as described; nothing of it is used.
    """
    if len(data) > MAX_SIZE:
        raise PacketError(f"{len(data)} bytes, expected at most {MAX_SIZE}")
    try:
        table = json.loads(data.decode())
    except UnicodeDecodeError as error:
        raise PacketError(f"byte {error.start} is not UTF-8") from None
    except RecursionError:
        raise PacketError("brackets are nested too deeply") from None
    except json.JSONDecodeError as error:
        raise PacketError(f"no JSON: {error.msg} at character {error.pos}") from None
    except ValueError:  # an integer of thousands of digits
        raise PacketError("a number is too long") from None
    table = _as_table(table, "the packet", _KEYS)
    if table.get("sixpoint") != VERSION or isinstance(table["sixpoint"], bool):
        raise PacketError(f'"sixpoint" is {_short(table.get("sixpoint"))}, expected the version, {VERSION}')
    unit = _one_of(table, "unit", tuple(UNITS))
    up = _one_of(table, "up", UPS)
    time = table.get("time")
    if time is not None and not (_is_number(time) and math.isfinite(_as_float(time))):
        raise PacketError(f'"time" is {_short(time)}, expected seconds')
    trackers = table.get("trackers")
    if not isinstance(trackers, dict):
        raise PacketError(f'"trackers" is {_short(trackers)}, expected {{name: {{"p": [x, y, z]}}}}')
    if len(trackers) > MAX_TRACKERS:
        raise PacketError(f"{len(trackers)} trackers, expected at most {MAX_TRACKERS}")
    readings = tuple(_read_tracker(name, entry, UNITS[unit], up) for name, entry in trackers.items())
    return Packet(readings, None if time is None else _as_float(time))


def write_packet(readings: Iterable[Reading], time: float | None = None) -> bytes:
    """One datagram that says where trackers are, in metres and Y up; what is NaN is written as null.

    Raises:
        PacketError: It would be too large.
    """
    trackers: dict[str, Any] = {}
    for reading in readings:
        entry: dict[str, Any] = {
            "p": None if reading.position is None or reading.lost else list(reading.position)
        }
        if reading.rotation is not None and math.isfinite(reading.rotation[0]):
            entry["r"] = list(reading.rotation)
        trackers[reading.name] = None if entry == {"p": None} else entry
    table = {"sixpoint": VERSION, **({} if time is None else {"time": time}), "trackers": trackers}
    data = json.dumps(table, separators=(",", ":"), allow_nan=False).encode()
    if len(data) > MAX_SIZE:
        raise PacketError(f"{len(data)} bytes, expected at most {MAX_SIZE}; send fewer trackers at once")
    return data


def _read_tracker(name: str, entry: Any, unit: float, up: str) -> Reading:
    as_name(name)
    if entry is None:
        return Reading("tracker", name, LOST, NO_ROTATION)
    entry = _as_table(entry, f"tracker {name!r}", ("p", "r"))
    if "p" not in entry:
        raise PacketError(f'tracker {name!r} has no "p"; null says that it is lost')
    x, y, z = _numbers(entry["p"], 3, f'"p" of {name!r}')
    position = as_position(x * unit, y * unit, z * unit)
    turn = _numbers(entry.get("r"), 4, f'"r" of {name!r}')
    rotation = as_rotation(turn[0], turn[1], turn[2], turn[3])
    if up == "z":
        position, rotation = _y_up(position, rotation)
    return Reading("tracker", name, position, rotation if "r" in entry else None)


def _y_up(p: Vector, q: Quaternion) -> tuple[Vector, Quaternion]:
    """A world with Z up as one with Y up: (x, y, z) becomes (x, z, -y); the tracker's own axes stay."""
    x, y, z, w = q
    turned = (_HALF * (x - w), _HALF * (y + z), _HALF * (z - y), _HALF * (w + x))
    return (p[0], p[2], -p[1]), turned


def _numbers(value: Any, count: int, what: str) -> list[float]:
    """So many numbers; NaN for each that is null, all of them where the whole is."""
    if value is None:
        return [math.nan] * count
    if not isinstance(value, list) or len(value) != count:
        raise PacketError(f"{what} is {_short(value)}, expected {count} numbers")
    for number in value:
        if number is not None and not _is_number(number):
            raise PacketError(f"{what} holds {_short(number)}, expected {count} numbers")
    return [math.nan if number is None else _as_float(number) for number in value]


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _as_float(value: float) -> float:
    """A float; infinite where an integer is too large for one."""
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _as_table(value: Any, what: str, keys: tuple[str, ...]) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise PacketError(f"{what} is {_short(value)}, expected an object with {listed(keys)}")
    unknown = [_short(key) for key in value if key not in keys]
    if unknown:
        raise PacketError(f"{what} has unknown keys {listed(unknown, 5)}; keys: {listed(keys)}")
    return value


def _one_of(table: dict[str, Any], key: str, choices: tuple[str, ...]) -> str:
    value = table.get(key, choices[0])
    if value not in choices:
        raise PacketError(f'"{key}" is {_short(value)}, expected {listed(choices)}')
    return str(value)


def _short(value: Any) -> str:
    """A received value for a message: escaped, and not long."""
    if isinstance(value, (dict, list)):
        return f"{'an object' if isinstance(value, dict) else 'a list'} of {len(value)}"
    if isinstance(value, int) and abs(value) > 10**20:
        return "a huge number"
    return ascii(value)[:40]
