"""The run folder: made only where nothing can be lost, filled once the study is finished."""

from __future__ import annotations

import json
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numba
import pandas as pd

from tolalloc.drawing.tolerance_table import table_frame
from tolalloc.exceptions import InputError
from tolalloc.progress import Record
from tolalloc.report import tables
from tolalloc.report.excel import write_workbook
from tolalloc.report.figures import study_figures
from tolalloc.report.folder import require_usable
from tolalloc.report.page import write_page
from tolalloc.report.plots import save_png
from tolalloc.report.results import StudyResults
from tolalloc.report.writer import write_json
from tolalloc.study.comparison import HIGH, LOW, TOTAL, FinishedRun
from tolalloc.study.definition import Prepared

_NEEDED = ("limit [arcsec]", "met", "yield [-]", "cost [cost units]")
_RANKED = ("source", "rank [-]", TOTAL, LOW, HIGH)
_ZONED = ("id", "unit", "plus [unit]", "minus [unit]", "cost [cost units]")
_LIBRARIES = ("numpy", "scipy", "numba", "cvxpy", "clarabel", "pymoo", "SALib", "pandas", "scikit-learn")


def manifest(prepared: Prepared, results: StudyResults, record: Record) -> dict[str, Any]:
    """Return what is needed to repeat the run and to trust it."""
    search = prepared.kernel.model.search
    return {
        "study": prepared.study.name,
        "study hash": prepared.hash,
        "seed": prepared.study.seed,
        "quick": results.quick,
        "versions": {"tolalloc": version("tolalloc"), "python": platform.python_version()}
        | {name: version(name) for name in _LIBRARIES},
        "threads": numba.get_num_threads(),
        "angles": {
            "coarse [-]": search.coarse,
            "tabulated per coarse [-]": search.nodes_per_coarse,
            "halvings [-]": search.levels,
            "accuracy": "peak-to-peak within 0.05 arcsec of the finest search for 99 % of random RV-20E units",
        },
        "statuses": record.counts,
        "stages": record.stages,
    }


def summary(results: StudyResults) -> dict[str, Any]:
    """Return the answer in a few numbers."""
    allocation, ranked = results.allocation, tables.ranking(results)
    chosen, surrogate = allocation.chosen, results.surrogate
    return {
        "reducer": results.reducer.name,
        "torque [N·m]": results.torque,
        "limit [arcsec]": results.limit,
        "yield target [-]": results.target,
        "met": chosen.met,
        "yield [-]": chosen.achieved.estimate,
        "yield interval 95 % [-]": [chosen.achieved.low, chosen.achieved.high],
        "yield lower bound, one-sided 95 % [-]": chosen.achieved.bound,
        "kept at the target yield [arcsec]": chosen.quantile_bound,
        "cost [cost units]": chosen.cost,
        "cost of uniform scaling [cost units]": allocation.by_hand.cost,
        "yield of uniform scaling [-]": allocation.by_hand.achieved.estimate,
        "uniform scaling met": allocation.by_hand.met,
        "saving [-]": allocation.saving,
        "saving if uniform scaling used the whole limit [-]": allocation.saving_at_least,
        "cost bound of the convex model [cost units]": allocation.bound,
        "optimality gap [-]": allocation.gap,
        "baseline yield [-]": allocation.baseline.achieved.estimate,
        "first sources": list(ranked["source"].head(5)),
        "design surrogate Q2 [-]": surrogate.q2,
        "design surrogate used": surrogate.earns_its_place,
        "identified stiffness": _stiffness(results),
        "torsional stiffness of the perfect reducer [N·m/arcmin]": results.torsional_stiffness,
        "warnings": list(results.warnings),
    }


