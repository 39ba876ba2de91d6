"""From the curve of a bad unit back to the errors of its parts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress, RunRecord
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, Neglected, ProcessesName, ReducerName, Seed, StiffnessName, TestTorque, Word

if TYPE_CHECKING:
    from tolalloc.wings.bench.diagnosis import DiagnosisRequest, DiagnosisResult


@dataclass(frozen=True, kw_only=True)
class Diagnose(Inquiry["DiagnosisRequest"]):
    """Find which part error the measured curve of a bad unit points to, and which ones it cannot distinguish."""

    word: ClassVar[str] = "diagnose"
    example: ClassVar[str] = "tolalloc diagnose mine/unit7.csv --reducer mine/reducer.toml --tolerances mine/zones.csv"
    by_position: ClassVar[int] = 1
    counted: ClassVar[str] = "curves"
    kernel: ClassVar[Literal["", "equivalent"]] = "equivalent"

    curve: Annotated[Path, Word("CSV: columns 'angle [deg]', 'transmission error [arcsec]'.")]
    reducer: ReducerName = None
    tolerances: Annotated[str, Word("Tolerance table: shipped name, CSV or XLSX.")] = "rv20e_drawing"
    sheet: Annotated[str, Word("Sheet of a workbook that holds the table; the first unless given.")] = ""
    processes: ProcessesName = "generic"
    neglected: Neglected = None
    torque: TestTorque = None
    noise: Annotated[float, Word("Standard deviation of one reading [arcsec].")] = 0.5
    discrepancy: Annotated[float, Word("Standard deviation of what the model leaves out [arcsec].")] = 0.5
    angle_offset: Annotated[float, Word("Added to every angle of the bench [deg].")] = 0.0
    stiffness: StiffnessName = ""
    form: Annotated[str, Word("Unit file of measured discs and pins, whose form is then known.")] = ""
    correlations: Annotated[str, Word("Correlations between sources: CSV or XLSX.")] = ""
    level: Annotated[float, Word("Probability that the named sources hold the dominant one.")] = 0.97
    repair: Annotated[
        Path | None, Word("TOML: limit, prices of scrap and new parts, gauge minutes; then also what to measure next.")
    ] = None
    seed: Seed = 1

    def prepare(self) -> DiagnosisRequest:
        """Return which unit is to be diagnosed, against which drawings."""
        from tolalloc.drawings.drawing import load_drawing
        from tolalloc.reducers.choice import reducer
        from tolalloc.reducers.unit_file import load_unit
        from tolalloc.wings.bench.diagnosis import DiagnosisRequest
        from tolalloc.wings.bench.repair import load_repair

        drawing = load_drawing(self.tolerances, self.processes, self.correlations, sheet=self.sheet)
        # The unit was made with the modification of its drawing.
        choice = reducer(str(self.reducer), stiffness=self.stiffness).set_to(drawing.settings)
        design, errors = choice.reducer, drawing.errors.at_places(choice.source_names)
        if self.form:
            unit = load_unit(self.form)
            design = unit.as_built(design)
            errors = replace(errors, sources=unit.without_measured(errors.sources))
        return DiagnosisRequest(
            curve=self.curve,
            reducer=design,
            errors=errors,
            torque_nm=self.torque,
            noise_arcsec=self.noise,
            discrepancy_arcsec=self.discrepancy,
            angle_offset_deg=self.angle_offset,
            level=self.level,
            seed=self.seed,
            neglected=tuple(self.neglected or ()),
            repair=load_repair(self.repair, errors) if self.repair else None,
        )

    def solve(self, prepared: DiagnosisRequest, progress: Progress) -> Answer[DiagnosisResult]:
        """Return what the curve of the unit tells of its parts."""
        from tolalloc.reducers.equivalent.model import OUTCOMES
        from tolalloc.wings.bench.diagnosis import diagnose_unit
        from tolalloc.wings.bench.telling.diagnosis import DiagnosisTeller

        known = (f"the form of the parts is known from {self.form}",) if self.form else ()
        record = RunRecord(progress, OUTCOMES)
        result = diagnose_unit(prepared, record)
        header = Header(
            name=prepared.curve.stem,
            model=prepared.reducer.name,
            seed=prepared.seed,
            assumptions=(*result.assumed, *known),
            statuses=record.counts,
            stages=record.stages,
            currency=prepared.repair.currency if prepared.repair else "",
        )
        return Answer(kind="diagnosis", header=header, result=result, told_by=DiagnosisTeller)
