"""A document as one page of HTML that needs nothing else: pictures are inside it, there is no script.

Wide tables and pictures scroll sideways, first columns stay; colours follow the reader's scheme.
"""

from __future__ import annotations

from base64 import b64encode
from html import escape
from itertools import groupby

from sixpoint.study.document import Block, Bullets, Document, Heading, Paragraph, Picture, Table

STYLE = """
:root { color-scheme: light dark; --ink: #22303c; --soft: #64717e; --line: #dfe4e9; --page: #ffffff;
  --card: #f6f8f9; --accent: #12707f; --good: #2d7a3e; --bad: #b3363f; --best: #dff1f3; }
@media (prefers-color-scheme: dark) { :root { --ink: #e3e8ec; --soft: #9aa7b3; --line: #35424e;
  --page: #161d23; --card: #1f2830; --accent: #63c3d1; --good: #7ccf8f; --bad: #ff9aa0; --best: #1d444b; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", "DejaVu Sans", sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 2.5rem 1.25rem 4rem; }
h1 { font-size: 2rem; line-height: 1.2; margin: 0 0 1.25rem; letter-spacing: -0.01em; text-wrap: balance; }
h2 { font-size: 1.4rem; line-height: 1.25; margin: 3.25rem 0 0.75rem; padding-top: 0.9rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1.08rem; margin: 2.25rem 0 0.5rem; }
h1, h2, h3, figcaption, td, th, p, li { overflow-wrap: break-word; }
p, ul { max-width: 46rem; margin: 0.6rem 0; }
ul { padding-left: 1.2rem; }
li { margin: 0.3rem 0; }
nav { margin: 1.5rem 0; padding: 0.8rem 1.1rem; background: var(--card); border-radius: 8px; }
nav ul { margin: 0; padding: 0; list-style: none; max-width: none; columns: 15rem; }
nav li { margin: 0; padding: 0.12rem 0; break-inside: avoid; }
a { color: var(--accent); text-decoration: none; }
a:hover { text-decoration: underline; }
.wide { overflow-x: auto; margin: 0.5rem 0 0.4rem; border: 1px solid var(--line); border-radius: 8px; }
.wide:focus-visible { outline: 2px solid var(--accent); }
table { border-collapse: separate; border-spacing: 0; width: 100%; font-size: 0.875rem; line-height: 1.35;
  font-variant-numeric: tabular-nums; }
th, td { padding: 0.36rem 0.6rem; text-align: right; vertical-align: top; white-space: nowrap;
  border-bottom: 1px solid var(--line); }
tbody tr:last-child > * { border-bottom: 0; }
tbody tr:hover > * { background: var(--card); }
thead th { background: var(--card); color: var(--soft); font-weight: 600; vertical-align: bottom;
  white-space: normal; min-width: 4.2rem; }
thead th.group { text-align: center; color: var(--ink); border-left: 1px solid var(--line); }
td.first, thead th.first { border-left: 1px solid var(--line); }
th:first-child { position: sticky; left: 0; z-index: 1; text-align: left; background: var(--page);
  font-weight: 600; border-right: 1px solid var(--line); }
thead th:first-child { background: var(--card); }
.prose th, .prose td { text-align: left; white-space: normal; }
.prose td { min-width: 4rem; }
.prose tbody th { font-weight: 500; }
.prose th:first-child { min-width: 7rem; width: 30%; }
td.best { font-weight: 700; background: var(--best); }
td.next { font-style: italic; background: color-mix(in srgb, var(--best) 45%, transparent); }
td.good { color: var(--good); font-weight: 600; }
td.bad { color: var(--bad); font-weight: 700; }
.title { font-weight: 600; margin: 1.8rem 0 0.3rem; }
.note { color: var(--soft); font-size: 0.85rem; margin: 0.3rem 0 1rem; }
figure { margin: 1.3rem 0 1.6rem; }
figure .wide { background: #ffffff; }
img { display: block; width: 100%; min-width: 44rem; height: auto; }
figcaption { color: var(--soft); font-size: 0.85rem; max-width: 46rem; }
@media (max-width: 40rem) { main { padding: 1.5rem 0.9rem 3rem; } h1 { font-size: 1.55rem; }
  .prose th:first-child { min-width: 9rem; position: static; } th, td { padding: 0.32rem 0.5rem; } }
@media print { h2 { break-after: avoid; } figure, tr { break-inside: avoid; } main { max-width: none; } }
"""


