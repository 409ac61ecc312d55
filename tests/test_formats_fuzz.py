from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sixpoint import formats
from sixpoint.errors import SixpointError
from sixpoint.formats.npz import format_npz
from test_formats_acclaim import AMC, ASF
from test_formats_bvh import BVH
from test_formats_tables import CSV, make_targets

TOKENS = ["NaN", "inf", "-1e400", "1e13", "1e12", "-1", "0", "1e-320", "{", "}", "JOINT", "ROOT", "End Site"]
TOKENS += [",", "begin", "end", ":root", "root", "thigh", "__link", "limits (1 2)", "dof l tx"]
TOKENS += ["999999999999", "%s", "é", "CHANNELS 0", "Frames: 3", "# rate 0"]
TOKENS += ["\x00", "\x0c", "\u2028", "²", "1_0", "١"]

Mutation = Callable[[bytes], bytes]


@st.composite
def mutations(draw: st.DrawFn) -> Mutation:
    """A way to damage a file: cut it, flip a byte, drop, repeat or swap lines, put in or replace a word."""
    kind = draw(st.sampled_from(["cut", "flip", "drop", "repeat", "swap", "insert", "replace"]))
    where, other = draw(st.floats(0, 0.999)), draw(st.floats(0, 0.999))
    byte, token = draw(st.integers(0, 255)), draw(st.sampled_from(TOKENS)).encode()

    def mutate(data: bytes) -> bytes:
        if kind in ("cut", "flip"):
            at = int(where * len(data))
            return data[:at] if kind == "cut" else data[:at] + bytes([byte]) + data[at + 1 :]
        lines = data.split(b"\n")
        k, m = int(where * len(lines)), int(other * len(lines))
        if kind == "drop":
            del lines[k]
        elif kind == "repeat":
            lines.insert(m, lines[k])
        elif kind == "swap":
            lines[k], lines[m] = lines[m], lines[k]
        else:
            words = lines[k].split(b" ")
            w = int(other * len(words))
            words[w : w + (kind == "replace")] = [token]
            lines[k] = b" ".join(words)
        return b"\n".join(lines)

    return mutate


def damage(text: bytes, steps: list[Mutation]) -> bytes:
    for step in steps:
        text = step(text)
    return text


STEPS = st.lists(mutations(), min_size=1, max_size=4)


@pytest.mark.parametrize("kind", ["bvh", "amc", "asf", "csv", "npz"])
@given(steps=STEPS)
@settings(max_examples=250, deadline=None, derandomize=True)
def test_damaged_files_never_crash(kind: str, steps: list[Mutation]) -> None:
    """Whatever a file holds, it loads as finite numbers or raises a SixpointError; it is never changed."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        path = Path(folder) / f"a.{'amc' if kind == 'asf' else kind}"
        texts = {
            "bvh": {path: BVH.encode()},
            "amc": {path.with_suffix(".amc"): AMC.encode(), path.with_suffix(".asf"): ASF.encode()},
            "asf": {path.with_suffix(".asf"): ASF.encode(), path.with_suffix(".amc"): AMC.encode()},
            "csv": {path: CSV.encode()},
            "npz": {path: format_npz(make_targets(rotations=True))},
        }[kind]
        first = next(iter(texts))
        for name, data in texts.items():
            name.write_bytes(damage(data, steps) if name == first else data)
        before = {name: name.read_bytes() for name in texts}
        try:
            if kind in ("csv", "npz"):
                targets = formats.load_targets(path)
                assert np.all(np.isfinite(targets.positions[targets.tracked])) and targets.rate > 0
            else:
                motion = formats.load(path)
                assert np.all(np.isfinite(motion.positions))
                for copy in ("b.bvh", "c.amc"):
                    formats.save(motion, Path(folder) / copy)
        except SixpointError:
            pass
        assert {name: name.read_bytes() for name in texts} == before
        assert not list(Path(folder).glob(".*"))


@given(data=st.binary(max_size=300))
@settings(max_examples=150, deadline=None, derandomize=True)
def test_noise_is_refused(data: bytes) -> None:
    """Random bytes under any suffix are a SixpointError."""
    with tempfile.TemporaryDirectory() as folder:
        for suffix in ("bvh", "amc", "asf", "csv", "npz"):
            path = Path(folder) / f"a.{suffix}"
            path.write_bytes(data)
            with pytest.raises(SixpointError):
                (formats.load_targets if suffix in ("csv", "npz") else formats.load)(path)
