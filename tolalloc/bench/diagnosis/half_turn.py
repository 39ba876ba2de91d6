"""The half turn: a unit and the same unit turned by half a turn have one and the same transmission error.

With two discs, two cranks and an even number of pins, a reducer turned by half a turn is the reducer again, its discs
and its cranks exchanged. No curve tells a unit from this twin, so the errors of discs and cranks come in pairs.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from tolalloc.bench.diagnosis.bridge import LogDensity
from tolalloc.bench.diagnosis.problem import CurveProblem
from tolalloc.rv.reducer.design import Reducer

_OTHER = {"1": "2", "2": "1"}
_PAST = {"disc1": 1, "disc2": -1}
"""Half teeth by which half a turn carries a disc past, or short of, the teeth of the other one [-]."""

_DRAWN = 8192
"""Units, and as many with all signs turned, that give the mean and spread of the columns to under a percent [-]."""


def exchanged(name: str) -> str:
    """Return the name that a source or column has in the unit turned by half a turn."""
    return re.sub(r"\b(disc|crank|journal|bore|planet|mesh)([12])\b", lambda part: part[1] + _OTHER[part[2]], name)


def _image(name: str, reducer: Reducer) -> str:
    """Return the column that a column becomes; of a wave, the one with the same function."""
    number = re.search(r"\.(\d+)(\.[xy])?$", name)
    if number is None:
        return exchanged(name)
    stage = reducer.cycloid_stage
    single_pin = name.startswith("each_pin.")
    count = stage.pin_count if single_pin else stage.disc_teeth
    past = 0 if single_pin else _PAST[name.split(".")[0]]
    place = (int(number[1]) - 1 + (count + past) // 2) % count + 1
    return exchanged(name[: number.start(1)] + str(place) + name[number.end(1) :])


def has_half_turn(reducer: Reducer, columns: Sequence[str]) -> bool:
    """Return whether half a turn carries the reducer into itself, and these columns among themselves."""
    even = reducer.disc_count == 2 and reducer.crank_count == 2 and reducer.cycloid_stage.pin_count % 2 == 0
    return even and {_image(name, reducer) for name in columns} == set(columns)


def half_turn(columns: Sequence[str], reducer: Reducer) -> Float[np.ndarray, "column column"]:
    """Return the matrix that takes a unit's columns to those of its twin [-].

    Parameters
    ----------
    columns
        Names of the columns.
    reducer
        The reducer; with these columns it has a half turn.

    Notes
    -----
    Vectors change sign. Tilts act by their height above the middle between the discs: the discs are exchanged, so
    height and vector both change sign and a tilt keeps its own. Pin k becomes pin k + zp/2, its place counted from its
    own radius; a wave of order h along the ring of pins or around a gear lags by hπ. A disc's own angle counts from a
    tooth, and half a turn is half a tooth off: tooth t of disc 1 becomes tooth t + (zc + 1)/2 of disc 2, of disc 2
    tooth t + (zc − 1)/2 of disc 1, their waves lag by hπ(1 ± 1/zc), and two half turns are none. Sizes stay as they
    are.
    """
    where = {name: at for at, name in enumerate(columns)}
    matrix = np.zeros((len(columns), len(columns)))
    for at, name in enumerate(columns):
        to = where[_image(name, reducer)]
        wave = re.search(r"\.(cos|sin)(\d+)$", name)
        if wave is None:
            kept = ".tilt." in name or name.startswith("each_pin.")
            matrix[to, at] = -1.0 if name.endswith((".x", ".y")) and not kept else 1.0
            continue
        past = _PAST.get(name.split(".")[0], 0) / reducer.cycloid_stage.disc_teeth
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
