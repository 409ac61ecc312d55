"""Roles of markers from their labels: which marker is the left knee's, and of which segment.

Laboratories name markers by sets (Plug-in Gait, CMU's 41, ...), in which one label may mean different
places. So the set that explains most labels is found first and asked first; the other sets then explain
what is left. The sets, roles and segments are tables in ``data/marker_roles.toml``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from sixpoint.body.tables import read_shipped, read_table
from sixpoint.errors import FormatError, TargetError, listed

SIDES = ("l", "r")

Layout = str | Path | Mapping[str, Any]


@dataclass(frozen=True)
class MarkerRoles:
    """Which label has which role.

    Attributes:
        roles: Label -> role, e.g. ``{"LASI": "l_asis"}``, in the order of the file; a role occurs once.
        segments: Label -> segment that the marker is fixed to, e.g. ``"pelvis"``, ``"l_thigh"``.
        unknown: Labels without a role, in the order of the file.
        set_name: The set of markers, or the layout, that was taken.
        share: Share of the file's labels that this set names, 0 to 1.
        subject: What stands before the labels ("nick:LASI"), empty where nothing does.
    """

    roles: Mapping[str, str]
    segments: Mapping[str, str]
    unknown: tuple[str, ...]
    set_name: str
    share: float
    subject: str = ""

    @property
    def labels(self) -> dict[str, str]:
        """Role -> label."""
        return {role: label for label, role in self.roles.items()}

    def label(self, role: str) -> str | None:
        """Label of the marker with a role; None where there is none.

        Raises:
            TargetError: There is no such role at all.
        """
        if role not in segments_of_roles() and role not in self.roles.values():
            raise TargetError(f"unknown marker role {role!r}; roles: {listed(segments_of_roles(), 200)}")
        return self.labels.get(role)


@cache
def _tables() -> dict[str, Any]:
    return read_shipped("marker_roles.toml")


@cache
def segments_of_roles() -> dict[str, str]:
    """All roles -> the segment that each is fixed to: ``l_knee_lateral -> l_thigh``."""
    tables = _tables()
    middle = {"pelvis", "spine", "thorax", "head"}
    found = dict(tables["middle"])
    for role, segment in tables["sided"].items():
        found |= {f"{s}_{role}": segment if segment in middle else f"{s}_{segment}" for s in SIDES}
    return found


@cache
def _sets() -> dict[str, dict[str, str]]:
    """Name of a set -> its labels, plain -> roles."""
    return {table["name"]: _expanded(table["labels"]) for table in _tables()["sets"]}


@cache
def _companions() -> dict[str, list[str]]:
    """Sets that explain no label of a file unless they, or one of these, explain most of it."""
    sets = [table for table in _tables()["sets"] if "only_beside" in table]
    return {table["name"]: [table["name"], *table["only_beside"]] for table in sets}


def _expanded(labels: Mapping[str, str]) -> dict[str, str]:
    found: dict[str, str] = {}
    for label, role in labels.items():
        sides = SIDES if "*" in label else ("",)
        for s in sides:
            found.setdefault(_plain(label.replace("*", s)), role.replace("*", f"{s}_"))
    return found


def _plain(label: str) -> str:
    """Only letters and digits, in lower case: ``"R.Knee_Med" -> "rkneemed"``."""
    return re.sub(r"[^a-z0-9]", "", label.lower())


def _spellings(label: str) -> list[str]:
    """A label as the tables may have it: ``"RightKnee"`` and ``"knee_right"`` are also ``"rknee"``.

    A number behind a hyphen marks a piece of a trajectory: ``"LFWT-12"`` is also ``"lfwt"``.
    """
    plain = _plain(label)
    found = [plain, _plain(re.sub(r"-\d+\Z", "", label))]
    for word in ("left", "right"):
        if plain.startswith(word):
            found.append(word[0] + plain[len(word) :])
        elif plain.endswith(word):
            found += [word[0] + plain[: -len(word)], plain[: -len(word)] + word[0]]
    return found


def find_marker_roles(names: Iterable[str], layout: Layout | None = None) -> MarkerRoles:
    """Find the roles of markers.

    Args:
        names: The labels of a file.
        layout: What the labels mean where they are not of a known set: a TOML file with a table
            ``markers`` (label -> role, or label -> ``{segment = "l_thigh", role = "..."}``), the table
            itself, or the name of a layout that ships ("markers24"). With ``only = true`` its labels
            are the only ones that get roles; else the others are looked for in the known sets.

    Returns:
        The roles that were found; labels without one are listed in ``unknown``.

    Raises:
        FormatError, TargetError: The layout cannot be read, or names unknown roles or segments.
    """
    labels = list(names)
    prefix = _find_prefix(labels)
    bare = {label: label[len(prefix) :] for label in labels if label.startswith(prefix)}
    if layout is None:
        name, share, roles = _match_sets(bare)
        segments = {label: segments_of_roles()[role] for label, role in roles.items()}
    else:
        name, share, roles, segments = _match_layout(bare, layout)
    return MarkerRoles(
        {label: roles[label] for label in labels if label in roles},
        {label: segments[label] for label in labels if label in roles},
        tuple(label for label in labels if label not in roles),
        name,
        share,
        prefix.rstrip(":_. "),
    )


def _find_prefix(labels: list[str]) -> str:
    """What stands before the labels of the subject with most known markers; mostly nothing."""
    starts = Counter[str]({"": len(labels)})
    for label in labels:
        starts.update({label[: match.end()] for match in re.finditer(r"[:_. ]", label)})
    counts = {start: _count_known(labels, start) for start, times in starts.items() if times > 1 or not start}
    return max(counts, key=lambda start: (counts[start], -len(start)))


def _count_known(labels: list[str], prefix: str) -> int:
    """Most labels that a single set explains behind a prefix."""
    bare = [_spellings(label[len(prefix) :]) for label in labels if label.startswith(prefix)]
    return max(sum(any(s in known for s in spellings) for spellings in bare) for known in _sets().values())


def _look_up(label: str, known: Mapping[str, str]) -> str | None:
    return next((known[s] for s in _spellings(label) if s in known), None)


def _match_sets(bare: Mapping[str, str]) -> tuple[str, float, dict[str, str]]:
    """Labels -> roles by the set that explains most of them, then by the others."""
    scores = {}
    for name, known in _sets().items():
        roles = {role for label in bare.values() if (role := _look_up(label, known))}
        scores[name] = (len(roles), len(roles) / len(set(known.values())))
    order = sorted(scores, key=lambda name: scores[name], reverse=True)
    found: dict[str, str] = {}
    share = 0.0
    for name in order:
        if order[0] not in _companions().get(name, order):
            continue
        known = _sets()[name]
        for label, short in bare.items():
            role = _look_up(short, known)
            if label not in found and role is not None and role not in found.values():
                found[label] = role
        if name == order[0]:
            share = len(found) / max(len(bare), 1)
    return order[0] if found else "none", share, found


def _match_layout(
    bare: Mapping[str, str], layout: Layout
) -> tuple[str, float, dict[str, str], dict[str, str]]:
    """Labels -> roles and segments by a layout, then by the known sets unless it is the only one."""
    name, only, entries = _read_layout(layout)
    named = {_plain(label): entry for label, entry in entries.items()}
    found: dict[str, str] = {}
    segments: dict[str, str] = {}
    order = {key: k for k, key in enumerate(named)}
    for label in sorted(bare, key=lambda label: order.get(_plain(bare[label]), len(order))):
        entry = named.get(_plain(bare[label]))
        entry = entry if entry is not None else named.get(_plain(label))
        if entry is None:
            continue
        role, segment = entry if entry[0] else (f"marker_{_plain(bare[label])}", entry[1])
        if role not in found.values():
            found[label], segments[label] = role, segment
    share = len(found) / max(len(bare), 1)
    if not only:
        for label, role in _match_sets(bare)[2].items():
            if label not in found and role not in found.values():
                found[label], segments[label] = role, segments_of_roles()[role]
    return name, share, found, segments


def _read_layout(layout: Layout) -> tuple[str, bool, dict[str, tuple[str, str]]]:
    """Name, whether it is the only one, and label -> (role or "", segment)."""
    if isinstance(layout, Mapping):
        table, name = dict(layout), "layout"
    elif isinstance(layout, str) and layout in SHIPPED_LAYOUTS:
        table, name = read_shipped(f"layouts/{layout}.toml"), layout
    elif not Path(layout).suffix and not Path(layout).is_file():
        raise FormatError(
            layout, f"no such layout; give a TOML file, or one that ships: {listed(SHIPPED_LAYOUTS)}"
        )
    else:
        table, name = read_table(layout), Path(layout).stem
    markers = table.get("markers", {} if "name" in table or "only" in table else table)
    if not (isinstance(markers, Mapping) and markers):
        raise TargetError(f'layout {name}: it needs a table [markers] with lines such as LASI = "l_asis"')
    entries = {label: _read_entry(name, label, entry) for label, entry in markers.items()}
    return str(table.get("name", name)), bool(table.get("only", False)), entries


SHIPPED_LAYOUTS = ("markers24",)
"""Names of the layouts in ``body/data/layouts``."""


def _read_entry(layout: str, label: str, entry: object) -> tuple[str, str]:
    known = segments_of_roles()
    if isinstance(entry, str):
        if entry not in known:
            roles = listed(known, 200)
            raise TargetError(f"layout {layout}: {label} has the unknown role {entry!r}; roles: {roles}")
        return entry, known[entry]
    if not isinstance(entry, Mapping) or not set(entry) <= {"segment", "role"} or not entry:
        raise TargetError(
            f"layout {layout}: {label} must be a role, or a table with segment and role; got {entry!r}"
        )
    role = str(entry.get("role", ""))
    segment = str(entry.get("segment", known.get(role, "")))
    if segment not in known.values():
        segments = listed(dict.fromkeys(known.values()))
        raise TargetError(
            f"layout {layout}: {label} has the unknown segment {segment!r}; segments: {segments}"
        )
    return role, segment
