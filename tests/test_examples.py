"""The examples run, write their files, and their claims hold; measured here once more, on the files alone."""

import csv
import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import sixpoint as sp

FILE = Path(__file__).resolve().parents[1] / "examples" / "shelf_reach.py"


@pytest.fixture(scope="module")
def example():
    """The example as a module."""
    spec = importlib.util.spec_from_file_location("shelf_reach", FILE)
    module = importlib.util.module_from_spec(spec)
    sys.modules["shelf_reach"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["shelf_reach"]


@pytest.fixture(scope="module")
def folder(example, tmp_path_factory):
    """What the example writes."""
    folder = tmp_path_factory.mktemp("shelf") / "out"
    example.run(folder)
    return folder


@pytest.fixture(scope="module")
def table(folder):
    """(person, item, task) -> (residual, gave way to), from the CSV."""
    with (folder / "report.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream))
    return {(r[0].split(",")[0], r[1], r[2]): (float(r[3]), r[4]) for r in rows[1:]}


def box_distance(points, low, high):
    """Distance of points to an upright box [m], negative inside; written unlike that of the example."""
    outside = np.linalg.norm(points - np.clip(points, low, high), axis=-1)
    depth = np.minimum(points - low, high - points).min(axis=-1)
    return np.where(depth > 0, -depth, outside)


def test_it_writes_all_files_and_overwrites_none(example, folder):
    """Motions, pictures of reasonable size, a report that shows them; a second run is refused."""
    names = {f"{key}{end}" for key in example.PEOPLE for end in (".bvh", ".png")} | {
        "report.md",
        "report.csv",
    }
    assert {path.name for path in folder.iterdir()} == names
    page = (folder / "report.md").read_text("utf-8")
    for key in example.PEOPLE:
        assert (folder / f"{key}.png").stat().st_size < 400_000
        assert f"({key}.png)" in page
    before = page
    with pytest.raises(sp.FormatError, match="exists"):
        example.run(folder)
    assert (folder / "report.md").read_text("utf-8") == before


def test_everyone_reaches_all_but_the_woman_the_highest(table):
    """The failure is listed, with something that gave way."""
    for (person, item, task), (residual, held) in table.items():
        if (person, item) == ("woman", "overhead"):
            continue
        assert task != "hand" or (residual < 0.01 and not held), (person, item)
    residual, held = table["woman", "overhead", "hand"]
    assert residual > 0.05
    assert held
    unmet = [
        held for (person, item, _), (_, held) in table.items() if (person, item) == ("woman", "overhead")
    ]
    assert any(unmet)


def test_the_report_says_so(folder):
    """Five items are reached, one is not, and the picture's caption agrees with the table by construction."""
    page = (folder / "report.md").read_text("utf-8")
    assert page.count("| yes |") == 5
    assert page.count("| **no** |") == 1
    assert "| overhead | hand | 0." in page


@pytest.mark.parametrize("key", ["woman_p05", "man_p95"])
def test_feet_stay_and_nothing_is_hit(example, folder, key):
    """Ankles and toes within 1 mm of their place, no obstacle 1 mm deep in arms or trunk: from the BVH."""
    motion = sp.load(folder / f"{key}.bvh")
    stature = example.PEOPLE[key][1]
    positions, world = motion.transforms
    sites = motion.skeleton.compute_sites(positions, world)
    names = motion.skeleton.names
    toes = [k for k, joint in enumerate(motion.skeleton.site_parents) if "metatarsal" in names[joint]]
    assert len(toes) == 2
    feet = np.concatenate([positions[:, [names.index(f"{s}_ankle") for s in "lr"]], sites[:, toes]], axis=1)
    assert np.linalg.norm(feet - feet[:1], axis=-1).max() < 1e-3
    arms = [(f"{s}_{a}", f"{s}_{b}", r) for s in "lr" for a, b, r in
            (("shoulder", "elbow", 0.024), ("elbow", "wrist", 0.021))]  # fmt: skip
    for a, b, radius in (*arms, ("vt6", "vt1", 0.060)):
        start, end = positions[:, names.index(a)], positions[:, names.index(b)]
        bone = start[:, None] + np.linspace(0, 1, 40)[:, None] * (end - start)[:, None]
        for y in (0.70, 1.12, 1.72):
            low, high = np.array([-0.65, y - 0.015, 0.50]), np.array([0.05, y + 0.015, 0.90])
            assert box_distance(bone, low, high).min() > radius * stature - 1e-3, (a, y)
        beside = np.linalg.norm(bone[..., [0, 2]] - [-0.33, 0.47], axis=-1)
        assert beside[bone[..., 1] < 1.9].min() > 0.025 + radius * stature - 1e-3, a


def test_the_measured_lengths_keep_the_claims(example, folder):
    """Clear of the shelf, on both feet, in balance: the numbers of the report."""
    page = (folder / "report.md").read_text("utf-8")
    rows = [line.split(" | ") for line in page.splitlines() if "| yes |" in line or "| **no** |" in line]
    assert len(rows) == 6
    for row in rows:
        clear, slip, inside = (float(cell.split()[0]) for cell in row[4:7])
        assert clear > -1.0
        assert slip < 1.0
        assert inside > 0.0


def test_distances_of_the_example(example):
    """Box and capsule, outside and inside, by hand."""
    box, post = sp.Box((2.0, 2.0, 2.0)), sp.Capsule(0.5, 2.0)
    points = np.array([[3.0, 0, 0], [0.5, 0, 0], [2.0, 2.0, 0]])
    assert np.allclose(example.distance(points, box, (0, 0, 0)), [2.0, -0.5, np.sqrt(2)])
    assert np.allclose(example.distance(points, post, (0, 0, 0)), [2.5, 0.0, np.sqrt(5) - 0.5])


def test_a_bad_folder_is_one_line_on_the_command_line(tmp_path):
    """No traceback where the folder is a file."""
    (tmp_path / "file").write_text("x")
    command = [sys.executable, str(FILE), "--out", str(tmp_path / "file")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert str(tmp_path) in done.stderr
