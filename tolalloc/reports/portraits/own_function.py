"""What is said of a user's own function: which of its inputs have no nominal size."""

from __future__ import annotations

from collections.abc import Mapping

from tolalloc.models.function_model import BoundFunction
from tolalloc.reports.portrait import Examination, Portrait


class FunctionPortrait(Portrait[BoundFunction], of=BoundFunction):
    """What is said of a function at the sources of a drawing."""

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What a reader must know: inputs that the drawing gives no nominal size."""
        bare = ", ".join(self.model.without_nominal)
        return (f"no nominal size on the drawing, taken as deviations from 0: {bare}",) if bare else ()

    def examination(self, figures: Mapping[str, float]) -> Examination:  # noqa: ARG002
        """Return which inputs have no nominal size: a size that was forgotten moves every output."""
        return Examination(tuple(f"{said[0].upper()}{said[1:]}." for said in self.assumptions))
