"""What is to be done to one file, and what came of it: what goes between processes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

DONE, FAILED = "done", "failed"


@dataclass(frozen=True)
class Task:
    """A job on one file.

    Attributes:
        job: Name of the job.
        name: The file's path within its library, with slashes: ``17/17_10.amc``.
        source: The file; absolute.
        out: The folder of the batch; absolute.
        target: The file to write, within ``out``; empty where the job names its files itself.
        options: Of the job, plain values and absolute paths.
        part: What of a file this is, where a job does several things to it; else empty.
        key: What the result is made of, as a short name; see ``keys.task_key``.
        code: The client's code; see ``keys.own_code``.
        size: Of the file [bytes]; large ones begin.
    """

    job: str
    name: str
    source: Path
    out: Path
    target: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)
    part: str = ""
    key: str = ""
    code: str = ""
    size: int = 0

    @property
    def label(self) -> str:
        """The task for people."""
        return f"{self.name}, {self.part}" if self.part else self.name


@dataclass(frozen=True)
class Outcome:
    """What came of a task: a line of ``summary.csv``.

    Attributes:
        name: The file's path within its library.
        part: What of the file.
        status: "done" or "failed".
        key: What it was made of.
        error: Why it failed.
        seconds: Time it took [s].
        cpu: Processor time of that [s].
        worker: Where it ran, as host:process.
        metrics: What the job measured: numbers and texts.
        files: What was written: path within the folder of the batch -> digest of its content.
        notes: What was said meanwhile.
    """

    name: str
    part: str
    status: str
    key: str = ""
    error: str = ""
    seconds: float = 0.0
    cpu: float = 0.0
    worker: str = ""
    metrics: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @classmethod
    def failed(cls, task: Task, error: str, **more: Any) -> Outcome:
        """Of a task that gave no result."""
        text = " ".join(error.split()) or "no reason was given"
        return cls(task.name, task.part, FAILED, task.key, text[:1000], **more)

    @property
    def label(self) -> str:
        """The task for people."""
        return f"{self.name}, {self.part}" if self.part else self.name

    def to_json(self) -> bytes:
        """One line."""
        return (json.dumps(asdict(self)) + "\n").encode()

    @classmethod
    def from_json(cls, data: bytes) -> Outcome:
        """The same again.

        Raises:
            ValueError: It is none.
        """
        values = json.loads(data)
        if not isinstance(values, dict) or not {"name", "part", "status", "key"} <= values.keys():
            raise ValueError("this is no record of a task")
        known = {item.name for item in fields(cls)}
        values = {name: value for name, value in values.items() if name in known}
        return cls(**{**values, "notes": tuple(values.get("notes", ()))})
