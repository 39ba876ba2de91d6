"""The report on a simulated reducer."""

from __future__ import annotations

from typing import Any

from tolalloc.report.document import Document, Section
from tolalloc.rv.simulation.answer.figures import error_figure, run_figures
from tolalloc.rv.simulation.answer.results import SimulationResults
from tolalloc.rv.simulation.answer.sentences import answer, warnings
from tolalloc.rv.simulation.answer.tables import rest_row, steady_row, steady_table
from tolalloc.units import RPM


def summary(results: SimulationResults) -> dict[str, Any]:
    """Return the answer for a program, units in the names."""
    return {
        "reducer": results.reducer.name,
        "unit": results.unit,
        "input speed [rpm]": results.speed / RPM,
        "load on the carrier [N·m]": results.load,
        "duration [s]": float(results.series.time[-1]),
        "step [s]": results.step,
        "crank turns of the steady part [-]": results.crank_turns,
        "input power [W]": results.input_power,
        "output power [W]": results.output_power,
        "pin pass [Hz]": results.pin_pass,
        "lowest natural frequency [Hz]": results.natural_frequency,
        "in motion": steady_row(results),
        "at rest": rest_row(results),
        "warnings": list(warnings(results)),
        "assumptions": list(results.assumptions),
    }


def simulation_document(results: SimulationResults) -> Document:
    """Return the report."""
    return Document(
        title=f"{results.reducer.name} in motion",
        subtitle=(
            f"unit {results.unit}, {results.speed / RPM:g} rpm at the input, {results.load:g} N·m against rotation, "
            f"{results.engine}, {results.series.time.size - 1} steps of {results.step:.3g} s"
        ),
        answer=answer(results),
        warnings=warnings(results),
        sections=(
            Section(
                heading="The last whole crank turns",
                paragraphs=("At rest is the static model at the same carrier angles and torque.",),
                figures=(error_figure({results.engine: results}, passes=20),),
                tables=(("steady", steady_table(results)),),
            ),
            Section(
                heading="The whole run",
                paragraphs=(
                    "Lines show the least and the most of every stretch; series.csv beside this page has every step.",
                ),
                figures=run_figures(results),
            ),
        ),
        assumptions=results.assumptions,
        summary=summary(results),
    )
