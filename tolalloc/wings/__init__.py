"""Wings: each answers something whole that the trunk does not; neither the trunk nor another wing imports one."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from tolalloc.reading.plugins import plugins

if TYPE_CHECKING:
    from tolalloc.study.inquiry import Inquiry
    from tolalloc.study.wing import Wing


@cache
def wings() -> tuple[Wing, ...]:
    """Return all wings, in the order in which a newcomer meets their commands."""
    from tolalloc.wings.assembly.wing import ASSEMBLY
    from tolalloc.wings.bench.wing import BENCH
    from tolalloc.wings.motion.wing import MOTION

    brought = plugins("wings", ("bench", "assembly", "motion"), ("questions", "samples", "schemas"))
    return BENCH, ASSEMBLY, MOTION, *brought.values()


@cache
def all_inquiries() -> tuple[type[Inquiry[Any]], ...]:
    """Return the questions that need no study, the trunk's and then those of the wings."""
    from tolalloc.study.inquiries import INQUIRIES

    return (*INQUIRIES, *(own for wing in wings() for own in wing.questions))
