"""Questions that a command asks without a study: one record each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tolalloc.study.inquiry import Inquiry


def inquiries() -> tuple[type[Inquiry[Any]], ...]:
    """Return those of the trunk, in the order in which a newcomer meets their commands."""
    from tolalloc.study.inquiries.compare import Compare
    from tolalloc.study.inquiries.contact import Contact
    from tolalloc.study.inquiries.costs import Costs
    from tolalloc.study.inquiries.duty import Duty
    from tolalloc.study.inquiries.modify import Modify
    from tolalloc.study.inquiries.te import TransmissionError

    return Compare, Costs, TransmissionError, Contact, Duty, Modify
