"""What one built unit does over one output turn under one torque."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, ReducerName, StiffnessName, TestTorque, UnitName, Word

if TYPE_CHECKING:
    from tolalloc.reducers.reducer.design import Reducer
    from tolalloc.reducers.transmission_error import TransmissionErrorResult
    from tolalloc.reducers.unit_file import BuiltUnit


@dataclass(frozen=True, kw_only=True)
class TransmissionError(Inquiry["tuple[Reducer, BuiltUnit, float]"]):
    """Compute the transmission error of one built unit over one output turn."""

    word: ClassVar[str] = "te"
    example: ClassVar[str] = "tolalloc te --reducer rv20e --unit table4 --attribute"
    kernel: ClassVar[Literal["", "equivalent"]] = "equivalent"

    reducer: ReducerName = None
    unit: UnitName = "exact"
    torque: TestTorque = None
    stiffness: StiffnessName = ""
    attributed: Annotated[bool, Word("Show which source drives which order.", option="--attribute")] = False

    def prepare(self) -> tuple[Reducer, BuiltUnit, float]:
        """Return the design, the unit and the torque on the carrier [N·m]."""
        from tolalloc.reducers.choice import reducer
        from tolalloc.reducers.unit_file import load_unit

        design = reducer(str(self.reducer), stiffness=self.stiffness).reducer
        return design, load_unit(self.unit), design.torque_on_carrier(self.torque, self.called)

    def solve(
        self,
        prepared: tuple[Reducer, BuiltUnit, float],
        progress: Progress,  # noqa: ARG002
    ) -> Answer[TransmissionErrorResult]:
        """Return what the unit does."""
        from tolalloc.reducers.equivalent.compiled_ahead import compile_ahead
        from tolalloc.reducers.transmission_error import transmission_error

        design, unit, torque = prepared
        compile_ahead(design.disc_count)
        result = transmission_error(design, unit, torque, attributed=self.attributed)
        header = Header(
            name=unit.name,
            model=design.name,
            conditions={"torque on the carrier [N·m]": torque},
            assumptions=(*result.reducer.assumptions, *unit.assumptions),
            statuses=result.statuses,
        )
        return Answer(kind="transmission error", header=header, result=result)
