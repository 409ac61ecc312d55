"""What methods were fitted on, and the recordings that are no test for that reason: words and a table."""

from __future__ import annotations

from dataclasses import replace

from sixpoint.study.comparison.averages import clip_names, clips_of, find_result
from sixpoint.study.comparison.measures import NONE, describe_missing, number
from sixpoint.study.comparison.model import DEVELOPMENT, TRAIN, Comparison, is_fitted
from sixpoint.study.document import Block, Paragraph, Picture, Table

USES = {TRAIN: "used for fitting", DEVELOPMENT: "used for development"}
"""Split -> what its recordings were used for."""
FITTED = "*"
"""Behind the numbers of a method that was fitted on the person of the recording."""


def describe_fitted(comparison: Comparison) -> str:
    """What each fitted method was fitted on, a sentence each; empty where none was."""
    return " ".join(
        f"{method} was fitted on {list_people(people)}."
        for method, people in comparison.fitted_on.items()
        if people
    )


def list_people(people: tuple[str, ...]) -> str:
    """People by data set: ``cmu/02, 03, 05; mass``."""
    sets: dict[str, list[str]] = {}
    for person in people:
        source, _, name = person.partition("/")
        sets.setdefault(source, []).append(name)
    return "; ".join(
        f"{source}/{', '.join(names)}" if all(names) else source for source, names in sets.items()
    )


def say_fitted(block: Block, comparison: Comparison) -> Block:
    """A table or picture whose note or caption ends with what its methods were fitted on."""
    text = describe_fitted(comparison)
    if text and isinstance(block, Table):
        return replace(block, note=f"{block.note} {text}".strip())
    if text and isinstance(block, Picture):
        return replace(block, caption=f"{block.caption} {text}")
    return block


def find_person_of(comparison: Comparison, clip: str) -> str:
    """Whom a clip shows; empty where that is not known."""
    return next((row.person for row in comparison.rows if row.clip == clip), "")


def summarise_fitting(comparison: Comparison) -> Paragraph:
    """What methods were fitted on, and how many recordings are no test for that reason."""
    fitted, clips = describe_fitted(comparison), clip_names(comparison)
    apart = {use: len(clips_of(comparison, split)) for split, use in USES.items()}
    text = [fitted] if fitted else []
    text += [
        f"{count} of {len(clips)} recordings, {use}, are in no average."
        for use, count in apart.items()
        if count
    ]
    unknown = [clip for clip in clips if not find_person_of(comparison, clip)]
    if fitted and unknown:
        text.append(f"The person of {len(unknown)} of {len(clips)} recordings is not known.")
    return Paragraph(" ".join(text), "Fitting." if text else "")


def describe_use(comparison: Comparison, clip: str) -> str:
    """Why a clip is no test; empty for one that is."""
    use = next((USES[split] for split in USES if clip in clips_of(comparison, split)), "")
    if not use:
        return ""
    person = find_person_of(comparison, clip)
    methods = [method for method, people in comparison.fitted_on.items() if is_fitted(person, people)]
    why = f": {', '.join(methods)} was fitted on {person}" if methods else ""
    return f"This recording was {use}{why}; it is in no average."


def split_table(comparison: Comparison, split: str) -> Table | None:
    """Errors on recordings that are no test, clips down and methods across; None if there are none."""
    clips = clips_of(comparison, split)
    if not clips:
        return None
    rows = [
        (
            clip,
            find_person_of(comparison, clip) or NONE,
            *(_cell(comparison, clip, m) for m in comparison.methods),
        )
        for clip in clips
    ]
    return Table(
        title=f"Recordings {USES[split]}: position error over H / orientation error [rad]",
        columns=("clip", "person", *comparison.methods),
        rows=tuple(rows),
        note=f"These are in no average. {FITTED}: the method was fitted on this person.",
    )


def _cell(comparison: Comparison, clip: str, method: str) -> str:
    missing = describe_missing(comparison, clip, method)
    row = find_result(comparison, clip, method)
    if missing or row is None:
        return missing
    mark = FITTED if is_fitted(row.person, comparison.fitted_on.get(method, ())) else ""
    return f"{number(row.position, 4)} / {number(row.orientation, 4)}{mark}"
