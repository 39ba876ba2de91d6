"""What the folders of finished runs say, read back: one, two side by side, or a series."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from tolalloc.allocation.space.requirement import OwnLimit
from tolalloc.capability.monte_carlo import Yield
from tolalloc.drawings.tolerance_table import heads_of
from tolalloc.exceptions import InputError
from tolalloc.reading.file_content import is_file, read_text
from tolalloc.reading.units import in_cost_units, unit_of
from tolalloc.reports.wording import quantity

if TYPE_CHECKING:
    import pandas as pd

TOTAL, LOW, HIGH = "total index ST [-]", "ST low 5 % [-]", "ST high 95 % [-]"
_YIELD, _OF_ALL = "yield of {} [-]", "all limits"
_RANKED = ("dimension", "rank [-]", TOTAL, LOW, HIGH)
_LIMITS = ("limit", "lower limit")
_REQUIRED, _LIMITED = ("limit", "shown for"), ("LSL", "USL")
_ZONED = ("id", "unit", "plus [unit]", "minus [unit]", "cost [cost units]")


@dataclass(frozen=True, kw_only=True)
class FinishedRun:
    """What a run folder says."""

    name: str  # That of its study
    folder: Path  # Its folder, as it was named
    # Answers of all its questions in one, and circumstances, units in the names
    summary: dict[str, Any]
    manifest: dict[str, Any]
    ranking: pd.DataFrame  # Dimensions, or sources, largest total index first
    zones: pd.DataFrame  # The allocated tolerance table, or the one that was ranked

    @property
    def currency(self) -> str:
        """What its costs are in; empty where they are cost units, as in runs of versions that knew no other."""
        return str(self.manifest.get("currency", ""))

    @property
    def yields(self) -> dict[str, float]:
        """Limited output → share of units that keep its limits, the leading one first; none with one limit alone."""
        begin, end = _YIELD.split("{}")
        found = {name[len(begin) : -len(end)]: own for name, own in self.summary.items() if name.startswith(begin)}
        found.pop(_OF_ALL, None)
        return found

    @property
    def joint(self) -> float | None:
        """Share of units that keep all limits at once; none where the run does not say it."""
        return self.summary.get(_YIELD.format(_OF_ALL))

    @property
    def limits(self) -> dict[str, float]:
        """Limits of the leading output by the names that the summary gives them, the upper one first."""
        return {name: value for name, value in self.summary.items() if name.startswith(_LIMITS)}

    @property
    def requirements(self) -> dict[str, tuple[object, ...]]:
        """Output → its limits and what was to be shown, as an allocation says them, or its limits in a ranking.

        A limit that the model has of its own is nobody's question: it is what the drawn settings make it.
        """
        said = _REQUIRED if self.allocates else _LIMITED
        asked = (row for row in self._required if row.get("stated by") != OwnLimit.stated_by)
        return {str(row["requirement"]): tuple(row.get(name) for name in said) for row in asked}

    @property
    def allocates(self) -> bool:
        """Whether its requirements are those of an allocation, which says what was to be shown."""
        return any(_REQUIRED[0] in row for row in self._required)

    @property
    def _required(self) -> list[dict[str, object]]:
        return self.summary.get("requirements") or []


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Two finished runs side by side, in the order in which they were named."""

    first: FinishedRun
    second: FinishedRun

    @property
    def runs(self) -> tuple[FinishedRun, FinishedRun]:
        """Both runs."""
        return self.first, self.second

    @property
    def same_question(self) -> bool:
        """Whether both were asked for the same reducer or model, torque, limits and yield."""
        asked = ("reducer", "model", "torque [N·m]", "yield target [-]", *self.first.limits, *self.second.limits)
        if any(self.first.summary.get(name) != self.second.summary.get(name) for name in asked):
            return False
        first, second = (run.requirements for run in self.runs)
        unsaid = not (first and second) or self.first.allocates != self.second.allocates
        return unsaid or first == second

    @property
    def same_versions(self) -> bool:
        """Whether both ran with the same versions of the program and its libraries."""
        return self.first.manifest.get("versions") == self.second.manifest.get("versions")

    @property
    def same_study(self) -> bool:
        """Whether both are runs of one and the same study, seed included."""
        return self.first.manifest.get("study hash") == self.second.manifest.get("study hash")


