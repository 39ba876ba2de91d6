"""Questions that a command asks without a study: one record each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tolalloc.study.inquiries.compare import Compare
from tolalloc.study.inquiries.contact import ToothContact
from tolalloc.study.inquiries.costs import Costs
from tolalloc.study.inquiries.modify import Modify
from tolalloc.study.inquiries.te import TransmissionError

if TYPE_CHECKING:
    from tolalloc.study.inquiry import Inquiry

INQUIRIES: tuple[type[Inquiry[Any]], ...] = (Compare, Costs, TransmissionError, ToothContact, Modify)
"""Those of the trunk, in the order in which a newcomer meets their commands."""
