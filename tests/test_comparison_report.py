"""The report of a comparison says its numbers and nothing else, in two formats, whatever clips are called."""

from __future__ import annotations

import re
from dataclasses import fields, replace
from html.parser import HTMLParser
from io import BytesIO
from math import isnan, nan

import numpy as np
import pytest
from matplotlib.image import imread
from scipy import stats

from sixpoint.body.figure import Figure
from sixpoint.errors import FormatError
from sixpoint.jobs.compare.report import build_document, write_report
from sixpoint.samples import make_sample
from sixpoint.study.comparison import averages, measures, tables
from sixpoint.study.comparison.curves import draw_errors, encode, find_turns, has_window
from sixpoint.study.comparison.model import Claim, ClipRuns, Comparison, Reference, Row, Run
from sixpoint.study.comparison.poses import draw_poses
from sixpoint.study.comparison.summary import describe_clip, summarise
from sixpoint.study.comparison.trade import draw_trade, find_marks
from sixpoint.study.document import (
    BEST,
    NEXT,
    Bullets,
    Document,
    Heading,
    Paragraph,
    Picture,
    Table,
    to_markdown,
)
from sixpoint.study.document_html import to_html

FIGURE = Figure.from_stature(1.75)
MOTION = make_sample("walk", FIGURE)
METHODS = ("kma", "ccd", "jt", "sik", "pik")
NASTY = 'a|b <script>alert("$x_1$")</script> *c* `d` [e](http://f.g) &amp;'
REASON = "ValueError: bad | <b>pivot</b>\nin row 3"


def make_row(clip, method, seed, **changes):
    """A row whose numbers are all different."""
    rng = np.random.default_rng(seed)
    numbers = {f.name: float(rng.uniform(0.01, 0.9)) for f in fields(Row) if f.type == "float"}
    truth = np.random.default_rng(sum(map(ord, clip)))
    numbers |= {name: float(truth.uniform(0.01, 0.9)) for name in sorted(numbers) if "truth" in name}
    return replace(Row(clip, method, 30, 60.0), **numbers | {"rate": 60.0} | changes)


