"""What came out: who goes where, how it is turned, and what that is worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.mounting.stock import Mountings, Stock


@dataclass(frozen=True, kw_only=True)
class Fitting:
    """One line of the fitter's list.

    Parameters
    ----------
    unit
        Number of the unit, from 1 [-].
    place
        Where in it.
    part
        What is written on the part.
    turn
        Bores of a carrier or disc, teeth of the sun, by which it is turned counter-clockwise against its own frame [-].
    """

    unit: int
    place: str
    part: str
    turn: int


@dataclass(frozen=True, kw_only=True)
class MountingResult:
    """The mounting that was found.

    Parameters
    ----------
    stock
        The parts.
    mountings
        Part and turn at every place of every unit.
    before, after
        Peak-to-peak of every unit with its parts as they come, infinite where it failed, and as found [arcsec].
    history
        Mean over the units after each step that improved it, from the start that led to the answer [arcsec].
    evaluations, failures
        Units evaluated, and those of them without an answer [-].
    """

    stock: Stock
    mountings: Mountings
    before: Float[np.ndarray, " unit"]
    after: Float[np.ndarray, " unit"]
    history: tuple[float, ...]
    evaluations: int
    failures: int

    @property
    def fittings(self) -> tuple[Fitting, ...]:
        """The fitter's list, unit by unit."""
        stock = self.stock
        return tuple(
            Fitting(
                unit=unit + 1,
                place=place.name,
                part=stock.parts[self.mountings[unit, at, 0]].name,
                turn=place.turns[self.mountings[unit, at, 1]].number,
            )
            for unit in range(stock.units)
            for at, place in enumerate(stock.places)
        )


@dataclass(frozen=True, kw_only=True)
class RandomMountings:
    """What the same parts do when nobody chooses.

    Parameters
    ----------
    peak_to_peaks
        Peak-to-peak of every unit of every mounting, infinite where it failed [arcsec].
    failures
        Units without an answer [-].
    every
        Whether these are all mountings there are, each once.
    """

    peak_to_peaks: Float[np.ndarray, "mounting unit"]
    failures: int
    every: bool

    @property
    def means(self) -> Float[np.ndarray, " mounting"]:
        """Mean over the units of each mounting without failures [arcsec]."""
        means = self.peak_to_peaks.mean(axis=1)
        return np.asarray(means[np.isfinite(means)])

    @property
    def mean(self) -> float:
        """Mean over the mountings [arcsec]."""
        return float(self.means.mean())

    @property
    def median(self) -> float:
        """Median over the mountings [arcsec]."""
        return float(np.median(self.means))

    @property
    def best(self) -> float:
        """Smallest mean over the units that was met [arcsec]."""
        return float(self.means.min())

    @property
    def worst(self) -> float:
        """Largest mean over the units that was met [arcsec]."""
        return float(self.means.max())
