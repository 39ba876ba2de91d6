"""What a simulation says, in sentences."""

from __future__ import annotations

import numpy as np

from tolalloc.report.simulation.results import RPM, SimulationResults
from tolalloc.report.simulation.tables import range_text
from tolalloc.units import ARCSECOND, DEGREE

COARSE = 20
"""Time steps per pin pass below which a wave is not drawn well [-]."""
ALTERNATING = 0.05
"""Amplitude from step to step over the static peak-to-peak, above which it is not the reducer's [-]."""
TURNING_BACK = -0.45
"""Correlation of successive changes below which a quantity turns back at every step; −0.5 has noise [-]."""


def answer(results: SimulationResults) -> tuple[str, ...]:
    """Return the answer in a few sentences."""
    moving, resting = results.largest_force
    spans, spans_at_rest = (span / ARCSECOND for span in results.peak_to_peak)
    difference = results.difference / ARCSECOND
    counts = "; ".join(f"disc {disc + 1}: {range_text(*both)}" for disc, both in enumerate(results.contacts))
    begins = results.series.time[results.steady.start - 1]
    return (
        f"In the steady part from {begins:.3f} s on, {results.crank_turns} whole crank turns, the output turns at "
        f"{results.output_speed / RPM:.4f} rpm, a ratio of {results.ratio:.4f}; of {results.input_power:.1f} W that "
        f"enter, {100 * results.output_power / results.input_power:.3f} % leave at the output.",
        f"Pins in contact: {counts}. The largest pin force is {moving:.1f} N, in the static model {resting:.1f} N.",
        f"The transmission error spans {spans:.3g}″ over {results.span / DEGREE:.1f}° of the carrier, in the static "
        f"model at the same angles and torque {spans_at_rest:.3g}″; the two differ by {_rms(difference):.2g}″ rms and "
        f"{np.abs(difference).max():.2g}″ at most.",
        _cause(results),
    )


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _cause(results: SimulationResults) -> str:
    """Return what the difference comes from."""
    excited = f"The discs pass a pin {results.pin_pass:.1f} times per second"
    if results.natural_frequency is None:
        nearest = f"{excited}; natural frequencies are given for pin contacts of constant stiffness without play only"
    else:
        apart = results.natural_frequency / results.pin_pass
        verdict = (
            "far below any resonance" if apart > 3 else "near a resonance" if apart > 1 / 3 else "above the lowest one"
        )
        nearest = (
            f"{excited}, the lowest natural frequency is {results.natural_frequency:.0f} Hz, {apart:.3g} times that: "
            f"{verdict}"
        )
    if results.engine == "exudyn":
        return (
            f"{nearest}. The prototype has the exact tooth profile and the static model the linear gap, so what they "
            "differ by is not motion alone."
        )
    return f"{nearest}. Both have the same gaps and springs, so what they differ by is inertia and damping alone."


def ringing(results: SimulationResults) -> str:
    """Return what vibrates too fast for the time step; empty if nothing does."""
    error = results.series.transmission_error[results.steady]
    change = np.diff(results.series.output_acceleration[results.steady])
    if _rms(np.diff(error, 2)) / 4 > ALTERNATING * results.peak_to_peak[1]:
        return "the transmission error"
    return "the output acceleration" if (change[1:] * change[:-1]).sum() < TURNING_BACK * (change**2).sum() else ""


def warnings(results: SimulationResults) -> tuple[str, ...]:
    """Return what a reader must know before acting on it."""
    found, step = [], f"{results.step:.3g} s"
    if what := ringing(results):
        found.append(
            f"Do not use {what}: it vibrates with only a few steps of {step} per wave, which the integrator makes; "
            "take a shorter --step or more damping."
        )
    if (passes := 1 / (results.pin_pass * results.step)) < COARSE:
        found.append(f"A step of {step} is {1 / passes:.2g} of a pin pass; waves of the pin contacts are cut off.")
    if results.span < 2 * np.pi and results.unit != "exact":
        turn = 2 * np.pi / results.output_speed
        found.append(
            f"The steady part spans {results.span / DEGREE:.1f}° of the carrier; a peak-to-peak with errors "
            f"needs the whole output turn, which takes {turn:.1f} s."
        )
    return tuple(found)
