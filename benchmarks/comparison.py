"""Compare all methods on the clips of the paper and bring the tables into docs/results.md.

    python benchmarks/comparison.py [--data FOLDER]

Pictures go to docs/comparison. The same comparison with all its pictures as a page of its own:
``sixpoint compare --study paper --data FOLDER``.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
from pathlib import Path

from marked import rewrite
from rich.progress import Progress

from sixpoint.jobs.compare.job import compare
from sixpoint.jobs.compare.study import find_study, read_study

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
RESULTS = ROOT / "docs" / "results.md"
PICTURES = ROOT / "docs" / "comparison"
SHOWN = ("error-against-time.png", "boxing-window.png", "boxing-poses.png", "jump-kick-poses.png")
SECTIONS = {
    "comparison": ("Accuracy", "Time", "Quality", "Statements tested"),
    "damping": ("Accuracy", "Quality"),
}


def sections(report: Path) -> dict[str, str]:
    """Second-level headings of a Markdown report -> their text."""
    parts = re.split(r"^## (.+)$", report.read_text("utf-8"), flags=re.MULTILINE)
    return dict(zip(parts[1::2], (part.strip() for part in parts[2::2]), strict=True))


def run(study: str, data: Path, out: Path) -> str:
    """Run a study that ships; returns the chosen sections of its report."""
    with Progress(transient=True) as bar:
        task = bar.add_task(study)

        def report(what: str, done: int, total: int) -> None:
            if what == "comparing":
                bar.update(task, completed=done, total=total)

        compare(read_study(find_study(study), data), out, progress=report)
    found = sections(out / "report.md")
    text = "\n\n".join(
        f"**{title}**\n\n{found[title]}" for title in SECTIONS[study.replace("paper", "comparison")]
    )
    text = re.sub(
        r"\n*!\[[^\]]*\]\([^)]*\)\n*", "\n\n", text
    )  # pictures are shown where the text speaks of them
    return re.sub(r"^(\*\*Over all clips\*\*|\*[^*\n]+\*)\n+", "", text, flags=re.MULTILINE)


def main() -> None:
    """Write the tables and copy the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    data = parser.parse_args().data
    with tempfile.TemporaryDirectory() as folder:
        parts = {}
        for study in ("paper", "damping"):
            mark = study.replace("paper", "comparison")
            parts[mark] = run(study, data, Path(folder) / study)
        PICTURES.mkdir(exist_ok=True)
        for name in SHOWN:
            shutil.copyfile(Path(folder) / "paper" / "pictures" / name, PICTURES / name)
    rewrite(RESULTS, parts)
    print(f"written: {RESULTS}, {PICTURES}")


if __name__ == "__main__":
    main()
