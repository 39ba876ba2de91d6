"""What gauge readings of a lot say of the processes that a drawing states."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, Word

if TYPE_CHECKING:
    from tolalloc.bench.lots import LotRequest, LotResult


@dataclass(frozen=True, kw_only=True)
class Lot(Inquiry["LotRequest"]):
    """Tell from gauge readings of a lot which process moved, how the parts keep their zones, and the lot's drawing."""

    word: ClassVar[str] = "lot"
    by_position: ClassVar[int] = 2

    readings: Annotated[
        Path, Word("CSV or XLSX: a row per part or unit, a column per source, 'disc1.pitch [µm]'; cells may be empty.")
    ]
    tolerances: Annotated[Path, Word("Tolerance table of the drawing: shipped name, CSV or XLSX.")]
    sheet: Annotated[str, Word("Sheet of a workbook that holds the table; the first unless given.")] = ""
    false_alarms: Annotated[float, Word("Probability that any process is called moved if none is.")] = 0.05
    next_parts: Annotated[
        int | None, Word("Parts of the next sample, for its control limits; as many as now unless given.")
    ] = None
    write_to: Annotated[
        Path | None, Word("Tolerance table to write, new: Cp and shift of the lot.", option="--write")
    ] = None
    seed: Annotated[int, Word("Seed of every random number.")] = 1

    def prepare(self) -> LotRequest:
        """Return the readings and the drawing that they are held against."""
        from tolalloc.bench.lots import prepare_lot
        from tolalloc.drawings.drawing import load_drawing
        from tolalloc.reading.files import require_new

        if self.write_to:
            require_new(self.write_to)
        drawing = load_drawing(self.tolerances, sheet=self.sheet)
        return prepare_lot(self.readings, drawing, self.false_alarms, self.next_parts, self.seed)

    def solve(self, prepared: LotRequest, progress: Progress) -> Answer[LotResult]:  # noqa: ARG002
        """Return what moved, the capabilities and the drawing of the lot."""
        from tolalloc.bench.lots import judge_lot

        named = Path(prepared.drawing.name).name
        header = Header(name=prepared.path.name, model=named, seed=prepared.seed)
        return Answer(kind="lot", header=header, result=judge_lot(prepared))

    def write(self, answer: Answer[Any]) -> tuple[str, ...]:
        """Write the tolerance table of the lot, if it was asked for."""
        if not self.write_to:
            return ()
        return (f"The tolerance table of the lot is {answer.result.drawing.to_csv(self.write_to)}.",)


INQUIRY = Lot