def make_clip(name, methods, frames=30):
    """What is drawn of a clip, with curves that differ from method to method."""
    runs = {
        method: Run(
            0.02 + 0.01 * k + 0.01 * np.sin(np.arange(frames) / 5.0 + k),
            0.2 + 0.05 * k + 0.1 * np.cos(np.arange(frames) / 7.0),
            MOTION.sliced(slice(10 + 5 * k, 11 + 5 * k)),
        )
        for k, method in enumerate(methods)
    }
    turning = np.where(np.arange(frames) // 10 == 1, -2.5, 0.3)
    window = (5, 25) if frames > 25 else (0, frames)
    return ClipRuns(name, FIGURE, 60.0, turning, frames // 2, window, MOTION.sliced(slice(12, 13)), runs)


def make_comparison():
    """Two clips of a reference and one more; jt fails on the second, and the reference has no jt."""
    rows, clips = [], []
    for c, clip in enumerate(("one", "two", "extra")):
        lost = clip == "two"
        for m, method in enumerate(METHODS):
            if method == "jt" and lost:
                rows.append(Row(clip, method, 30, 60.0, error=REASON, failed_frames=30))
            else:
                options = "limits=True weights=1,1,0" if method == "sik" else ""
                rows.append(make_row(clip, method, 100 * c + m, options=options))
        clips.append(make_clip(clip, [m for m in METHODS if m != "jt" or not lost]))
    known = [m for m in METHODS if m != "jt"]
    rng = np.random.default_rng(7)
    published = [
        {clip: {m: float(rng.uniform(0.1, 0.5)) for m in known} for clip in ("one", "two")} for _ in range(3)
    ]
    for table in published:
        table["average"] = {m: (table["one"][m] + table["two"][m]) / 2 for m in known}
    published[0]["average"]["pik"] += 0.01  # a misprint
    return Comparison(
        "Some methods",
        METHODS,
        tuple(rows),
        tuple(clips),
        Reference("Somebody 1999", *published),
        claims=(Claim("A is better.", "0.1 to 0.2", True), Claim("B is faster.", "3 to 2", False)),
        presets={"sik": "limits on", "kma": "20 iterations"},
        facts=(("machine", "a slow one"),),
        limitations=("Nothing is perfect.",),
        notes=("1. is a number, - is a dash.",),
    )


@pytest.fixture(scope="module")
def comparison():
    """The comparison of most tests."""
    return make_comparison()


@pytest.fixture(scope="module")
def folder(tmp_path_factory, comparison):
    """Its report."""
    place = tmp_path_factory.mktemp("report") / "a" / "b"
    write_report(comparison, place)
    return place


class Page(HTMLParser):
    """Tables as rows of cells, ids, links and images of a page; says whether every tag is closed."""

    VOID = ("meta", "img", "br", "hr")

    def __init__(self, text):
        super().__init__()
        self.tables, self.ids, self.links, self.images, self.tags, self.open = [], [], [], [], set(), []
        self.feed(text)
        self.close()

    def handle_startendtag(self, tag, attrs):
        """As in XHTML, which closes images itself."""
        self.handle_starttag(tag, attrs)

    def handle_starttag(self, tag, attrs):
        """Remember what is opened, and what it names."""
        self.tags.add(tag)
        values = dict(attrs)
        self.ids += [values["id"]] if "id" in values else []
        self.links += [values["href"]] if "href" in values else []
        self.images += [values["src"]] if "src" in values else []
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag):
        """Every tag closes the last one."""
        assert self.open.pop() == tag

    def handle_data(self, data):
        """Text of cells."""
        if {"td", "th"} & set(self.open):
            self.tables[-1][-1][-1] += data


def assert_same_tables(page, other):
    """The rows below the heads are the same, and the last row of heads but for the groups in front."""
    assert len(page.tables) == len(other.tables)
    for ours, theirs in zip(page.tables, other.tables, strict=True):
        rows = [[" ".join(cell.split()) for cell in row] for row in ours[-len(theirs) :]]
        assert rows[1:] == theirs[1:]
        assert all(long.endswith(short) for short, long in zip(rows[0], theirs[0], strict=True))


def column(table, group, head):
    """The cells under a head, by method."""
    keys = list(zip(table.groups or [""] * len(table.columns), table.columns, strict=True))
    k = keys.index((group, head))
    return {row[0]: row[k] for row in table.rows}


@pytest.mark.parametrize(("quantity", "unit"), [("position", ""), ("orientation", " [rad]")])
def test_table_one_shows_rows_and_the_reference(comparison, quantity, unit):
    """Every cell of a clip is its row's number, or the published one."""
    table = tables.error_table(comparison, quantity)
    for clip in ("one", "two", "extra"):
        ours = column(table, clip, "ours" + unit)
        for method in METHODS:
            row = comparison.row(clip, method)
            assert ours[method] == ("failed" if row.error else f"{getattr(row, quantity):.4f}")
        if clip == "extra":
            assert (clip, "reference" + unit) not in zip(table.groups, table.columns, strict=True)
            continue
        theirs = column(table, clip, "reference" + unit)
        published = getattr(comparison.reference, quantity)[clip]
        assert theirs == {m: f"{published[m]:.4f}" if m in published else "–" for m in METHODS}


@pytest.mark.parametrize(("quantity", "unit"), [("position", ""), ("orientation", " [rad]")])
def test_averages_are_over_the_clips_of_the_reference(comparison, quantity, unit):
    """Plain means over the clips the reference averages, beside its printed average, with their ratio."""
    table = tables.error_table(comparison, quantity)
    ours = column(table, "average", "ours" + unit)
    theirs = column(table, "average", "reference" + unit)
    ratios = column(table, "average", "ours / reference")
    for method in METHODS:
        if method == "jt":
            assert (ours[method], theirs[method], ratios[method]) == ("1 of 2 clips", "–", "–")
            continue
        mean = sum(getattr(comparison.row(clip, method), quantity) for clip in ("one", "two")) / 2
        printed = getattr(comparison.reference, quantity)["average"][method]
        assert ours[method] == f"{mean:.4f}"
        assert theirs[method] == f"{printed:.4f}"
        assert ratios[method] == f"{mean / printed:.2f}"
    assert ("pik (" in table.note) == (quantity == "position"), "only that average is misprinted"


def test_the_best_three_are_marked(comparison):
    """The smallest number of a column is best, the next two follow; equal ones share their mark."""
    table = tables.error_table(comparison, "position")
    k = table.columns.index("reference")
    order = sorted((float(row[k]), i) for i, row in enumerate(table.rows) if row[k] != "–")
    assert [table.marks.get((i, k)) for _, i in order] == [BEST, NEXT, NEXT, None]
    ranked = {key for group, key in zip(table.groups, range(99), strict=False) if group}
    assert {key for _, key in table.marks} == ranked - {table.columns.index("ours / reference")}
    rows = tuple(replace(row, position=0.03) for row in comparison.rows if row.clip == "one")
    same = tables.error_table(replace(comparison, rows=rows, clips=comparison.clips[:1]), "position")
    assert {same.marks[i, 1] for i in range(len(METHODS))} == {BEST}


QUALITY = {
    ("targets", "mean miss [mm]"): lambda r: f"{1000 * r.residual_mean:.2f}",
    ("targets", "p95 [mm]"): lambda r: f"{1000 * r.residual_p95:.1f}",
    ("targets", "worst [mm]"): lambda r: f"{1000 * r.residual_max:.1f}",
    ("targets", "frames > 1 cm [%]"): lambda r: f"{100 * r.missed:.1f}",
    ("limits", "frames outside [%]"): lambda r: f"{100 * r.limit_frames:.1f}",
    ("limits", "worst excess [°]"): lambda r: f"{np.degrees(r.limit_worst):.2f}",
    ("motion", "jerk / truth"): lambda r: f"{r.jerk_ratio:.2f}",
    ("motion", "foot skate [mm/frame]"): lambda r: f"{1000 * r.skate:.2f}",
    ("motion", "swivel jumps"): lambda r: f"{r.swivel_jumps:.0f}",
    ("posture", "clavicles [°]"): lambda r: f"{np.degrees(r.clavicle):.1f}",
    ("posture", "upper trunk [%]"): lambda r: f"{100 * r.bend_top:.0f}",
    ("failed", "frames"): lambda r: f"{r.failed_frames}",
}
READINGS = {
    ("position", "RMS, E_p"): lambda r: f"{r.position:.4f}",
    ("position", "mean"): lambda r: f"{r.position_mean:.4f}",
    ("position", "p95"): lambda r: f"{r.position_p95:.4f}",
    ("position", "pooled"): lambda r: f"{r.position_pooled:.4f}",
    ("orientation", "RMS, E_o [rad]"): lambda r: f"{r.orientation:.4f}",
    ("orientation", "mean [rad]"): lambda r: f"{r.orientation_mean:.4f}",
    ("orientation", "p95 [rad]"): lambda r: f"{r.orientation_p95:.4f}",
}
TIMES = {
    ("whole clip", "best round [µs/frame]"): lambda r: f"{r.batch_us:.1f}",
    ("single calls", "median [µs]"): lambda r: f"{r.median_us:.1f}",
    ("single calls", "p99 [µs]"): lambda r: f"{r.p99_us:.1f}",
}


@pytest.mark.parametrize(
    ("make", "cells"),
    [(measures.quality_table, QUALITY), (measures.reading_table, READINGS), (measures.time_table, TIMES)],
)
def test_tables_of_a_clip_show_its_rows(comparison, make, cells):
    """Each measure is the row's number in the printed unit; a run that failed has none."""
    for clip in ("one", "two"):
        table = make(comparison, clip)
        shown = {key: column(table, *key) for key in cells}
        for method in METHODS:
            row = comparison.row(clip, method)
            for key, text in cells.items():
                if not row.error or key == ("failed", "frames"):
                    assert shown[key][method] == text(row), key
        if clip == "two":
            failed = next(row for row in table.rows if row[0] == "jt")
            assert failed[1] == "failed"
            assert set(failed[2:]) <= {"–", "30"}


def test_quality_over_clips(comparison):
    """Means over the clips, but the worst of the worst and the sum of failures."""
    table = measures.quality_table(comparison)
    rows = [comparison.row(clip, "ccd") for clip in ("one", "two")]
    mean = 1000 * (rows[0].residual_mean + rows[1].residual_mean) / 2
    assert column(table, "targets", "mean miss [mm]")["ccd"] == f"{mean:.2f}"
    worst = 1000 * max(row.residual_max for row in rows)
    assert column(table, "targets", "worst [mm]")["ccd"] == f"{worst:.1f}"
    worst = np.degrees(max(row.limit_worst for row in rows))
    assert column(table, "limits", "worst excess [°]")["ccd"] == f"{worst:.2f}"
    truth = 1000 * (rows[0].skate_truth + rows[1].skate_truth) / 2
    assert column(table, "motion", "foot skate [mm/frame]")["truth"] == f"{truth:.2f}"
    assert column(table, "failed", "frames")["jt"] == "30"
    assert column(table, "targets", "mean miss [mm]")["jt"] == "1 of 2 clips"


def test_the_truth_has_a_row(comparison):
    """What the true motion does stands first, once, beside what the methods do."""
    row = comparison.row("one", "kma")
    table = measures.quality_table(comparison, "one")
    assert table.rows[0][0] == "truth"
    assert column(table, "motion", "foot skate [mm/frame]")["truth"] == f"{1000 * row.skate_truth:.2f}"
    assert column(table, "motion", "swivel jumps")["truth"] == f"{row.swivel_jumps_truth:.0f}"
    assert column(table, "posture", "clavicles [°]")["truth"] == f"{np.degrees(row.clavicle_truth):.1f}"
    assert column(table, "posture", "upper trunk [%]")["truth"] == f"{100 * row.bend_top_truth:.0f}"
    assert column(table, "motion", "jerk / truth")["truth"] == "1.00"


def test_times_are_ratios_to_the_baseline_on_both_sides(comparison):
    """Ours over ours of sik, the published over the published of sik."""
    for clip in (None, "one"):
        table = measures.time_table(comparison, clip)
        ours = column(table, "time / sik", "ours")
        theirs = column(table, "time / sik", "reference")
        names = ("one", "two") if clip is None else (clip,)
        for method in ("kma", "ccd", "pik", "sik"):
            mine, base = (
                sum(comparison.row(n, m).batch_us for n in names) / len(names) for m in (method, "sik")
            )
            printed = comparison.reference.milliseconds["average" if clip is None else clip]
            assert ours[method] == f"{mine / base:.2f}"
            assert theirs[method] == f"{printed[method] / printed['sik']:.2f}"
            assert column(table, "reference", "median [ms]")[method] == f"{printed[method]:.2f}"


def test_a_part_is_compared_with_the_same_part(comparison):
    """With one of the reference's clips the printed average of all is not beside ours."""
    rows = tuple(row for row in comparison.rows if row.clip != "two")
    part = replace(comparison, rows=rows, clips=(comparison.clips[0], comparison.clips[2]))
    printed = comparison.reference.position["one"]["sik"]
    assert averages.averaged_clips(part) == ("one",)
    assert averages.published_average(part, "position", "sik") == printed
    assert averages.average(part, "sik", "position") == comparison.row("one", "sik").position


@pytest.mark.parametrize("ours", [(1, 2, 3, 4, 5), (5, 4, 3, 2, 1), (2, 1, 4, 3, 5), (1, 1, 2, 2, 3)])
def test_rank_correlation(ours):
    """Spearman's coefficient is SciPy's, and Pearson's of the ranks."""
    theirs = (0.3, 0.1, 0.5, 0.4, 0.9)
    rows = tuple(
        make_row("one", m, k, position=0.01 * value)
        for k, (m, value) in enumerate(zip(METHODS, ours, strict=True))
    )
    published = {"one": dict(zip(METHODS, theirs, strict=True))}
    tested = Comparison("t", METHODS, rows, (), Reference("r", published, {}, {}))
    found = averages.correlate(tested, "position")
    assert found.methods == METHODS
    assert found.value == pytest.approx(stats.spearmanr(ours, theirs).statistic)
    ranks = np.corrcoef(stats.rankdata(ours), stats.rankdata(theirs))
    assert found.value == pytest.approx(ranks[0, 1])
    assert f"correlation of {found.value:.2f}" in " ".join(p.text for p in summarise(tested))
    assert isnan(averages.correlate(tested, "orientation").value), "nothing is published"


def test_failures_are_rows_with_their_reason(comparison, folder):
    """A run without a result is said in both formats with its reason, and is in no mean and no chart."""
    rows = (*comparison.rows[:1], replace(comparison.rows[1], failed_frames=3), *comparison.rows[2:])
    table = tables.failure_table(replace(comparison, rows=rows))
    assert ("two", "jt", "30", "30", REASON) in table.rows
    assert ("one", "ccd", "3", "30", tables.PARTLY) in table.rows
    assert len(table.rows) == 2
    page = Page((folder / "report.html").read_text("utf-8"))
    assert ["two", "jt", "30", "30", REASON] in [row for found in page.tables for row in found]
    assert "ValueError: bad \\| \\<b>pivot\\</b> in row 3" in (folder / "report.md").read_text("utf-8")
    assert isnan(averages.average(comparison, "jt", "position"))
    assert [mark.method for mark in find_marks(comparison)] == ["kma", "ccd", "sik", "pik"]
    assert "jt" not in averages.correlate(comparison, "position").methods
    assert "1 without a result (jt on two)" in summarise(comparison)[0].text


def test_a_clip_that_cannot_be_read_is_one_line(comparison):
    """All methods share its reason, where it is the same; nothing is said of frames it does not have."""
    lost = [Row("bad", method, 0, nan, error="no such file") for method in METHODS]
    part = replace(comparison, rows=(*comparison.rows, *lost))
    assert tables.failure_table(part).rows == (
        ("two", "jt", "30", "30", REASON),
        ("bad", "all methods", "–", "–", "no such file"),
    )
    other = replace(comparison, rows=(*lost[:-1], replace(lost[-1], error="too late")))
    assert [row[1] for row in tables.failure_table(other).rows] == list(METHODS)
    some = replace(comparison, rows=tuple(lost[:-1]))
    assert [row[1] for row in tables.failure_table(some).rows] == list(METHODS[:-1]), "one was not run"
    assert describe_clip(part, "bad", None).text == "The clip could not be read."
    assert describe_clip(part, "one", None).text.startswith("30 frames at 60 Hz. ")
    assert "nan" not in to_markdown(build_document(replace(part, clips=())))


@pytest.mark.parametrize(
    ("worst", "said"), [(0.0104, ""), (0.0106, "1.1 times as far off"), (0.02, "2.0 times as far off")]
)
def test_only_a_notable_ratio_is_said(worst, said):
    """The least accurate method is named from 1.05 times the best error on."""
    values = (0.01, 0.0101, 0.0102, 0.0103, worst)
    rows = tuple(
        make_row("one", m, k, position=value)
        for k, (m, value) in enumerate(zip(METHODS, values, strict=True))
    )
    text = {p.lead: p.text for p in summarise(Comparison("t", METHODS, rows, ()))}["Position error."]
    assert ("least accurate" in text) == bool(said)
    assert said in text


def test_a_best_error_of_zero_has_no_ratio():
    """A method that is exact does not break the summary."""
    rows = tuple(make_row("one", m, k, position=0.01 * k) for k, m in enumerate(METHODS))
    text = {p.lead: p.text for p in summarise(Comparison("t", METHODS, rows, ()))}["Position error."]
    assert "least accurate is pik (0.0400). " in text


def test_the_unit_of_positions_is_explained_once(comparison):
    """Errors are over H, the summed lengths of five segments, which is said where errors are defined."""
    text = to_markdown(build_document(replace(comparison, clips=())))
    assert "mean joint distance over H" in text
    assert "body height" not in text
    assert text.count("H is the summed length of the figure's calf, thigh, pelvis, torso and neck") == 1


def test_times_say_what_they_are_compared_with(comparison):
    """Ratios are to sik on the same clip, a resumed folder may mix runs; no column charges compilation."""
    table = measures.time_table(comparison)
    assert "to sik on the same clip; a folder that was resumed may mix runs" in table.note
    assert not any("warm" in head for head in table.columns)


def test_the_chart_shows_means_and_ratios(comparison):
    """Ours and the published place of a method are its mean error and its time over the baseline's."""
    mark = next(mark for mark in find_marks(comparison) if mark.method == "kma")
    mean = {
        (m, name): np.mean([getattr(comparison.row(clip, m), name) for clip in ("one", "two")])
        for m in ("kma", "sik")
        for name in ("position", "batch_us")
    }
    ratio = mean["kma", "batch_us"] / mean["sik", "batch_us"]
    assert mark.place == pytest.approx((ratio, mean["kma", "position"]))
    printed, errors = comparison.reference.milliseconds["average"], comparison.reference.position["average"]
    assert mark.published == pytest.approx((printed["kma"] / printed["sik"], errors["kma"]))


def test_an_interrupted_comparison_can_be_reported(comparison):
    """Runs that were not made are dashes, and counted."""
    rows = tuple(row for row in comparison.rows if (row.clip, row.method) != ("two", "pik"))
    runs = {m: run for m, run in comparison.clips[1].runs.items() if m != "pik"}
    part = replace(
        comparison, rows=rows, clips=(comparison.clips[0], replace(comparison.clips[1], runs=runs))
    )
    table = tables.error_table(part, "position")
    assert column(table, "two", "ours")["pik"] == "–"
    assert column(table, "average", "ours")["pik"] == "1 of 2 clips"
    assert "1 run of 15 not made" in summarise(part)[0].text
    assert averages.explain_missing(part, "two", "pik") == "not run"


def test_summary_names_the_best_and_compares(comparison):
    """The sentences name the smallest averages, the fastest and slowest, and the ratios to the reference."""
    means = {
        m: np.mean([comparison.row(clip, m).position for clip in ("one", "two")])
        for m in METHODS
        if m != "jt"
    }
    best, worst = min(means, key=means.get), max(means, key=means.get)
    said = {p.lead: p.text for p in summarise(comparison)}
    assert said["Position error."].startswith(f"{best} ({means[best]:.4f}) is the most accurate")
    assert f"least accurate is {worst} ({means[worst]:.4f})" in said["Position error."]
    ratios = {m: means[m] / comparison.reference.position["average"][m] for m in means}
    beside = said["Position error beside Somebody 1999:"]
    assert (
        f"{min(ratios.values()):.2f} ({min(ratios, key=ratios.get)}) to {max(ratios.values()):.2f}" in beside
    )
    assert said["Statements."] == "1 of 2 tested statements hold."
    assert f"Spearman correlation of {averages.correlate(comparison, 'position').value:.2f}" in beside


def test_the_page_needs_nothing_else(folder):
    """One file: no script, no outside request; every picture inside; every link has its target."""
    text = (folder / "report.html").read_text("utf-8")
    page = Page(text)
    assert page.open == []
    assert not page.tags & {"script", "link", "iframe", "object"}
    assert not re.search(r"https?:|url\(|@import", re.sub(r'"data:[^"]*"', "", text))
    assert len(page.images) == 1 + 3 * 3
    assert all(image.startswith("data:image/png;base64,") for image in page.images)
    assert len(set(page.ids)) == len(page.ids)
    assert [link[1:] for link in page.links] == page.ids
    assert len(page.ids) > 8


def test_both_formats_have_the_same_tables_and_pictures(folder, comparison):
    """What an independent parser makes of the Markdown are the tables of the page."""
    markdown = pytest.importorskip("markdown_it").MarkdownIt("commonmark").enable("table")
    text = (folder / "report.md").read_text("utf-8")
    page, other = Page((folder / "report.html").read_text("utf-8")), Page(markdown.render(text))
    assert len(page.tables) > 12
    assert_same_tables(page, other)
    assert [link[1:] for link in other.links] == page.ids
    assert sorted(other.images) == sorted(f"pictures/{p.name}" for p in (folder / "pictures").iterdir())
    for name in other.images:
        assert imread(folder / name).shape[1] == 1600
    assert len({p.read_bytes() for p in (folder / "pictures").iterdir()}) == len(other.images)


def test_nothing_a_clip_is_called_changes_the_page(comparison):
    """Markup, pipes, mathematics in names are shown as they are, in pictures too."""
    rows = tuple(replace(row, clip=NASTY) for row in comparison.rows if row.clip == "two")
    clips = (replace(comparison.clips[1], name=NASTY),)
    document = build_document(replace(comparison, rows=rows, clips=clips, title=NASTY))
    page = Page(to_html(document))
    assert "script" not in page.tags
    assert any(NASTY in row for table in page.tables for row in table)
    markdown = pytest.importorskip("markdown_it").MarkdownIt("commonmark").enable("table")
    other = Page(markdown.render(to_markdown(document)))
    assert "script" not in other.tags
    assert not [link for link in other.links if not link.startswith("#")]
    assert_same_tables(page, other)
    assert any(f"{NASTY}: ours" in row for table in other.tables for row in table)


def test_plain_text_stays_plain_in_markdown():
    """Lists, headings, emphasis and entities in a text are not made by it."""
    texts = ("1. first", "- dash", "# head", "> quote", "a_b _c_ *d* ~~e~~ &lt; <i> | $f$ [x]: y", "[ ] box")
    blocks = (*map(Paragraph, texts), Bullets(tuple(map(Paragraph, texts))))
    markdown = pytest.importorskip("markdown_it").MarkdownIt("commonmark").enable(["table", "strikethrough"])

    class Words(HTMLParser):
        found, tags = "", frozenset()

        def handle_data(self, data):
            self.found += data

        def handle_starttag(self, tag, attrs):
            self.tags |= {tag}

    words = Words()
    words.feed(markdown.render(to_markdown(Document("t", blocks))))
    assert words.tags == {"h1", "p", "ul", "li"}
    assert [line for line in words.found.split("\n") if line] == ["t", *texts, *texts]


def test_same_anchor_twice():
    """Headings of one text have different anchors, and the contents lead to them."""
    document = Document("t", (Heading("A b!"), Heading("A b"), Heading("A b-1"), Heading("!")))
    page = Page(to_html(document))
    assert page.ids == ["a-b", "a-b-1", "a-b-1-1", "section"]
    assert "[A b](#a-b-1)" in to_markdown(document)


def test_a_table_has_as_many_cells_as_columns():
    """A row that does not fit is refused."""
    with pytest.raises(ValueError, match="2 cells under 1 columns"):
        Table("t", ("a",), (("1", "2"),))


def test_reports_are_the_same_twice(tmp_path, comparison):
    """The report is a function of the comparison: the same bytes every time, an older one is replaced."""
    clip = replace(comparison.clips[0], window=(0, 30))
    tested = replace(comparison, clips=(clip,), methods=("sik", "jt"))
    once, again = tmp_path / "once", tmp_path / "again"
    again.mkdir()
    (again / "report.md").write_text("old")
    files = [write_report(tested, place) for place in (once, again)]
    assert files[0][:2] == [once / "report.html", once / "report.md"]
    assert len(files[0]) == 5
    for first, second in zip(*files, strict=True):
        assert first.read_bytes() == second.read_bytes()
    assert sorted(p.name for p in again.iterdir()) == ["pictures", "report.html", "report.md", "runs"]


def test_pictures_of_the_report_before_are_deleted(comparison, tmp_path):
    """Only those that a report of ours wrote there, and none that the list names elsewhere."""
    write_report(replace(comparison, methods=("sik",), clips=comparison.clips[:2]), tmp_path)
    place, listed = tmp_path / "pictures", tmp_path / "runs" / "pictures.txt"
    first = {path.name for path in place.iterdir()}
    assert {*listed.read_text().split()} == first
    kept = [place / "mine.png", tmp_path / "other.png", place / "Note.txt"]
    for path in kept:
        path.write_text("mine")
    (place / "folder.png").mkdir()
    with listed.open("a") as stream:
        stream.write("../other.png\nNote.txt\n..\nfolder.png\ngone.png\n")
    files = write_report(replace(comparison, methods=("sik",), clips=comparison.clips[1:2]), tmp_path)
    second = {path.name for path in files if path.suffix == ".png"}
    assert any(name.startswith("one-") for name in first - second)
    assert {path.name for path in place.iterdir()} == second | {"mine.png", "Note.txt", "folder.png"}
    assert all(path.read_text() == "mine" for path in kept)
    assert {*listed.read_text().split()} == second | {"folder.png"}


def test_without_a_list_nothing_is_deleted(comparison, tmp_path):
    """Pictures in the folder are of the user until a report of ours says otherwise."""
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "one-errors.png").write_text("mine")
    write_report(Comparison("c", (), (), ()), tmp_path)
    assert (tmp_path / "pictures" / "one-errors.png").read_text() == "mine"


