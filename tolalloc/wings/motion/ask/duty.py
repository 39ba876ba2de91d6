"""What a duty cycle does: lives of bearings, pressure, loss and temperature."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from tolalloc.reading.named_fields import number, or_none
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, ReducerName, Word

if TYPE_CHECKING:
    from tolalloc.reducers.load_case import LoadCase
    from tolalloc.reducers.reducer.design import Reducer
    from tolalloc.wings.motion.duty import DutyResult


@dataclass(frozen=True, kw_only=True)
class Duty(Inquiry["tuple[Reducer, tuple[LoadCase, ...]]"]):
    """Compute bearing lives, loads, losses and disc temperature of exact parts under a duty cycle."""

    word: ClassVar[str] = "duty"
    example: ClassVar[str] = "tolalloc duty mine/cycle.csv --reducer mine/reducer.toml"
    by_position: ClassVar[int] = 1
    kernel: ClassVar[Literal["", "equivalent"]] = "equivalent"

    cycle: Annotated[Path, Word("CSV: columns case, torque [N·m], speed [rpm], share [%].")]
    reducer: ReducerName = None
    resistance: Annotated[
        float | None,
        Word("Temperature of the discs above the ring per watt lost [K/W]; assumed from the size unless given."),
        or_none(number("0 to 10 K/W", least=0, most=10)),
    ] = None

    def prepare(self) -> tuple[Reducer, tuple[LoadCase, ...]]:
        """Return the design and its load cases."""
        from tolalloc.reducers.load_case import load_cycle
        from tolalloc.reducers.reducer.files import load_reducer
        from tolalloc.wings.motion.duty import require_cycle

        design, cases = load_reducer(str(self.reducer)), load_cycle(self.cycle)
        require_cycle(cases, design)
        return design, cases

    def solve(self, prepared: tuple[Reducer, tuple[LoadCase, ...]], progress: Progress) -> Answer[DutyResult]:  # noqa: ARG002
        """Return lives, loads and temperature."""
        from tolalloc.wings.motion.duty import duty_of
        from tolalloc.wings.motion.telling.duty import DutyTeller

        design, cases = prepared
        result = duty_of(design, cases, self.resistance)
        header = Header(name=f"{design.name}: {self.cycle.stem}", model=design.name, assumptions=design.assumptions)
        return Answer(kind="duty", header=header, result=result, told_by=DutyTeller)
