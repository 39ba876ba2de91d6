"""What gauge readings and curves of a lot say of the processes that a drawing states."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from tolalloc.exceptions import InputError
from tolalloc.reading.named_fields import number, or_none, whole
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress, RunRecord
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, Neglected, ProcessesName, ReducerName, Seed, StiffnessName, TestTorque, Word

if TYPE_CHECKING:
    from tolalloc.drawings.drawing import Drawing
    from tolalloc.wings.bench.lot_orders import LotCurves
    from tolalloc.wings.bench.lots import LotRequest, LotResult


@dataclass(frozen=True, kw_only=True)
class Lot(Inquiry["LotRequest"]):
    """Find from gauge readings of a lot which process moved and how well the parts keep their zones."""

    word: ClassVar[str] = "lot"
    example: ClassVar[str] = "tolalloc lot mine/lot.csv mine/zones.csv"
    by_position: ClassVar[int] = 2

    readings: Annotated[
        Path,
        Word("CSV or XLSX: a row per part or unit, a column per source, 'disc1.pitch [µm]'; or a Q-DAS file."),
    ]
    tolerances: Annotated[Path, Word("Tolerance table of the drawing: shipped name, CSV or XLSX.")]
    sheet: Annotated[str, Word("Sheet of a workbook that holds the table; the first unless given.")] = ""
    processes: ProcessesName = "generic"
    false_alarms: Annotated[
        float,
        Word("Probability of a false alarm if no process moved."),
        number("0.001 to 0.5", least=0.001, most=0.5),
    ] = 0.05
    next_parts: Annotated[
        int | None,
        Word("Parts in the next sample, for its control limits; as many as now unless given."),
        or_none(whole("2 to 10000", 2, 10_000)),
    ] = None
    write_to: Annotated[
        Path | None, Word("New tolerance table to write, with Cp and shift of the lot.", option="--write")
    ] = None
    curves: Annotated[
        Path | None, Word("Folder of curves, a CSV per unit: columns 'angle [deg]', 'transmission error [arcsec]'.")
    ] = None
    reducer: ReducerName = None
    neglected: Neglected = None
    torque: TestTorque = None
    noise: Annotated[
        float, Word("Standard deviation of one reading [arcsec]."), number("above 0 up to 60", above=0, most=60)
    ] = 0.5
    discrepancy: Annotated[
        float, Word("Standard deviation of what the model leaves out [arcsec]."), number("0 to 60", least=0, most=60)
    ] = 0.5
    stiffness: StiffnessName = ""
    seed: Seed = 1

    def with_reducer(self, *written: Path | None, argument: str = "reducer") -> Self:
        """Return it with the default reducer if there are curves, which alone ask for one."""
        return super().with_reducer(*written, argument=argument) if self.curves else self

    def prepare(self) -> LotRequest:
        """Return the readings and the drawing that they are held against."""
        from tolalloc.drawings.drawing import load_drawing
        from tolalloc.reading.files import require_new
        from tolalloc.wings.bench.lots import prepare_lot

        if self.write_to:
            require_new(self.write_to)
        for field in ("reducer", "neglected", "torque"):
            if getattr(self, field) is not None and not self.curves:
                raise InputError.of_argument("lot", field, getattr(self, field), "none without curves")
        drawing = load_drawing(self.tolerances, self.processes, sheet=self.sheet)
        curves = self._curves(self.curves, drawing) if self.curves else None
        return prepare_lot(self.readings, drawing, self.false_alarms, self.next_parts, self.seed, curves)

    def _curves(self, folder: Path, drawing: Drawing) -> LotCurves:
        """Return the curves and the model that predicts them."""
        from tolalloc.reading.units import ARCSECOND
        from tolalloc.reducers.choice import reducer
        from tolalloc.wings.bench.lot_orders import load_lot_curves
        from tolalloc.wings.bench.posterior import Noise

        own, left_out = self.reducer, self.neglected or ()
        choice = reducer(str(own), stiffness=self.stiffness, torque=self.torque, neglected=left_out)
        choice = choice.set_to(drawing.settings)
        errors = drawing.errors.at_places(choice.source_names)
        noise = Noise(reading=self.noise * ARCSECOND, discrepancy=self.discrepancy * ARCSECOND)
        return load_lot_curves(folder, choice.bound(errors, "lot"), errors, noise)

    def room(self, prepared: LotRequest) -> str:
        """Return the room that curves are predicted with."""
        return "equivalent" if prepared.curves else ""

    def solve(self, prepared: LotRequest, progress: Progress) -> Answer[LotResult]:
        """Return what moved, the capabilities and the drawing of the lot."""
        from tolalloc.wings.bench.lots import judge_lot
        from tolalloc.wings.bench.telling.lot import LotTeller

        header = Header(name=prepared.path.name, model=Path(prepared.drawing.name).name, seed=prepared.seed)
        if not prepared.curves:
            return Answer(kind="lot", header=header, result=judge_lot(prepared), told_by=LotTeller)
        from tolalloc.reducers.equivalent.model import OUTCOMES

        record, model = RunRecord(progress, OUTCOMES), prepared.curves.model
        with record.stage("orders of the curves"):
            result = judge_lot(replace(prepared, curves=prepared.curves.observed(record)))
        assumed = (*model.reducer.assumptions, *model.left_out)
        header = replace(header, assumptions=assumed, statuses=record.counts, stages=record.stages)
        return Answer(kind="lot", header=header, result=result, told_by=LotTeller)

    def write(self, answer: Answer[Any]) -> tuple[str, ...]:
        """Write the tolerance table of the lot, if it was asked for."""
        if not self.write_to:
            return ()
        return (f"The tolerance table of the lot is {answer.result.drawing.to_csv(self.write_to)}.",)
