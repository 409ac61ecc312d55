"""The sections of an ASF file: units, root, bones and hierarchy as keywords with their words.

Only the layout is checked here, and that every bone hangs on the root exactly once; ``asf`` knows what the
words mean.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sixpoint.errors import FormatError, listed
from sixpoint.formats.source import read_lines

Entry = tuple[int, list[str]]
"""Line number and the words after a keyword."""

_ROOT_NAME = re.compile(r"#\s*root\s+(\S+)\s*\Z")


@dataclass
class Block:
    """Keywords of the root or of one bone."""

    name: str
    line: int
    entries: dict[str, Entry] = field(default_factory=dict)

    def get(self, key: str, default: Entry) -> Entry:
        """The words after a keyword, or a default."""
        return self.entries.get(key, default)


@dataclass
class Blocks:
    """A whole ASF file.

    Attributes:
        root_name: Name of the root joint, where our own writer noted it.
        parents: Bone -> the bone it hangs on, or "root".
    """

    units: dict[str, Entry] = field(default_factory=dict)
    root: Block = field(default_factory=lambda: Block("root", 0))
    bones: list[Block] = field(default_factory=list)
    parents: dict[str, str] = field(default_factory=dict)
    root_name: str = ""


def read_blocks(path: Path) -> Blocks:
    """Read the sections of an ASF file.

    Raises:
        FormatError: With the line of the first thing that is wrong.
    """
    blocks = Blocks()
    sections: dict[str, list[Entry]] = {}
    starts: dict[str, int] = {}
    section = ""
    last = 0
    for number, text in enumerate(read_lines(path), start=1):
        words = text.split()
        comment = _ROOT_NAME.match(text.strip())
        if comment:
            blocks.root_name = comment[1]
        if not words or words[0].startswith("#"):
            continue
        last = number
        if words[0].startswith(":"):
            section = words[0].lower()
            if section in sections:
                raise FormatError(path, f"second section {section}", line=number, expected="each once")
            sections[section], starts[section] = [], number
        elif section:
            sections[section].append((number, words))
        else:
            raise FormatError(
                path, "not an ASF file", line=number, expected="a section such as :version", got=text.strip()
            )
    for needed in (":root", ":bonedata", ":hierarchy"):
        if needed not in sections:
            raise FormatError(path, f"section {needed} is missing: truncated?", line=last, expected=needed)
    blocks.units = _keywords(sections.get(":units", []))
    blocks.root = Block("root", starts[":root"], _keywords(sections[":root"]))
    blocks.bones = _read_bones(path, sections[":bonedata"])
    blocks.parents = _read_hierarchy(path, sections[":hierarchy"], blocks.bones)
    return blocks


def _keywords(entries: Sequence[Entry]) -> dict[str, Entry]:
    return {words[0].lower(): (line, words[1:]) for line, words in entries}


def _read_bones(path: Path, entries: Sequence[Entry]) -> list[Block]:
    bones: dict[str, Block] = {}
    block: Block | None = None
    last_key = ""
    for line, words in entries:
        key = words[0].lower()
        if key == "begin":
            if block is not None:
                raise FormatError(path, "a bone begins within another", line=line, expected="end")
            block = Block("", line)
        elif block is None:
            raise FormatError(path, "text between bones", line=line, expected="begin", got=" ".join(words))
        elif key == "end":
            _keep_bone(path, bones, block)
            block = None
        elif key.startswith("(") and last_key == "limits":
            block.entries["limits"][1].extend(words)
            continue
        elif key in block.entries:
            raise FormatError(path, f"second {key} of one bone", line=line, expected="each keyword once")
        else:
            block.entries[key] = (line, words[1:])
        last_key = key
    if block is not None:
        raise FormatError(path, "the last bone has no end: truncated?", line=block.line, expected="end")
    return list(bones.values())


def _keep_bone(path: Path, bones: dict[str, Block], block: Block) -> None:
    line, words = block.get("name", (block.line, []))
    if len(words) != 1:
        raise FormatError(path, "a bone needs a name", line=line, expected="name <word>", got=" ".join(words))
    block.name = words[0]
    if block.name in bones or block.name == "root":
        raise FormatError(path, f"bone {block.name!r} is declared twice", line=line, expected="a new name")
    bones[block.name] = block


def _read_hierarchy(path: Path, entries: Sequence[Entry], bones: Sequence[Block]) -> dict[str, str]:
    known = {"root", *(bone.name for bone in bones)}
    parents: dict[str, str] = {}
    for line, words in entries:
        if len(words) == 1 and words[0].lower() in ("begin", "end"):
            continue
        unknown = [word for word in words if word not in known]
        if unknown:
            raise FormatError(
                path, f"the hierarchy names bones that are not declared: {listed(unknown)}", line=line
            )
        parent, *children = words
        for child in children:
            if child in parents or child == "root":
                raise FormatError(path, f"{child!r} hangs on two bones", line=line, expected="one parent")
            parents[child] = parent
    reached = {"root"}
    front = ["root"]
    below: dict[str, list[str]] = {}
    for child, parent in parents.items():
        below.setdefault(parent, []).append(child)
    while front:
        children = below.get(front.pop(), [])
        reached.update(children)
        front.extend(children)
    lost = [bone for bone in bones if bone.name not in reached]
    if lost:
        raise FormatError(
            path,
            f"these bones do not hang on the root: {listed([bone.name for bone in lost])}",
            line=lost[0].line,
            expected="every bone in the hierarchy",
        )
    return parents
