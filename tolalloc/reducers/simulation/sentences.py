"""What a simulation says, in sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tolalloc.reading.units import ARCSECOND, DEGREE, RPM

if TYPE_CHECKING:
    from tolalloc.reducers.simulation.answer import SimulationAnswer

COARSE = 20
"""Time steps per pin pass below which a wave is not drawn well [-]."""
ALTERNATING = 0.05
"""Amplitude from step to step over the static peak-to-peak, above which it is not the reducer's [-]."""
UNCLOSED = 1e-3
"""Power that leaves over power that enters, less one, above which the run has not settled or the engine errs [-]."""
UNSETTLED = 0.1
"""Change of the deviation from the static model between both halves, over the larger, above which it decays [-]."""
READ = 0.02 * ARCSECOND
"""Deviation that is too small to matter [rad]."""
NEAR = 1.25
"""Ratio of an excitation to the lowest natural frequency, up or down, that counts as near [-]."""
TURNING_BACK = -0.45
"""Correlation of successive changes below which a quantity turns back at every step; −0.5 has noise [-]."""


def range_text(least: int, most: int) -> str:
    """Return a range of counts as people write it."""
    return f"{least}" if least == most else f"{least}…{most}"


def sentences(results: SimulationAnswer) -> tuple[str, ...]:
    """Return the answer in a few sentences."""
    moving, resting = results.largest_force
    spans, spans_at_rest = (span / ARCSECOND for span in results.peak_to_peak)
    difference = results.difference / ARCSECOND
    counts = "; ".join(f"disc {disc + 1}: {range_text(*both)}" for disc, both in enumerate(results.contacts))
    begins = results.series.time[results.steady.start - 1]
    turns = f"{results.crank_turns} whole crank turn{'s' if results.crank_turns > 1 else ''}"
    return (
        f"In the last {turns}, from {begins:.3f} s on, the output turns at {results.output_speed / RPM:.4f} rpm, "
        f"a ratio of {results.ratio:.4f}; of {results.input_power:.1f} W that enter, "
        f"{100 * results.output_power / results.input_power:.3f} % leave at the output.",
        f"Pins in contact: {counts}, a matter of how stiff a pin contact is: {_contact(results)}. "
        f"The largest pin force is {moving:.1f} N, in the static model {resting:.1f} N.",
        f"The transmission error spans {spans:.3g}″ over {results.span / DEGREE:.1f}° of the carrier, in the static "
        f"model at the same angles and torque {spans_at_rest:.3g}″; the two differ by {_rms(difference):.2g}″ rms and "
        f"{np.abs(difference).max():.2g}″ at most.",
        _cause(results),
    )


def _contact(results: SimulationAnswer) -> str:
    """Return what the pin contacts are."""
    stiffness = results.reducer.stiffness
    if stiffness.pin_contact_law == "logarithmic":
        return f"steel line contact over {results.reducer.cycloid_stage.face_width * 1e3:g} mm"
    return f"{stiffness.pin_contact:.3g} N/m by the {stiffness.pin_contact_law} law"


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _cause(results: SimulationAnswer) -> str:
    """Return what the difference comes from."""
    excited = f"The discs pass a pin {results.pin_pass:.1f} times per second"
    if results.natural_frequency is None:
        nearest = f"{excited}; natural frequencies are given for pin contacts of constant stiffness without play only"
    else:
        near = [
            name for name, often in _excitations(results).items() if 1 / NEAR < often / results.natural_frequency < NEAR
        ]
        verdict = f"near {' and '.join(near)}" if near else "away from the orders that errors and pins excite"
        nearest = f"{excited}, the lowest natural frequency is {results.natural_frequency:.0f} Hz, {verdict}"
    if results.engine == "exudyn":
        return (
            f"{nearest}. The prototype has the exact tooth profile and an ideal first stage, which does not feel "
            "planets that yield on their bearings; the static model has the linear gap and feels them. So what they "
            "differ by is not motion alone."
        )
    return f"{nearest}. Both have the same gaps and springs, so what they differ by is motion alone."


def _excitations(results: SimulationAnswer) -> dict[str, float]:
    """Return how often per second the strong orders of the output turn come by [Hz]."""
    stage, turn = results.reducer.cycloid_stage, results.speed / (2 * np.pi) / results.reducer.ratio
    orders = {1, stage.disc_teeth, stage.pin_count, 2 * stage.disc_teeth, 2 * stage.pin_count}
    found = {f"order {order}": order * turn for order in sorted(orders)}
    return found | {f"{times} times the pin pass": times * results.pin_pass for times in (1, 2, 3)}


def unsettled(results: SimulationAnswer) -> bool:
    """Return whether what motion adds still decays, or power does not close."""
    first, second = np.array_split(results.difference, 2)
    one, other = (np.ptp(half) for half in (first, second))
    decays = abs(one - other) > max(UNSETTLED * max(one, other), READ)
    return bool(decays) or abs(results.output_power / results.input_power - 1) > UNCLOSED


def ringing(results: SimulationAnswer) -> str:
    """Return what vibrates too fast for the time step; empty if nothing does."""
    error = results.series.transmission_error[results.steady]
    change = np.diff(results.series.output_acceleration[results.steady])
    if _rms(np.diff(error, 2)) / 4 > ALTERNATING * results.peak_to_peak[1]:
        return "the transmission error"
    return "the output acceleration" if (change[1:] * change[:-1]).sum() < TURNING_BACK * (change**2).sum() else ""


def warnings(results: SimulationAnswer) -> tuple[str, ...]:
    """Return what a reader must know before acting on it."""
    found, step = [], f"{results.step:.3g} s"
    if what := ringing(results):
        found.append(
            f"Do not use {what}: it vibrates with only a few steps of {step} per wave, which the integrator makes; "
            "take a shorter --step or more damping."
        )
    if unsettled(results):
        found.append(
            "The last crank turns are not steady: the deviation from the static model changes between their halves, or "
            "power does not close. Ratio, power, forces and spans are those of a transient; take a longer --duration, "
            "a shorter --step, or more damping."
        )
    if (passes := 1 / (results.pin_pass * results.step)) < COARSE:
        found.append(f"A step of {step} is {1 / passes:.2g} of a pin pass; waves of the pin contacts are cut off.")
    if results.span < 2 * np.pi and results.header.name != "exact":
        turn = 2 * np.pi / results.output_speed
        found.append(
            f"The steady part spans {results.span / DEGREE:.1f}° of the carrier; a peak-to-peak with errors "
            f"needs the whole output turn, which takes {turn:.1f} s; ratio, speed and power beyond three digits do too."
        )
    return tuple(found)
