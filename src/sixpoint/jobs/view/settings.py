"""The options of a method as controls of the page, and the controls' values as options."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from sixpoint.body.targets import EFFECTORS
from sixpoint.solvers.avoidance.options import AVOIDABLE
from sixpoint.solvers.registry import find_options, find_solver
from sixpoint.viewer.panel import Choice, Setting

PRIORITIZED = ("pik", "pik-flext")
"""Methods whose tasks are listed."""
FIXED = ("flext", "step")
"""Options by which methods of one class differ."""
WEIGHTS = (("w1", "wrists"), ("w2", "ankles"), ("w3", "memory"))
RANGES = {"damping": (0.01, 0.5), "reach": (0.02, 0.5), "twist_weight": (0.0, 5.0), "iterations": (1, 20)}
TURN, AVOID = "turn ", "avoid "
HINTS = {
    "elbows": "Elbows out of the trunk",
    "forearms": "Forearms and hands out of trunk and head",
    "thighs": "Thighs out of each other",
    "arms": "Arms out of the thighs, elbows out of the trunk",
}
"""Before an effector: whether its rotation is used. Before a part: whether it stays out of the trunk."""


def describe_settings(method: str, values: Mapping[str, Any]) -> list[Setting]:
    """The controls of a method.

    Args:
        method: A name of ``SOLVERS``, or ``module:Class``.
        values: What has been set of them, by name.
    """
    solver = find_solver(method)
    parameters = inspect.signature(solver).parameters
    names = ["limits"] if method in PRIORITIZED else [n for n in find_options(solver) if n not in FIXED]
    found: list[Setting] = []
    for name in sorted(names, key=lambda name: name != "limits"):
        found += _describe(name, parameters[name])
    return [replace(setting, value=values.get(setting.name, setting.value)) for setting in found]


def read_settings(method: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Keyword arguments of a method: those of its controls that differ from the default."""
    options: dict[str, Any] = {}
    shown = {setting.name: setting.value for setting in describe_settings(method, values)}
    plain = {setting.name: setting.value for setting in describe_settings(method, {})}
    if any(shown[name] != plain[name] for name, _ in WEIGHTS if name in shown):
        options["weights"] = tuple(float(shown[name]) for name, _ in WEIGHTS)
    turned = tuple(name for name in EFFECTORS if shown.get(TURN + name))
    if turned:
        options["rotations"] = turned
    avoided = tuple(name for name in AVOIDABLE if shown.get(AVOID + name))
    if avoided:
        options["avoid"] = avoided
    for name, value in shown.items():
        if not name.startswith((TURN, AVOID)) and name not in dict(WEIGHTS) and value != plain[name]:
            options[name] = value
    return options


def _describe(name: str, parameter: inspect.Parameter) -> list[Setting]:
    """Controls of one option; none where the page has no way to set it."""
    default = parameter.default
    if name == "weights":
        return [
            Setting(short, f"{short} {what}", float(value), (0.0, 1.0), "Influence on the turn of the pelvis")
            for (short, what), value in zip(WEIGHTS, default, strict=True)
        ]
    if name == "rotations":
        hint = "Use its rotation too: its handle gets rings"
        return [Setting(TURN + at, at, False, None, hint, "Rotations") for at in EFFECTORS]
    if name == "avoid":
        return [Setting(AVOID + part, part, False, None, HINTS[part], "Keep apart") for part in AVOIDABLE]
    label = name.replace("_", " ")
    if isinstance(default, bool):
        return [Setting(name, label, default)]
    if isinstance(default, str) and (options := _literals(parameter.annotation)):
        return [Setting(name, label, default, Choice(options))]
    if isinstance(default, int | float):
        return [Setting(name, label, default, RANGES.get(name, (0.0, 4.0 * abs(default) or 1.0)))]
    return []


def _literals(annotation: Any) -> tuple[str, ...]:
    """The strings of an annotation ``Literal["a", "b"]``, itself a string."""
    found = re.fullmatch(r"(?:typing\.)?Literal\[(.*)\]", str(annotation))
    return tuple(map(str, ast.literal_eval(f"({found[1]},)"))) if found else ()
