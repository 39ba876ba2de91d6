"""The sentences of reports: texts with named gaps in TOML files, which are mended without reading Python.

A gap is written as Python's ``str.format`` has it, ``{share:.2%}``, and its number is said as `wording.number` says it;
which sentence is said, and what fills its gaps, is the teller's.
"""

from __future__ import annotations

import re
import tomllib
from functools import lru_cache
from importlib.resources import files
from typing import Any

from tolalloc.reports.wording import Spoken

_SPOKEN = Spoken()
_BLANKS = re.compile(r"[ \n]+")
"""Where a line of a text may be broken; a thin or a protected blank stays as it is."""


@lru_cache(maxsize=64)
def _texts(name: str, room: str) -> dict[str, str]:
    text = files(room).joinpath("sentences", f"{name}.toml").read_text(encoding="utf-8")
    return {key: _BLANKS.sub(" ", value.strip()) for key, value in tomllib.loads(text).items()}


class Sentences:
    """The sentences of one teller, ``sentences/NAME.toml`` of its room.

    >>> Sentences("costs")("assumption")
    'the error of a cost is relative, and the same at all zones'
    """

    def __init__(self, name: str, room: str = "tolalloc.reports") -> None:
        self._name, self._room = name, room

    def __call__(self, key: str, /, **gaps: Any) -> str:
        """Return a sentence with its gaps filled; a key or gap that is missing is the teller's fault, a KeyError."""
        return _SPOKEN.format(_texts(self._name, self._room)[key], **gaps)
