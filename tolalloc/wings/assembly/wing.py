"""What the assembly wing brings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tolalloc.study.wing import Wing
from tolalloc.wings.assembly.ask.assemble import Assemble
from tolalloc.wings.assembly.ask.mount import Mount

if TYPE_CHECKING:
    from pydantic import BaseModel

    from tolalloc.study.sample import Sample


def _samples() -> Mapping[str, Sample]:
    from tolalloc.wings.assembly.samples import SAMPLES

    return SAMPLES


def _chain() -> type[BaseModel]:
    """Return the record of a chain file with its inner tables, which are read one by one."""
    from pydantic import create_model

    from tolalloc.wings.assembly.files import ChainRecord, PartRecord
    from tolalloc.wings.assembly.steps import AssemblyStep

    inner: dict[str, Any] = {"part": (tuple[PartRecord, ...], ...), "step": (tuple[AssemblyStep, ...], ())}
    return create_model("ChainRecord", __base__=ChainRecord, **inner)


ASSEMBLY = Wing(
    questions=(Assemble, Mount),
    samples=_samples,
    schemas={"chain": _chain},
)
