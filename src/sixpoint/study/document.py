"""What a report says, apart from how it looks: headings, paragraphs, lists, tables and pictures in a row.

Texts are plain; ``to_html`` and ``to_markdown`` escape them, so that nothing a user calls a clip can change
the page. Both state the same blocks in the same order.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain, count

BEST, NEXT, GOOD, BAD = "best", "next", "good", "bad"
"""Marks of cells: the best of a column, the next two; a statement that holds, one that does not."""


@dataclass(frozen=True)
class Heading:
    """A heading; those of level 2 are in the table of contents."""

    text: str
    level: int = 2


@dataclass(frozen=True)
class Paragraph:
    """Plain text, after a few words in bold."""

    text: str
    lead: str = ""


@dataclass(frozen=True)
class Bullets:
    """A list of paragraphs."""

    items: tuple[Paragraph, ...]


@dataclass(frozen=True)
class Table:
    """Cells of text under column heads; the first cell of a row is its head.

    Attributes:
        title: Said above the table.
        columns: Heads of the columns, with their units.
        rows: Cells, as many in each row as there are columns.
        groups: What columns belong to, one a column; equal neighbours share it, "" is none.
        marks: (row, column) -> one of ``BEST``, ``NEXT``, ``GOOD``, ``BAD``.
        note: Said below the table.
        prose: Whether the cells are sentences rather than numbers.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    groups: tuple[str, ...] = ()
    marks: Mapping[tuple[int, int], str] = field(default_factory=dict)
    note: str = ""
    prose: bool = False

    def __post_init__(self) -> None:
        for row in (*self.rows, *([self.groups] if self.groups else [])):
            if len(row) != len(self.columns):
                raise ValueError(f"{self.title}: {len(row)} cells under {len(self.columns)} columns")


@dataclass(frozen=True)
class Picture:
    """A PNG.

    Attributes:
        name: Its file name.
        data: The PNG itself.
        caption: Said below it, and where it cannot be seen.
    """

    name: str
    data: bytes
    caption: str

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [pixel]."""
        return int.from_bytes(self.data[16:20], "big"), int.from_bytes(self.data[20:24], "big")


Block = Heading | Paragraph | Bullets | Table | Picture


@dataclass(frozen=True)
class Document:
    """A title and what follows."""

    title: str
    blocks: tuple[Block, ...]

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """All pictures."""
        return tuple(block for block in self.blocks if isinstance(block, Picture))

    def anchored(self) -> Iterator[tuple[Block, str]]:
        """All blocks, each heading with its anchor, which is the one GitHub gives it; others with ""."""
        used: set[str] = set()
        for block in self.blocks:
            if not isinstance(block, Heading):
                yield block, ""
                continue
            plain = re.sub(r"[^\w\- ]", "", block.text.lower()).strip().replace(" ", "-") or "section"
            numbered = chain([plain], (f"{plain}-{k}" for k in count(1)))
            anchor = next(name for name in numbered if name not in used)
            used.add(anchor)
            yield block, anchor


def to_markdown(document: Document, folder: str = "pictures") -> str:
    """The document in GitHub's Markdown; pictures are linked in ``folder`` beside it."""
    lines = [f"# {_escape(document.title)}", ""]
    contents = [(b.text, a) for b, a in document.anchored() if isinstance(b, Heading) and b.level == 2]
    lines += [f"- [{_escape(text, link=True)}](#{anchor})" for text, anchor in contents]
    for block in document.blocks:
        lines += ["", *_lines(block, folder)]
    return "\n".join(lines) + "\n"


def _lines(block: Block, folder: str) -> list[str]:
    match block:
        case Heading():
            return [f"{'#' * block.level} {_escape(block.text)}"]
        case Paragraph():
            return [_sentence(block)]
        case Bullets():
            return [f"- {_sentence(item)}" for item in block.items]
        case Picture():
            link = f"![{_escape(block.caption, link=True)}]({folder}/{block.name})"
            return [link, "", f"*{_escape(block.caption)}*"]
        case Table():
            return _table_lines(block)


def _sentence(paragraph: Paragraph) -> str:
    lead = f"**{_escape(paragraph.lead)}** " if paragraph.lead else ""
    text = _escape(paragraph.text)
    return lead + (text if lead else re.sub(r"^([#+=>\[-]|\d+(?=[.)]))", _guard, text))


def _guard(found: re.Match[str]) -> str:
    """What would begin a list or a heading, so that it does not."""
    return found[1] + "\\" if found[1].isdigit() else "\\" + found[1]


def _table_lines(table: Table) -> list[str]:
    heads = [
        f"{group}: {column}" if group else column
        for group, column in zip(table.groups or [""] * len(table.columns), table.columns, strict=True)
    ]
    rule = ["---" if table.prose or k == 0 else "---:" for k in range(len(heads))]
    cells = [
        [_marked(_escape(cell), table.marks.get((i, k), "")) for k, cell in enumerate(row)]
        for i, row in enumerate(table.rows)
    ]
    rows = [[_escape(head) for head in heads], rule, *cells]
    lines = [f"**{_escape(table.title)}**", ""] if table.title else []
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return [*lines, "", _escape(table.note)] if table.note else lines


def _marked(text: str, mark: str) -> str:
    star = {BEST: "**", NEXT: "*", BAD: "**"}.get(mark, "")
    return f"{star}{text}{star}"


def _escape(text: str, link: bool = False) -> str:
    """Plain text that Markdown shows as it is, on one line; in the text of a link no bracket may be bare."""
    text = " ".join(text.split())
    brackets = r"[\[\]]" if link else r"\](?=[(\[:])"
    text = re.sub(rf"([\\`*<|~$]|{brackets}|&(?=#?\w+;))", r"\\\1", text)
    return re.sub(r"(?<![^\W_])_|_(?![^\W_])", r"\\_", text)
