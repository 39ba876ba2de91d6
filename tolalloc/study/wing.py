"""What a wing brings: what the trunk does not answer, and nothing of it knows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tolalloc.study.inquiry import Inquiry

if TYPE_CHECKING:
    from pydantic import BaseModel

    from tolalloc.study.sample import Sample


@dataclass(frozen=True, kw_only=True)
class Wing:
    """All that commands, ``ta``, ``tolalloc new`` and ``tolalloc schema`` read of a wing."""

    questions: tuple[type[Inquiry[Any]], ...]  # Asked by a command and a function of ``ta`` each
    samples: Callable[[], Mapping[str, Sample]] = dict  # Kind that `new --with` takes → its files; loaded when asked
    schemas: Mapping[str, Callable[[], type[BaseModel]]] = field(default_factory=dict)  # Kind of TOML file → its record
