"""The HIERARCHY block of a BVH file: joints, offsets and channels.

A small state machine over statements (words of one line, braces apart), so that every complaint has a
line. Joint names may hold spaces; keywords may be in any case; ``#`` and ``//`` start comment lines.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.skeleton import Skeleton
from sixpoint.errors import FormatError, listed
from sixpoint.formats.source import parse_numbers

Array = NDArray[np.float64]

_CHANNEL = re.compile(r"([xyz])(position|rotation)\Z", re.IGNORECASE)
_EXPECTED = "OFFSET, CHANNELS, JOINT, End Site or '}'"


@dataclass(eq=False)
class Node:
    """One ROOT, JOINT or End Site as it is being read; ``parent`` is an index into the joints."""

    name: str
    parent: int
    line: int
    offset: Array | None = None
    channels: list[str] = field(default_factory=list)
    seen_channels: bool = False


class Hierarchy(NamedTuple):
    """What stands before MOTION.

    Attributes:
        skeleton: The rig in file units.
        channels: Channel names per joint, e.g. ``"Xposition"``, in file order.
        end: Index of the line that holds MOTION.
    """

    skeleton: Skeleton
    channels: list[list[str]]
    end: int


class Statement(NamedTuple):
    """Words of one line; a brace is a statement of its own."""

    line: int
    words: list[str]


def read_hierarchy(path: Path, lines: Sequence[str]) -> Hierarchy:
    """Parse up to the MOTION line.

    Raises:
        FormatError: With the line of the first thing that is wrong.
    """
    return _Reader(path, lines).read()


def _statements(lines: Sequence[str]) -> Iterator[Statement]:
    for number, text in enumerate(lines, start=1):
        if text.lstrip().startswith(("#", "//")):
            continue
        for part in re.split(r"([{}])", text):
            words = part.split()
            if words:
                yield Statement(number, words)


class _Reader:
    def __init__(self, path: Path, lines: Sequence[str]) -> None:
        self.path = path
        self.lines = lines
        self.joints: list[Node] = []
        self.sites: list[Node] = []
        self.open: list[Node] = []
        self.waiting: Node | None = None  # declared, its "{" not yet seen

    def fail(self, line: int, message: str, expected: str = "", got: str = "") -> FormatError:
        return FormatError(self.path, message, line=line, expected=expected, got=got)

    def read(self) -> Hierarchy:
        statements = _statements(self.lines)
        first = next(statements, Statement(1, [""]))
        if first.words[0].upper() != "HIERARCHY":
            raise self.fail(first.line, "not a BVH file", "HIERARCHY", " ".join(first.words))
        last = first.line
        for line, words in statements:
            last = line
            if words[0].upper() == "MOTION" and self.waiting is None:
                return self._finish(line)
            self._take(line, words)
        raise self.fail(last, "the file ends within the HIERARCHY: truncated?", "MOTION")

    def _take(self, line: int, words: list[str]) -> None:
        key = words[0].upper()
        if self.waiting is not None:
            if key != "{":
                raise self.fail(line, f"{self.waiting.name} has no body", "'{'", " ".join(words))
            self.open.append(self.waiting)
            self.waiting = None
        elif key in ("ROOT", "JOINT"):
            self._start_joint(line, key, " ".join(words[1:]))
        elif key == "END":
            self._start_site(line)
        elif key == "}":
            self._close(line)
        elif key == "OFFSET":
            node = self._current(line, key)
            if node.offset is not None:
                raise self.fail(line, f"second OFFSET of {node.name}", _EXPECTED, key)
            node.offset = parse_numbers(self.path, line, words[1:], 3, f"the offset of {node.name}")
        elif key == "CHANNELS":
            self._take_channels(line, words[1:])
        else:
            raise self.fail(line, "unknown keyword", _EXPECTED if self.open else "ROOT", " ".join(words))

    def _current(self, line: int, key: str) -> Node:
        if not self.open:
            raise self.fail(line, f"{key} outside of a joint", "ROOT or MOTION", key)
        return self.open[-1]

    def _start_joint(self, line: int, key: str, name: str) -> None:
        if not name:
            raise self.fail(line, f"{key} without a name", f"{key} <name>", key)
        if key == "ROOT" and self.joints:
            raise self.fail(line, "more than one ROOT: one figure per file", "one ROOT", f"ROOT {name}")
        if key == "JOINT" and not self.open:
            raise self.fail(line, f"JOINT {name} hangs on nothing", "ROOT", f"JOINT {name}")
        if self.open and self.open[-1] in self.sites:
            raise self.fail(line, "an End Site has no children", "'}'", f"{key} {name}")
        parent = self.joints.index(self.open[-1]) if self.open else -1
        self.waiting = Node(name, parent, line)
        self.joints.append(self.waiting)

    def _start_site(self, line: int) -> None:
        parent = self._current(line, "End Site")
        if parent in self.sites:
            raise self.fail(line, "an End Site has no children", "'}'", "End Site")
        self.waiting = Node(f"{parent.name}_end", self.joints.index(parent), line)
        self.sites.append(self.waiting)

    def _close(self, line: int) -> None:
        node = self._current(line, "}")
        if node.offset is None:
            raise self.fail(line, f"{node.name} has no OFFSET", "OFFSET x y z", "}")
        self.open.pop()

    def _take_channels(self, line: int, words: list[str]) -> None:
        node = self._current(line, "CHANNELS")
        if node in self.sites or node.seen_channels:
            raise self.fail(line, f"{node.name} cannot have these CHANNELS", "one CHANNELS line per joint")
        names = words[1:]
        if not words or not words[0].isdecimal() or int(words[0][:9]) != len(names):
            raise self.fail(
                line, "number of channels and their names differ", "CHANNELS <n> <names>", " ".join(words)
            )
        unknown = [name for name in names if not _CHANNEL.match(name)]
        if unknown:
            raise self.fail(
                line, f"unknown channel of {node.name}", "[XYZ]position or [XYZ]rotation", " ".join(unknown)
            )
        node.channels = [name[0].upper() + name[1:].lower() for name in names]
        node.seen_channels = True
        positions = [c for c in node.channels if c.endswith("position")]
        order = rotation_order(node.channels)
        twice = any(a == b for a, b in pairwise(order))
        if len(set(positions)) < len(positions) or len(order) > 3 or twice:
            raise self.fail(line, f"{node.name} repeats a channel", "each channel once", " ".join(names))

    def _finish(self, line: int) -> Hierarchy:
        if not self.joints:
            raise self.fail(line, "the HIERARCHY holds no joints", "ROOT", "MOTION")
        if self.open:
            names = listed([node.name for node in self.open], 5)
            raise self.fail(line, f"missing '}}': still open are {names}", "'}'", "MOTION")
        lines: dict[str, int] = {}
        for node in self.joints:
            if node.name in lines:
                first = lines[node.name]
                raise self.fail(node.line, f"joint {node.name!r} was declared in line {first}", "a new name")
            lines[node.name] = node.line
        return Hierarchy(self._build(), [node.channels for node in self.joints], line - 1)

    def _build(self) -> Skeleton:
        # An End Site of no length only closes a leaf, as the format wants: it says nothing.
        sites = [node for node in self.sites if np.any(node.offset != 0)]
        return Skeleton(
            tuple(node.name for node in self.joints),
            np.array([node.parent for node in self.joints]),
            np.array([node.offset for node in self.joints]),
            tuple(node.name for node in sites),
            np.array([node.parent for node in sites], dtype=np.int64),
            np.array([node.offset for node in sites]).reshape(-1, 3),
        )


def rotation_order(channels: Sequence[str]) -> str:
    """Euler order of a joint's channels, e.g. ``"ZXY"``; empty for a joint that does not rotate."""
    return "".join(name[0] for name in channels if name.endswith("rotation"))
