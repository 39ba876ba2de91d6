"""What to turn at every step of an assembly, what it leaves, and what tolerances cost then."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from tolalloc.exceptions import InputError
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress, RunRecord
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, Seed, Word

if TYPE_CHECKING:
    from tolalloc.wings.assembly.adjustment import AssemblyRequest, AssemblyResult


@dataclass(frozen=True, kw_only=True)
class Assemble(Inquiry["AssemblyRequest"]):
    """Plan how far parts are turned at assembly, what error remains, and which angular tolerances are cheapest."""

    word: ClassVar[str] = "assemble"
    example: ClassVar[str] = "tolalloc assemble mine/chain.toml --measured mine/angles.csv"
    by_position: ClassVar[int] = 1
    counted: ClassVar[str] = "assemblies"

    chain: Annotated[str, Word("Datum flow chain: shipped name or TOML file.")]
    measured: Annotated[Path | None, Word("CSV: columns part, 'x [arcsec]', 'y [arcsec]', 'z [arcsec]'.")] = None
    precision: Annotated[float | None, Word("Weight of the final angles against effort, in place of the chain's.")] = (
        None
    )
    seed: Seed = 1

    def prepare(self) -> AssemblyRequest:
        """Return the assembly with its files read and checked."""
        from tolalloc.wings.assembly.adjustment import AssemblyRequest
        from tolalloc.wings.assembly.files import load_errors, load_plan
        from tolalloc.wings.assembly.plan import LARGEST_STATE_WEIGHT

        if self.precision is not None and not 0 <= self.precision <= LARGEST_STATE_WEIGHT:
            raise InputError.of_argument(self.called, "precision", self.precision, f"0 to {LARGEST_STATE_WEIGHT:g}")
        plan = load_plan(self.chain)
        if self.precision is not None:
            plan = replace(plan, state_weight=self.precision)
        if self.measured is None:
            return AssemblyRequest(plan=plan, seed=self.seed)
        errors = load_errors(self.measured, plan)
        return AssemblyRequest(plan=plan, name=self.measured.stem, errors=errors, seed=self.seed)

    def room(self, prepared: AssemblyRequest) -> str:
        """Return the room that a chain with a reducer solves with."""
        return "equivalent" if prepared.plan.reducer else ""

    def solve(self, prepared: AssemblyRequest, progress: Progress) -> Answer[AssemblyResult]:
        """Return what is to be turned, what it leaves, what that does, and what tolerances cost."""
        return assembled(prepared, progress)


def assembled(request: AssemblyRequest, progress: Progress) -> Answer[AssemblyResult]:
    """Return the answer on an assembly; see `tolalloc.wings.assembly.adjustment.assemble`."""
    from tolalloc.reducers.equivalent.model import OUTCOMES
    from tolalloc.wings.assembly.adjustment import assemble
    from tolalloc.wings.assembly.telling.assembly import AssemblyTeller

    record = RunRecord(progress, OUTCOMES)
    result = assemble(request, record)
    effect, plan = result.transmission, request.plan
    header = Header(
        name=plan.name,
        model=effect.reducer.name if effect else "",
        seed=request.seed,
        assumptions=(*plan.assumptions, *(effect.reducer.assumptions if effect else ())),
        statuses=record.counts,
        stages=record.stages,
    )
    return Answer(kind="assembly", header=header, result=result, told_by=AssemblyTeller)
