"""Which sources dominate a population of units, which ones its curve does not tell apart, and why some come in pairs.

With two discs, two cranks and an even number of pins, a reducer turned by half a turn is the reducer again, its discs
and its cranks exchanged. No curve tells a unit from this twin, so the errors of discs and cranks come in pairs.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse.csgraph import connected_components

from tolalloc.capability.experiment import LARGEST_FAILED_SHARE
from tolalloc.exceptions import SolveError
from tolalloc.reducers.equivalent.sources import ErrorSource
from tolalloc.reducers.families.known import SOURCES
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.wings.bench.posterior import CurveProblem, LogDensity

_OTHER = {"1": "2", "2": "1"}
_PAST = {"disc1": 1, "disc2": -1}
"""Half teeth by which half a turn carries a disc past, or short of, the teeth of the other one [-]."""

_LINK = 0.9
"""Correlation from which on two columns replace one another [-]."""

_DRAWN = 8192
"""Units, and as many with all signs turned, that give the mean and spread of the columns to under a percent [-]."""


def exchanged(name: str) -> str:
    """Return the name that a source or column has in the unit turned by half a turn."""
    return re.sub(r"\b(disc|crank|journal|bore|planet|mesh)([12])\b", lambda part: part[1] + _OTHER[part[2]], name)


def _image(name: str, reducer: Reducer) -> str:
    """Return the column that a column becomes; of a wave, the one with the same function."""
    kind = SOURCES.of_column(name)
    if not kind.each:
        return exchanged(name)
    number = kind.member(name)
    count, past = kind.count(reducer), _past(kind, name)
    place = (int(name[number]) - 1 + (count + past) // 2) % count + 1
    return exchanged(name[: number.start] + str(place) + name[number.stop :])


def _past(kind: ErrorSource, name: str) -> int:
    """Return by how many half teeth half a turn carries what the name counts past, or short of, the other's [-]."""
    return _PAST.get(name.split(".")[0], 0) if kind.teeth else 0


def has_half_turn(reducer: Reducer, columns: Sequence[str]) -> bool:
    """Return whether half a turn carries the reducer into itself, as it does no pinion, and these columns too."""
    even = reducer.disc_count == 2 and reducer.crank_count == 2 and reducer.cycloid_stage.pin_count % 2 == 0
    even &= (reducer.form is None or not reducer.form.is_measured) and reducer.has_half_turn
    return even and {_image(name, reducer) for name in columns} == set(columns)


def half_turn(columns: Sequence[str], reducer: Reducer) -> Float[np.ndarray, "column column"]:
    """Return the matrix that takes a unit's columns to those of its twin [-].

    Theory page equation (50), for two discs, two cranks and an even number of pins. Vectors change sign. Tilts act by
    their height above the middle between the discs: the discs are exchanged, so height and vector both change sign and
    a tilt keeps its own. Pin k becomes pin k + zp/2, its place counted from its own radius; a wave of order h along the
    ring of pins or around a gear lags by hπ. A disc's own angle counts from a tooth, and half a turn is half a tooth
    off: tooth t of disc 1 becomes tooth t + (zc + 1)/2 of disc 2, of disc 2 tooth t + (zc − 1)/2 of disc 1, their waves
    lag by hπ(1 ± 1/zc), and two half turns are none. Sizes stay as they are.
    """
    where = {name: at for at, name in enumerate(columns)}
    matrix = np.zeros((len(columns), len(columns)))
    for at, name in enumerate(columns):
        to = where[_image(name, reducer)]
        wave = re.search(r"\.(cos|sin)(\d+)$", name)
        if wave is None:
            kind = SOURCES.of_column(name)
            matrix[to, at] = -1.0 if kind.shape == "vector" and kind.mirror == "reversed" else 1.0
            continue
        past = _past(SOURCES.of_column(name), name) / reducer.cycloid_stage.disc_teeth
        lag = int(wave[2]) * np.pi * (1.0 + past)
        other = where[exchanged(name[: wave.start()] + (".sin" if wave[1] == "cos" else ".cos") + wave[2])]
        matrix[to, at] = np.cos(lag)
        matrix[other, at] = np.sin(lag) if wave[1] == "cos" else -np.sin(lag)
    return matrix


