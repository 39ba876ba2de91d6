"""All readings of all units in one row, with their noise, and the blocks that they came in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from tolalloc.bench.measurement.files import Measurements
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND

PEAK_TO_PEAK, CURVE, LOOP = "peak-to-peak", "curve", "loop"
"""Kinds of readings."""


@dataclass(frozen=True, kw_only=True)
class ReadingBlock:
    """Readings that belong together."""

    kind: str  # `PEAK_TO_PEAK`, `CURVE` or `LOOP`
    number: int  # Which of the measured curves or loops; 0 for the peak-to-peaks [-]
    rows: slice  # Its readings among all
    centred: bool  # Whether its mean has been removed, from readings and model alike


@dataclass(frozen=True, kw_only=True)
class AllReadings:
    """All readings of all units in one row."""

    measured: Float[np.ndarray, " datum"]  # Readings [rad]
    noise: Float[np.ndarray, " datum"]  # Standard deviation of each; one arcsecond where nobody stated it [rad]
    unit: Int[np.ndarray, " datum"]  # Position of the unit that each belongs to [-]
    blocks: tuple[ReadingBlock, ...]  # Where they came from, in order
    noise_stated: bool  # Whether the noise was stated; if not, it is estimated from what the fit leaves

    @property
    def units(self) -> Int[np.ndarray, " unit"]:
        """Positions of the units that have readings."""
        return np.unique(self.unit)

    @property
    def peak_to_peak(self) -> slice | None:
        """Where the peak-to-peaks stand; none if there are none."""
        return next((block.rows for block in self.blocks if block.kind == PEAK_TO_PEAK), None)

    @property
    def only_peak_to_peak(self) -> bool:
        """Whether there is nothing else."""
        return all(block.kind == PEAK_TO_PEAK for block in self.blocks)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of readings that there are."""
        return tuple(dict.fromkeys(block.kind for block in self.blocks))

    def rows(self, kind: str) -> Int[np.ndarray, " row"]:
        """Return where the readings of one kind stand."""
        return np.concatenate(
            [np.arange(self.measured.size)[block.rows] for block in self.blocks if block.kind == kind]
        )


def centred(values: Float[np.ndarray, "..."], blocks: tuple[ReadingBlock, ...]) -> Float[np.ndarray, "..."]:
    """Return values, readings along the first axis, without the means of the blocks that have none."""
    found = np.array(values)
    for block in blocks:
        if block.centred:
            found[block.rows] -= found[block.rows].mean(axis=0)
    return found


def data_of(measurements: Measurements, place: str) -> AllReadings:
    """Return the readings of all units in one row; the place where they were read stands in errors.

    Raises
    ------
    InputError
        Some noise is stated and some is not, or kinds are mixed without any: their weights would be a guess.
    """
    parts = list(_parts(measurements))
    stated = [noise for *_, noise in parts]
    if len({part[0] for part in parts}) > 1 or any(noise is not None for noise in stated):
        without = [f"{kind} {number + 1}" for kind, number, _, _, noise in parts if noise is None]
        if without:
            raise InputError(
                f"{place}: noise_arcsec of {without[0]} is missing; readings of several kinds, or with and without "
                "it, cannot be weighed against each other."
            )
    blocks, start = [], 0
    for kind, number, values, _, _ in parts:
        rows = slice(start, start + values.size)
        blocks.append(ReadingBlock(kind=kind, number=number, rows=rows, centred=kind != PEAK_TO_PEAK))
        start = rows.stop
    noise = [np.full(values.size, ARCSECOND if own is None else own) for _, _, values, _, own in parts]
    return AllReadings(
        measured=centred(np.concatenate([values for _, _, values, _, _ in parts]), tuple(blocks)),
        noise=np.concatenate(noise),
        unit=np.concatenate([unit for _, _, _, unit, _ in parts]),
        blocks=tuple(blocks),
        noise_stated=all(noise is not None for noise in stated),
    )


_Part = tuple[str, int, Float[np.ndarray, " reading"], Int[np.ndarray, " reading"], float | None]


def _parts(measurements: Measurements) -> Iterator[_Part]:
    """Yield kind, number, readings, units and noise of everything that was measured."""
    found = measurements.peak_to_peak
    if found is not None:
        yield PEAK_TO_PEAK, 0, found.values, found.unit, found.noise
    for number, curve in enumerate(measurements.curves):
        values = curve.transmission_error
        yield CURVE, number, values, np.full(values.size, curve.unit), curve.noise
    for number, loop in enumerate(measurements.loops):
        yield LOOP, number, loop.twist, np.full(loop.twist.size, loop.unit), loop.noise
