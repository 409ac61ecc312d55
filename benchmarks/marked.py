"""The measured parts of a page: text between two marks, which benchmarks replace."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path


def rewrite(page: Path, parts: Mapping[str, str]) -> None:
    """Replace what stands between ``<!-- name: begin -->`` and ``<!-- name: end -->``, for each name."""
    text = page.read_text("utf-8")
    for name, part in parts.items():
        begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
        if text.count(begin) != 1 or text.count(end) != 1:
            raise SystemExit(f"{page}: the marks {begin} and {end} must each stand there once")
        before, after = text.split(begin)[0], text.split(end)[1]
        text = f"{before}{begin}\n{part}\n{end}{after}"
    page.write_text(text, "utf-8")