def _stiffness(results: StudyResults) -> dict[str, Any] | None:
    """Return what not knowing the identified stiffnesses does, if there are any."""
    effect, sobol = results.stiffness, results.sobol
    if effect is None:
        return None
    at, first_order = sobol.sources.index(effect.source.name), effect.first_order
    return {
        "source": effect.source.name,
        "total index ST [-]": float(sobol.total[at]),
        "sigma of a unit [arcsec]": effect.sigma,
        "sigma of the mean [arcsec]": effect.sigma_of_mean,
        "first-order error at 2 sigma, rms [arcsec]": first_order.root_mean_square,
        "first-order error at 2 sigma, largest [arcsec]": first_order.largest,
        "effect at 2 sigma, rms [arcsec]": first_order.effect,
    }


def write_run(folder: Path, prepared: Prepared, results: StudyResults, record: Record) -> None:
    """Write all files of a finished study.

    Raises
    ------
    RunFolderError
        The folder is no longer empty.
    """
    require_usable(folder)
    (folder / "figures").mkdir()
    write_json(manifest(prepared, results, record), folder / "manifest.json")
    write_json(summary(results), folder / "summary.json")
    tables.ranking(results).to_csv(folder / "sensitivity.csv", index=False)
    table_frame(tables.allocated_sources(results), folder).to_csv(folder / "allocation.csv", index=False)
    tables.pareto(results).to_csv(folder / "pareto.csv", index=False)
    write_workbook(results, folder / "results.xlsx")
    for figure in study_figures(results):
        save_png(figure, folder / "figures" / f"{figure.name}.png")
    write_page(results, folder / "report.html")


def read_run(folder: Path) -> FinishedRun:
    """Return what a finished run's folder says.

    Raises
    ------
    InputError
        A file of the run is missing, broken or of another layout.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such run folder.")
    if (folder / "tables" / "ranking.csv").is_file():
        return _read_document(folder, "tables/ranking.csv", "tables/tolerances.csv")
    if (folder / "tables" / "shares.csv").is_file():
        return _read_document(folder, "tables/shares.csv", "allocation.csv")
    summaries = {name: _read_json(folder / f"{name}.json") for name in ("summary", "manifest")}
    return FinishedRun(
        name=str(summaries["manifest"].get("study", folder.name)),
        summary=_with(summaries["summary"], _NEEDED, folder / "summary.json"),
        manifest=summaries["manifest"],
        ranking=_read_table(folder / "sensitivity.csv", _RANKED),
        zones=_read_table(folder / "allocation.csv", _ZONED),
    )


def _read_document(folder: Path, ranking: str, zones: str) -> FinishedRun:
    """Return what the folder of ``tolalloc rank`` or ``tolalloc allocate`` says, with these two tables."""
    said, manifest = _read_json(folder / "summary.json"), _read_json(folder / "manifest.json")
    said = _with(said, ("study", "study hash", "quick", "limit [arcsec]", "yield [-]"), folder / "summary.json")
    return FinishedRun(
        name=str(said["study"]),
        summary=said,
        manifest={**manifest, "study hash": said["study hash"], "quick": said["quick"]},
        ranking=_read_table(folder / ranking, _RANKED),
        zones=_read_table(folder / zones, _ZONED),
    )


def _read_json(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; is {path.parent} the folder of a finished run?") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as JSON; is the file truncated? ({error}).") from None
    if not isinstance(found, dict):
        raise InputError(f"{path}: holds a {type(found).__name__}; allowed is what a run writes.")
    return found


def _read_table(path: Path, columns: tuple[str, ...]) -> pd.DataFrame:
    try:
        found = pd.read_csv(path)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; is {path.parent} the folder of a finished run?") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as a table ({' '.join(str(error).split())}).") from None
    _with(dict.fromkeys(found.columns), columns, path)
    return found


def _with(found: dict[str, Any], names: tuple[str, ...], path: Path) -> dict[str, Any]:
    """Return what was found, or say which name is missing."""
    for name in names:
        if name not in found:
            raise InputError(f"{path}: {name} is missing; the run is of another version, run the study again.")
    return found
