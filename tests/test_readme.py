"""What the README shows is run: every Python block, every command."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

import sixpoint as sp
from gltf_avatars import make_avatar
from marker_bodies import walking_markers
from sixpoint.cli import main
from sixpoint.formats import save_markers

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_python_blocks_run(tmp_path, monkeypatch, capsys):
    """The Python of the README runs as it stands, in order."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    assert len(blocks("python")) >= 2
    for block in blocks("python"):
        exec(compile(block, "README.md", "exec"), names)
    assert (tmp_path / "boxing_result.bvh").exists()
    first, mounts, last = capsys.readouterr().out.splitlines()
    assert 0.01 < float(first) < 0.03
    assert "'l_ankle': 0.00" in mounts and mounts.endswith("{}")
    assert "r_wrist" in last


def test_python_of_the_docs_runs(capsys):
    """The examples of docs/prioritized.md run as they stand, and reach what they ask for."""
    text = (ROOT / "docs" / "prioritized.md").read_text("utf-8")
    names: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "prioritized.md", "exec"), names)
    assert capsys.readouterr().out.count("CONVERGED") == 2


@pytest.mark.parametrize("name", ["render", "retargeting", "track", "markers"])
def test_python_of_other_docs_runs(name, tmp_path, monkeypatch):
    """The Python of a page runs as it stands, in order, with files of the names it uses."""
    monkeypatch.chdir(tmp_path)
    figure = sp.Figure.from_stature(1.75)
    sp.save_targets(figure.targets(sp.make_sample("walk", figure).sliced(slice(0, 30))), "points.csv")
    save_markers(walking_markers(30), Path("gait.c3d"))
    names: dict[str, object] = {}
    text = (ROOT / "docs" / f"{name}.md").read_text("utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert blocks
    for block in blocks:
        exec(compile(block, f"{name}.md", "exec"), names)


COMMANDS = [
    line.split("#")[0].strip()
    for block in blocks("")
    for line in block.splitlines()
    if line.startswith("sixpoint ")
    and not any(w in line for w in ("demo", "data cmu", "sixpoint view"))  # network, pages
]


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_run(command, tmp_path, monkeypatch, capsys):
    """The commands of the README succeed with files of the names they use."""
    monkeypatch.chdir(tmp_path)
    figure = sp.Figure.from_stature(1.75)
    motion = sp.make_sample("walk", figure).sliced(slice(0, 40))
    sp.save(motion, "walk.bvh")
    sp.save(motion, "kick.bvh")
    sp.save(motion, "take.amc")
    sp.save(motion, "17_10.amc")
    sp.save_targets(figure.targets(motion), "points.csv")
    if "convert" not in command:
        sp.save(motion, "take.bvh")
    Path("library").mkdir()
    sp.save(motion, "library/walk.bvh")
    Path("hero.vrm").write_bytes(make_avatar("vrm1"))
    sp.save_markers(walking_markers(), "gait.c3d")
    words = shlex.split(command)[1:]
    if words[0] == "render":
        words += ["--size", "80x96", "--fps", "5"]
    if words[0] == "live":
        words += ["--duration", "0.2"]  # it runs until it is stopped
        words[words.index("--vmc-in") + 1] = "0"  # a free port
    with pytest.raises(SystemExit) as exit_:
        raise SystemExit(main(words))
    assert not exit_.value.code


def test_links_lead_somewhere():
    """Every relative link of the README and the docs names a file that exists."""
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", page.read_text("utf-8")):
            if not target.startswith("http"):
                assert (page.parent / target).exists(), f"{page.name}: {target}"
