"""The reducer file of a new folder: a preset's, with another name and other counts of cranks and discs."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer

PRESETS = ("rv20e", "rv40e", "rv80e", "rv110e", "rv160e")
"""Presets whose dimensions follow one rule, smallest first."""
_FOLDER = Path(__file__).parents[2] / "reducers" / "reducer" / "presets"
CRANKS, DISCS = (2, 3, 4), (1, 2, 3)
"""Counts that a folder can be made for [-]."""


@dataclass(frozen=True, kw_only=True)
class Likeness:
    """Which preset a new reducer is like, and how many cranks and discs it has; those of the preset unless given."""

    preset: str = "rv20e"
    cranks: int | None = None
    discs: int | None = None

    def __post_init__(self) -> None:
        if self.preset not in PRESETS:
            raise UnknownNameError.among("new reducer", "preset", self.preset, PRESETS)
        for name, count, allowed in (("cranks", self.cranks, CRANKS), ("discs", self.discs, DISCS)):
            if count is not None and count not in allowed:
                raise InputError.of_argument("new reducer", name, count, f"{allowed[0]} to {allowed[-1]}")

    @property
    def reducer(self) -> Reducer:
        """The preset itself."""
        return load_reducer(self.preset)

    def text(self, name: str) -> str:
        """Return the reducer file; what the preset does not state of the new counts is marked as an assumption."""
        text = (_FOLDER / f"{self.preset}.reducer.toml").read_text(encoding="utf-8")
        text = re.sub(r'^name = ".*"$', f'name = "{name}"', text, count=1, flags=re.MULTILINE)
        changed = []
        for field, count in (("crank_count", self.cranks), ("disc_count", self.discs)):
            before = int(re.search(rf"^{field} = (\d+)", text, re.MULTILINE)[1])  # type: ignore[index]
            if count not in (None, before):
                text = re.sub(rf"^{field} = \d+", f"{field} = {count}", text, count=1, flags=re.MULTILINE)
                changed.append(f"{field} {count} instead of {before}")
        if changed:
            note = f"{', '.join(changed)}: all parts as in {self.preset}, which has another load on each of them"
            text = text.replace("assumptions = [\n", f'assumptions = [\n  "{note}",\n', 1)
        return f"# Made by tolalloc new, like {self.preset}. Change what you know, and what `assumptions` says.\n{text}"
