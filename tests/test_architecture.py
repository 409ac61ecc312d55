"""Who may import whom: the folder tree is the architecture."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "src" / "sixpoint"

ALLOWED = {
    "errors": set(),
    "kernels": {"kernels"},
    "body": {"body", "errors"},
    "samples": {"samples", "body", "errors"},
    "formats": {"formats", "body", "errors"},
    "signals": {"signals", "errors"},
    "datasets": {"datasets", "errors"},
    "calibration": {"calibration", "signals", "body", "errors"},
    "solvers": {"solvers", "kernels", "body", "errors"},
    "live": {"live", "calibration", "signals", "kernels", "body", "errors"},
    "study": {"study", "signals", "body", "errors"},
    "studies": set(),
    "viewer": {"viewer", "body", "errors"},
    "render": {"render", "body", "errors"},
    "jobs": {
        "jobs",
        "live",
        "calibration",
        "solvers",
        "formats",
        "samples",
        "datasets",
        "study",
        "signals",
        "viewer",
        "render",
        "body",
        "errors",
    },
    "cli": {"cli", "jobs", "live", "study", "solvers", "body", "errors"},
    "__main__": {"cli"},
}
"""Room -> rooms it may import."""

LIBRARIES = {
    "kernels": {"numpy", "numba"},
    "body": {"numpy", "scipy"},
    "formats": {"numpy", "scipy", "ezc3d", "pxr", "PIL"},
    "samples": {"numpy", "scipy"},
    "signals": {"numpy", "scipy"},
    "calibration": {"numpy", "scipy"},
    "live": {"numpy"},
    "solvers": {"numpy"},
    "study": {"numpy", "scipy", "matplotlib", "torch"},
    "viewer": {"numpy", "viser"},
    "render": {"numpy", "scipy", "embreex", "av", "PIL"},
    "jobs": {"numpy", "viser", "distributed"},
    "cli": {"numpy", "cyclopts", "rich"},
}
"""Room -> third-party libraries it may import."""

THIRD_PARTY = {"trimesh"}.union(*LIBRARIES.values())

OFFERS = (PACKAGE / "__init__.py", PACKAGE / "api.py")  # import all that the library offers
FILES = sorted(p for p in PACKAGE.rglob("*.py") if p not in OFFERS)


def imports(path: Path) -> set[str]:
    """Full names of everything a file imports."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def room_of(path: Path) -> str:
    part = path.relative_to(PACKAGE).parts[0]
    return part.removesuffix(".py")


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_rooms_import_only_what_lies_below(path):
    """Every import points down the architecture, and to the libraries of its room."""
    room = room_of(path)
    assert room in ALLOWED, f"a new room {room}: say in ALLOWED what it may import"
    for name in imports(path):
        parts = name.split(".")
        if parts[0] == "sixpoint":
            below = parts[1] if len(parts) > 1 else ""
            assert below in ALLOWED[room] or name in ("sixpoint", "sixpoint.__version__"), name
        elif parts[0] in THIRD_PARTY:
            assert parts[0] in LIBRARIES.get(room, set()), name


def test_every_public_name_has_one_place_and_a_docstring():
    """``__all__`` is sorted, complete, and everything in it says what it is."""
    import sixpoint as sp

    for name in sp.__all__:
        value = getattr(sp, name)
        assert isinstance(value, (dict, tuple)) or (value.__doc__ and len(value.__doc__) > 15), name


def test_a_command_line_begins_without_the_library():
    """What takes a second to import is imported when it is needed; names of the library are there too."""
    code = (
        "import sys, sixpoint.cli.app; heavy = {'numba', 'scipy', 'sixpoint.api'} & set(sys.modules); "
        "import sixpoint; assert not heavy, heavy; assert 'Figure' in dir(sixpoint); sixpoint.Figure; "
        "assert not hasattr(sixpoint, 'nonsense')"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    "code",
    [
        *(f"import sixpoint as sp; sp.{name}.__name__" for name in ("body", "errors", "formats", "solvers")),
        "import sixpoint as sp; found = sp.Figure; assert sp.body.figure.Figure is found",
        "from sixpoint import *; import sixpoint.api as api; assert set(api.__all__) <= set(globals())",
    ],
)
def test_what_is_asked_of_the_package_is_there_the_first_time(code):
    """Its submodules, its names, and all of them at once."""
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    "code",
    [
        "from sixpoint import cli; cli.main",
        "import sixpoint; sixpoint.errors.FigureError",
        "import sixpoint; assert not any(hasattr(sixpoint, n) for n in ('__wrapped__', '_body', 'a.b', ''))",
    ],
)
def test_a_part_or_a_question_does_not_load_the_library(code):
    """Neither a light submodule nor what tools look for in any module."""
    light = "; import sys; assert not {'numba', 'sixpoint.api'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code + light], check=True)


def test_types_are_for_users_too():
    """The marker of PEP 561 is in the package."""
    assert (PACKAGE / "py.typed").is_file()


def test_files_stay_small():
    """No source file grows beyond 350 lines."""
    long = {
        str(p.relative_to(PACKAGE)): n for p in FILES if (n := len(p.read_text("utf-8").splitlines())) > 350
    }
    assert not long