@dataclass(frozen=True, kw_only=True)
class Member:
    """One study of a series and what became of it."""

    name: str  # Its name
    folder: Path  # Its run folder
    found: FinishedRun | None = None  # What the folder says; none if it could not be run
    fault: str = ""  # Why it could not be run, in a sentence

    @property
    def met(self) -> bool | None:
        """Whether its allocation keeps its limits; none without an allocation."""
        met = self.found.summary.get("met") if self.found else None
        return None if met is None else bool(met)

    @property
    def verdict(self) -> str:
        """What became of it, in a word."""
        if self.found is None:
            return f"not run: {self.fault}"
        return {None: "ranked", True: "met", False: "NOT met"}[self.met]


def told_yields(each: Mapping[str, Yield], joint: Yield) -> dict[str, float]:
    """Return what a summary says of several limits: the share of units that keep each, and all at once."""
    several = each if len(each) > 1 else {}
    shares = {_YIELD.format(quantity(output)): own.estimate for output, own in several.items()}
    return {**shares, _YIELD.format(_OF_ALL): joint.estimate}


def common_currency(runs: Iterable[FinishedRun]) -> str:
    """Return the one currency of several runs; empty where they have none or several."""
    stated = {run.currency for run in runs}
    return stated.pop() if len(stated) == 1 else ""


def read_run(folder: Path) -> FinishedRun:
    """Return what a finished run's folder says."""
    if not folder.is_dir():
        raise InputError(f"{folder}: no such run folder.")
    said, manifest = _read_json(folder / "summary.json"), _read_json(folder / "manifest.json")
    answers = [said[kind] for kind in ("ranking", "allocation") if isinstance(said.get(kind), dict)]
    if len(answers) > 1:  # a ranking speaks of the limit that most units miss, an allocation of the first
        answers[0] = {name: value for name, value in answers[0].items() if not name.startswith((*_LIMITS, "yield of "))}
    if not answers:
        raise InputError(f"{folder / 'summary.json'}: it holds neither a ranking nor an allocation.")
    summary = {name: value for answer in answers for name, value in answer.items()}
    summary = _with(summary, ("study", "study hash", "quick", "yield [-]"), folder / "summary.json")
    if not any(name.startswith(_LIMITS) for name in summary):
        raise InputError(f"{folder / 'summary.json'}: its limit is missing; the run is of another version.")
    ranked = "ranking" if "ranking" in said else "shares"
    zones = "allocation.csv" if "allocation" in said else "tables/tolerances.csv"
    return FinishedRun(
        name=str(summary["study"]),
        folder=folder,
        summary=summary,
        manifest=manifest,
        ranking=_read_table(folder / "tables" / f"{ranked}.csv", _RANKED, {"source": _RANKED[0]}),
        zones=_read_table(folder / zones, _ZONED),
    )


def _text(path: Path, what: str) -> str:
    if not is_file(path):
        raise InputError(f"{path}: no such file; is {path.parent} the folder of a finished run?")
    return read_text(path, what)


def _read_json(path: Path) -> dict[str, Any]:
    text = _text(path, "a text file in JSON")
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: cannot be read as JSON; is the file truncated? ({error}).") from None
    if not isinstance(found, dict):
        raise InputError(f"{path}: holds a {type(found).__name__}; allowed is what a run writes.")
    return found


def _read_table(path: Path, columns: tuple[str, ...], called: Mapping[str, str] = MappingProxyType({})) -> pd.DataFrame:
    """Return a table with these columns, some of which may be called otherwise in it."""
    import pandas as pd

    text = "".join(line for line in StringIO(_text(path, "a table in CSV")) if not line.startswith("#"))
    try:
        found = pd.read_csv(StringIO(text)).rename(columns=heads_of(path).meant)
    except ValueError as error:
        raise InputError(f"{path}: cannot be read as a table ({' '.join(str(error).split())}).") from None
    found = found.rename(columns=_with_cost_units).rename(columns=called)
    _with(dict.fromkeys(found.columns), columns, path)
    return found


def _with_cost_units(header: str) -> str:
    """Return the header of a column under the name that every run's has, whatever its costs are in."""
    unit = unit_of(header)
    return header.replace(f"[{unit}]", f"[{in_cost_units(unit)}]")


def finished(folders: Iterable[Path]) -> list[FinishedRun]:
    """Return what those folders say that hold a finished run, in their order."""
    found = []
    for folder in folders:
        with suppress(InputError):
            found.append(read_run(folder))
    return found


def _with(found: dict[str, Any], names: tuple[str, ...], path: Path) -> dict[str, Any]:
    """Return what was found, or say which name is missing."""
    for name in names:
        if name not in found:
            raise InputError(f"{path}: {name} is missing; the run is of another version, run the study again.")
    return found
