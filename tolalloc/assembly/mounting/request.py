"""From measured parts to the units that are best built from them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from tolalloc.assembly.mounting.answer import MountingAnswer
from tolalloc.assembly.mounting.search import best_mounting, random_mounting
from tolalloc.assembly.mounting.stock import PartStock, load_parts
from tolalloc.drawings.seeds import SeedTree, require_seed
from tolalloc.exceptions import InputError
from tolalloc.reducers.equivalent.answers import OUTCOMES
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.reducer.series import at_torque
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress, RunRecord

MOST_STARTS = 64


@dataclass(frozen=True, kw_only=True)
class MountingRequest:
    """Which parts are to be mounted."""

    name: str  # Where the parts come from
    stock: PartStock  # The parts
    kernel: KernelResponse  # What is to be small
    starts: int = 4  # Mountings from which several units are improved [-]
    seed: int = 1  # Seed of every random number [-]


def prepare_mounting(
    parts: Path, reducer: str = "rv20e", torque_nm: float | None = None, starts: int = 4, seed: int = 1
) -> MountingRequest:
    """Return the parts with their CSV file read and checked, for the reducer of a preset or TOML file.

    The torque on the carrier is the reducer's test torque unless given, negative where it resists the rotation [N·m].

    Raises
    ------
    InputError, UnknownNameError
        The argument, or the file, row, field and value that are not allowed.
    """
    require_seed("mounting", seed)
    if not 1 <= starts <= MOST_STARTS:
        raise InputError.of_argument("mounting", "starts", starts, f"1 to {MOST_STARTS}")
    design = load_reducer(reducer)
    torque = design.torque_on_carrier(torque_nm, "mounting")
    model, measured = EquivalentModel(at_torque(design, torque)), load_parts(parts, design)
    columns = tuple(name for name in model.columns if name not in design.modification.deviations)
    return MountingRequest(
        name=parts.stem,
        stock=PartStock(reducer=design, parts=measured, columns=columns),
        kernel=KernelResponse(model=model, torque=torque, columns=columns, fixed=design.modification.deviations),
        starts=starts,
        seed=seed,
    )


def mount(request: MountingRequest, progress: Progress) -> MountingAnswer:
    """Return who goes where, how it is turned there, and what that is worth beside chance.

    Raises
    ------
    SolveError
        Too many units have no answer.
    """
    record, seeds = RunRecord(progress, OUTCOMES), SeedTree(request.seed).child("mounting")
    kernel, stock = replace(request.kernel, observe=record.observe), request.stock
    with record.stage("search"):
        found = best_mounting(stock, kernel, seeds.child("search"), request.starts)
    with record.stage("chance"):
        chance = random_mounting(stock, kernel, max(found.evaluations // stock.units, 1), seeds.child("chance"))
    return MountingAnswer(
        header=Header(
            name=request.name,
            model=stock.reducer.name,
            seed=request.seed,
            conditions={"torque on the carrier [N·m]": kernel.torque},
            assumptions=stock.reducer.assumptions,
            statuses=record.counts,
            stages=record.stages,
        ),
        torque=kernel.torque,
        found=found,
        chance=chance,
    )