def test_one_frame_one_clip_no_reference(tmp_path):
    """A single pose, methods without a row, no reference, no claims, hardly a number: there is a report."""
    row = Row("pose", "ccd", 1, 60.0, position=0.02, orientation=0.3)
    clip = make_clip("pose", ["ccd"], frames=1)
    tested = Comparison("One", ("sik", "ccd"), (row,), (clip,))
    said = []
    files = write_report(tested, tmp_path, lambda *report: said.append(report[1:]))
    assert [path.name for path in files] == ["report.html", "report.md", "pose-errors.png", "pose-poses.png"]
    text = (tmp_path / "report.md").read_text("utf-8")
    assert "nan" not in text
    assert "reference" not in text
    assert "| ccd | **0.0200** |" in text
    assert said[0] == (0, 3)
    assert said[-1] == (3, 3)
    assert said == sorted(said)
    assert not has_window(clip)
    assert draw_trade(tested) is None


def test_clips_without_a_name_of_their_own(comparison, tmp_path):
    """Clips whose names give the same file name do not share pictures."""
    names = ("a b", "a-b", "!")
    rows = tuple(make_row(name, "sik", k) for k, name in enumerate(names))
    clips = tuple(make_clip(name, ["sik"], frames=1) for name in names)
    files = write_report(Comparison("c", ("sik",), rows, clips), tmp_path)
    found = [path.name for path in files if path.name.endswith("-poses.png")]
    assert found == ["a-b-poses.png", "a-b-2-poses.png", "clip-poses.png"]


