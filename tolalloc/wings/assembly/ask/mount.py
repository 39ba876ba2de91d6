"""Which measured part goes where, and how it is turned there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from tolalloc.reading.named_fields import whole
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress, RunRecord
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, ReducerName, Seed, TestTorque, Word

if TYPE_CHECKING:
    from tolalloc.wings.assembly.mounting import MountingRequest, MountingResult


@dataclass(frozen=True, kw_only=True)
class Mount(Inquiry["MountingRequest"]):
    """Build the units with the least peak-to-peak from measured parts: which part goes where, turned how far."""

    word: ClassVar[str] = "mount"
    example: ClassVar[str] = "tolalloc mount mine/parts.csv --reducer mine/reducer.toml"
    by_position: ClassVar[int] = 1
    kernel: ClassVar[Literal["", "equivalent"]] = "equivalent"

    parts: Annotated[Path, Word("CSV: columns part, kind, error, value, unit (µm or arcsec).")]
    reducer: ReducerName = None
    torque: TestTorque = None
    starts: Annotated[int, Word("Mountings from which several units are improved."), whole("1 to 64", 1, 64)] = 4
    seed: Seed = 1

    def prepare(self) -> MountingRequest:
        """Return the parts and what is to be small."""
        from tolalloc.reducers.equivalent.model import EquivalentModel
        from tolalloc.reducers.reducer.design import at_torque
        from tolalloc.reducers.reducer.files import load_reducer
        from tolalloc.reducers.response.kernel import KernelResponse
        from tolalloc.wings.assembly.mounting import MountingRequest
        from tolalloc.wings.assembly.stock import PartStock, load_parts

        design = load_reducer(str(self.reducer))
        torque = design.torque_on_carrier(self.torque, "mounting")
        model, measured = EquivalentModel(at_torque(design, torque)), load_parts(self.parts, design)
        columns = tuple(name for name in model.columns if name not in design.modification.deviations)
        return MountingRequest(
            name=self.parts.stem,
            stock=PartStock(reducer=design, parts=measured, columns=columns),
            kernel=KernelResponse(model=model, torque=torque, columns=columns, fixed=design.modification.deviations),
            starts=self.starts,
            seed=self.seed,
        )

    def solve(self, prepared: MountingRequest, progress: Progress) -> Answer[MountingResult]:
        """Return who goes where, how it is turned there, and what that is worth beside chance."""
        from tolalloc.reducers.equivalent.model import OUTCOMES
        from tolalloc.wings.assembly.mounting import mount
        from tolalloc.wings.assembly.telling.mounting import MountingTeller

        record = RunRecord(progress, OUTCOMES)
        result = mount(prepared, record)
        header = Header(
            name=prepared.name,
            model=prepared.stock.reducer.name,
            seed=prepared.seed,
            conditions={"torque on the carrier [N·m]": result.torque},
            assumptions=prepared.stock.reducer.assumptions,
            statuses=record.counts,
            stages=record.stages,
        )
        return Answer(kind="mounting", header=header, result=result, told_by=MountingTeller)