def with_twins(
    problem: CurveProblem, deviations: Float[np.ndarray, "particle column"], generator: np.random.Generator
) -> Float[np.ndarray, "particle column"]:
    """Return the population with each unit exchanged for its twin with the probability that it is the twin.

    The drawings weigh unit and twin; their curves are one.
    """
    columns = problem.errors.columns
    if not has_half_turn(problem.kernel.model.reducer, columns):
        return deviations
    turned = deviations @ half_turn(columns, problem.kernel.model.reducer).T
    prior = _drawings(problem, generator)
    likelier = prior(turned) - prior(deviations) + problem.misfit_of(deviations) - problem.misfit_of(turned)
    twin = np.log(generator.random(len(deviations))) < -np.logaddexp(0.0, -likelier)
    return np.where(twin[:, np.newaxis], turned, deviations)


def _drawings(problem: CurveProblem, generator: np.random.Generator) -> LogDensity:
    """Return the density of the errors by their drawings, each distribution a normal one of its mean and spread."""
    numbers = generator.standard_normal((_DRAWN, problem.size))
    drawn = problem.deviations(np.concatenate([numbers, -numbers]))
    mean, spread = drawn.mean(axis=0), drawn.std(axis=0)
    inverse = np.linalg.pinv(problem.errors.normal_correlation)

    def density(deviations: Float[np.ndarray, "particle column"]) -> Float[np.ndarray, " particle"]:
        standard = (deviations - mean) / spread
        return np.asarray(-0.5 * np.einsum("sc,cd,sd->s", standard, inverse, standard))

    return density


def reductions(problem: CurveProblem, deviations: Float[np.ndarray, "unit column"]) -> Float[np.ndarray, "unit source"]:
    """Return by how much each unit's peak-to-peak falls when one source is put in the middle of its zone [arcsec].

    Theory page equation (49), whose greatest is the dominant source, for one source at a time. The readings of the
    problem play no part.
    """
    owner, middle = np.array(problem.errors.source_of_column), problem.deviations(np.zeros((1, problem.size)))
    names = list(dict.fromkeys(problem.errors.source_of_column))
    cases = [deviations, *(np.where(owner == name, middle, deviations) for name in names)]
    values = problem.kernel(np.concatenate(cases)).known.reshape(len(cases), -1)
    fall = (values[0] - values[1:]).T
    good = np.isfinite(fall).all(axis=1)
    if (~good).mean() > LARGEST_FAILED_SHARE:
        raise SolveError(f"{(~good).sum()} of {good.size} units have a curve that failed to solve.")
    return np.asarray(fall[good])


def dominant(fall: Float[np.ndarray, "unit source"]) -> Int[np.ndarray, " unit"]:
    """Return the position of the source without which each unit's peak-to-peak falls most [-]."""
    return np.asarray(fall.argmax(axis=1))


def named_set(probability: Float[np.ndarray, " source"], level: float) -> tuple[int, ...]:
    """Return the fewest sources that contain the dominant one with the probability asked for, likeliest first."""
    order = np.argsort(-probability, kind="stable")
    needed = int(np.searchsorted(np.cumsum(probability[order]), level - 1e-12)) + 1
    return tuple(order[:needed].tolist())


@dataclass(frozen=True, kw_only=True)
class InseparableColumns:
    """Columns that a curve does not tell apart, and what it tells of them together."""

    # Their names, and the names of their sources
    columns: tuple[str, ...]
    sources: tuple[str, ...]
    alone: Float[np.ndarray, " column"]  # Standard deviation of each over its standard deviation by the drawing [-]
    # The unit sum of columns, each over its standard deviation by the drawing, that is known best [-]
    combination: Float[np.ndarray, " column"]
    # Mean and standard deviation of that sum; by the drawings it has mean 0 and standard deviation 1 [-]
    value: float
    together: float


def groups(
    numbers: Float[np.ndarray, "particle column"], columns: tuple[str, ...], source_of_column: tuple[str, ...]
) -> tuple[InseparableColumns, ...]:
    """Return the columns whose errors replace one another in the curve.

    The numbers are standard normal ones that the curve allows, near one explanation; a correlation of either sign
    beyond 0.9 puts two columns together.
    """
    linked = np.abs(np.corrcoef(numbers.T)) >= _LINK
    count, label = connected_components(linked, directed=False)
    found = []
    for at in (np.flatnonzero(label == number) for number in range(count)):
        sources = tuple(dict.fromkeys(source_of_column[column] for column in at))
        if len(sources) < 2:
            continue
        value, vector = np.linalg.eigh(np.cov(numbers[:, at].T))
        found.append(
            InseparableColumns(
                columns=tuple(columns[column] for column in at),
                sources=sources,
                alone=numbers[:, at].std(axis=0),
                combination=vector[:, 0],
                value=float(numbers[:, at].mean(axis=0) @ vector[:, 0]),
                together=float(np.sqrt(max(value[0], 0.0))),
            )
        )
    return tuple(found)