def to_html(document: Document) -> str:
    """The document as one self-contained page."""
    blocks = list(document.anchored())
    links = [
        f'<li><a href="#{escape(anchor)}">{escape(block.text)}</a></li>'
        for block, anchor in blocks
        if isinstance(block, Heading) and block.level == 2
    ]
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{escape(document.title)}</title>",
            f"<style>{STYLE}</style>",
            "</head>",
            "<body>",
            "<main>",
            f"<h1>{escape(document.title)}</h1>",
            f'<nav aria-label="Contents"><ul>\n{chr(10).join(links)}\n</ul></nav>',
            *(_element(block, anchor) for block, anchor in blocks),
            "</main>",
            "</body>",
            "</html>",
            "",
        ]
    )


def _element(block: Block, anchor: str) -> str:
    match block:
        case Heading():
            return f'<h{block.level} id="{escape(anchor)}">{escape(block.text)}</h{block.level}>'
        case Paragraph():
            return f"<p>{_sentence(block)}</p>"
        case Bullets():
            return "<ul>\n" + "\n".join(f"<li>{_sentence(item)}</li>" for item in block.items) + "\n</ul>"
        case Picture():
            return _figure(block)
        case Table():
            return _table(block)


def _sentence(paragraph: Paragraph) -> str:
    lead = f"<strong>{escape(paragraph.lead)}</strong> " if paragraph.lead else ""
    return lead + escape(paragraph.text)


def _figure(picture: Picture) -> str:
    width, height = picture.size
    caption, data = escape(picture.caption), b64encode(picture.data).decode("ascii")
    return (
        f'<figure><div class="wide" tabindex="0"><img alt="{caption}" width="{width}" height="{height}" '
        f'src="data:image/png;base64,{data}"></div>\n<figcaption>{caption}</figcaption></figure>'
    )


def _table(table: Table) -> str:
    firsts = {k for k, group in enumerate(table.groups) if k and group != table.groups[k - 1]}
    body = [
        "<tr>"
        + "".join(_cell(cell, k, table.marks.get((i, k), ""), k in firsts) for k, cell in enumerate(row))
        + "</tr>"
        for i, row in enumerate(table.rows)
    ]
    heads = "".join(
        f'<th scope="col"{_classes("first" if k in firsts else "")}>{escape(column)}</th>'
        for k, column in enumerate(table.columns)
    )
    parts = [f'<p class="title">{escape(table.title)}</p>'] if table.title else []
    parts += [
        f'<div class="wide" tabindex="0"><table{_classes("prose" if table.prose else "")}>',
        f"<thead>{_group_row(table)}<tr>{heads}</tr></thead>",
        "<tbody>",
        *body,
        "</tbody></table></div>",
    ]
    if table.note:
        parts.append(f'<p class="note">{escape(table.note)}</p>')
    return "\n".join(parts)


def _group_row(table: Table) -> str:
    """A row of heads over several columns, where there are groups."""
    if not any(table.groups):
        return ""
    cells: list[str] = []
    for group, columns in groupby(enumerate(table.groups), key=lambda item: (item[0] > 0, item[1])):
        span = len(list(columns))
        name = _classes("group" if cells else "")
        cells.append(f'<th colspan="{span}"{name} scope="colgroup">{escape(group[1])}</th>')
    return f"<tr>{''.join(cells)}</tr>"


def _cell(text: str, column: int, mark: str, first: bool) -> str:
    if column == 0:
        return f'<th scope="row">{escape(text)}</th>'
    return f"<td{_classes(mark, 'first' if first else '')}>{escape(text)}</td>"


def _classes(*names: str) -> str:
    """The class attribute, if there is any class."""
    text = " ".join(name for name in names if name)
    return f' class="{text}"' if text else ""
