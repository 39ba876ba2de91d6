"""From measured parts to the units that are best built from them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from tolalloc.assembly.mounting.answer import MountingResults
from tolalloc.assembly.mounting.parts import MeasuredPart
from tolalloc.assembly.mounting.parts_file import load_parts
from tolalloc.assembly.mounting.search import best_mounting, random_mounting
from tolalloc.assembly.mounting.stock import Stock
from tolalloc.drawing.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.progress import Progress, Record
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.equivalent.status import OUTCOMES
from tolalloc.rv.reducer.files import load_reducer
from tolalloc.rv.response.kernel import KernelResponse

MOST_STARTS = 64


@dataclass(frozen=True, kw_only=True)
class MountingStudy:
    """Which parts are to be mounted.

    Parameters
    ----------
    parts
        CSV file with the columns ``part, kind, error, value, unit``.
    reducer
        Preset or TOML file.
    torque_nm
        Torque on the carrier; the reducer's test torque unless given [N·m].
    starts
        Mountings from which several units are improved [-].
    seed
        Seed of every random number [-].

    Raises
    ------
    InputError
        A number of starts or a seed out of range.
    """

    parts: Path
    reducer: str = "rv20e"
    torque_nm: float | None = None
    starts: int = 4
    seed: int = 1

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise InputError.at("tolalloc mount", "--seed", self.seed, "0 or a positive integer")
        if not 1 <= self.starts <= MOST_STARTS:
            raise InputError.at("tolalloc mount", "--starts", self.starts, f"1 to {MOST_STARTS}")


@dataclass(frozen=True, kw_only=True)
class PreparedMounting:
    """Checked parts.

    Parameters
    ----------
    asked
        What was asked.
    stock
        The parts.
    kernel
        What is to be small.
    """

    asked: MountingStudy
    stock: Stock
    kernel: KernelResponse


def prepare_mounting(asked: MountingStudy) -> PreparedMounting:
    """Return the parts with their file read and checked.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    """
    reducer = load_reducer(asked.reducer)
    torque = reducer.torque_on_carrier(asked.torque_nm, "tolalloc mount")
    model, parts = EquivalentModel(reducer), load_parts(asked.parts, reducer)
    columns = tuple(name for name in model.columns if name not in reducer.modification.deviations)
    kernel = KernelResponse(model=model, torque=torque, columns=columns, fixed=reducer.modification.deviations)
    return PreparedMounting(asked=asked, stock=_stock(kernel, parts), kernel=kernel)


def _stock(kernel: KernelResponse, parts: tuple[MeasuredPart, ...]) -> Stock:
    return Stock(reducer=kernel.model.reducer, parts=parts, columns=kernel.columns)


def mount(prepared: PreparedMounting, progress: Progress) -> MountingResults:
    """Return who goes where, how it is turned there, and what that is worth beside chance.

    Parameters
    ----------
    prepared
        The parts.
    progress
        Told how far the work has come.

    Raises
    ------
    SolveError
        Too many units have no answer.
    """
    record, seeds = Record(progress, OUTCOMES), SeedTree(prepared.asked.seed).child("mounting")
    kernel, stock = replace(prepared.kernel, observe=record.observe), prepared.stock
    with record.stage("search"):
        found = best_mounting(stock, kernel, seeds.child("search"), prepared.asked.starts)
    with record.stage("chance"):
        chance = random_mounting(stock, kernel, max(found.evaluations // stock.units, 1), seeds.child("chance"))
    return MountingResults(
        name=prepared.asked.parts.stem,
        torque=kernel.torque,
        found=found,
        chance=chance,
        seed=prepared.asked.seed,
    )
