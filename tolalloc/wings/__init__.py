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
    from tolalloc.study.inquiries import INQUIRIES
    from tolalloc.study.wing import Wing
    from tolalloc.wings.assembly.wing import ASSEMBLY
    from tolalloc.wings.bench.wing import BENCH
    from tolalloc.wings.motion.wing import MOTION

    shipped = (BENCH, ASSEMBLY, MOTION)
    words = {own.word for own in (*INQUIRIES, *(own for wing in shipped for own in wing.questions))}

    def require(wing: Wing) -> None:
        if double := words.intersection(own.word for own in wing.questions):
            raise ValueError(f"{', '.join(sorted(double))} is known already, give it another word")
        words.update(own.word for own in wing.questions)

    return *shipped, *plugins("wings", ("bench", "assembly", "motion"), (), "", require, Wing).values()


@cache
def all_inquiries() -> tuple[type[Inquiry[Any]], ...]:
    """Return the questions that need no study, the trunk's and then those of the wings."""
    from tolalloc.study.inquiries import INQUIRIES

    return (*INQUIRIES, *(own for wing in wings() for own in wing.questions))