def test_nothing_is_replaced_before_all_is_drawn(comparison, tmp_path, monkeypatch):
    """If drawing breaks, the old report stays as it was."""
    (tmp_path / "report.html").write_text("old")

    def broken(*args, **kwargs):
        raise RuntimeError("no ink")

    monkeypatch.setattr("sixpoint.study.comparison.poses._draw_cell", broken)
    with pytest.raises(RuntimeError, match="no ink"):
        write_report(comparison, tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    assert (tmp_path / "report.html").read_text() == "old"


def test_a_file_in_the_way_is_said(comparison, tmp_path):
    """A folder that is a file is an error that names it."""
    place = tmp_path / "report"
    place.write_text("mine")
    with pytest.raises(FormatError, match="the folder cannot be made"):
        write_report(Comparison("c", (), (), ()), place)
    assert place.read_text() == "mine"


def test_pictures_are_of_sensible_size(comparison):
    """PNGs 1600 pixels wide; panels and rows of bodies make them higher; failures are drawn too."""
    clip = comparison.clips[1]
    missing = {"jt": REASON}
    all_of_them = imread(BytesIO(encode(draw_errors(clip, METHODS, missing, "sik"))))
    few = imread(BytesIO(encode(draw_errors(clip, METHODS[:2], missing, "sik", clip.window))))
    png = encode(draw_poses(clip, METHODS, missing))
    poses = imread(BytesIO(png))
    one_row = imread(BytesIO(encode(draw_poses(clip, METHODS[:3], missing))))
    assert {image.shape[1] for image in (all_of_them, few, poses, one_row)} == {1600}
    assert all_of_them.shape[0] - few.shape[0] == pytest.approx(3 * 0.68 * 150, abs=2)
    assert 500 < one_row.shape[0] < 1100
    assert 500 < poses.shape[0] < 2400
    assert Picture("p.png", png, "c").size == (1600, poses.shape[0])


def test_a_body_is_drawn_where_there_is_one(comparison):
    """A method without a result leaves only the grey truth in its cell."""
    clip = comparison.clips[1]
    with_it = imread(BytesIO(encode(draw_poses(clip, ("sik",), {}))))
    without = imread(BytesIO(encode(draw_poses(replace(clip, runs={}), ("sik",), {"sik": "why"}))))

    def coloured(image):
        return int((np.ptp(image[150:-90, 800:, :3], axis=-1) > 0.2).sum())

    assert coloured(with_it) > 5000
    assert coloured(without) == 0


def test_turns_are_faster_than_two_radians_a_second():
    """The direction does not matter; an unknown speed is no turn."""
    clip = replace(make_clip("c", []), turning=np.array([0.0, 1.9, 2.1, -2.1, nan]))
    assert find_turns(clip).tolist() == [False, False, True, True, False]
