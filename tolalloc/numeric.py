"""Plain functions of numbers and arrays for scripts of your own: no files, no reports, and promised not to move.

Everything is in SI units [m, rad, N, N·m]; a row of an array is a sample. Names, parameters and defaults of these
functions stay as they are through all versions of this package, as do the worked numbers in their examples.

>>> from tolalloc import numeric
>>> round(numeric.peak_to_peak(numeric.reducer("rv20e_liu2020"), {"housing.pitch.cos2": 6e-6}) * 206264.8, 1)  # [″]
32.0
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.files import read_toml, shipped_or_path, validated
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.design import Reducer, at_torque
from tolalloc.reducers.reducer.files import PRESETS
from tolalloc.reducers.reducer.records import ReducerRecord

__all__ = [
    "Clearance",
    "Contact",
    "Extremes",
    "FailureProbability",
    "SobolIndices",
    "Zones",
    "adjusted_errors",
    "allocate",
    "clearance",
    "columns",
    "contact",
    "deviations",
    "extremes",
    "failure_probability",
    "peak_to_peak",
    "radial_clearance",
    "reducer",
    "regulator",
    "sobol",
    "transmission_error",
]

Deviations = Mapping[str, Any] | Float[np.ndarray, "sample column"]
"""Deviations by name, each a number or an array of one number for every sample, or rows as `deviations` gives them."""


def reducer(design: str | Mapping[str, Any] = "rv20e", changes: Mapping[str, Any] | None = None) -> Reducer:
    """Return a reducer from a preset, or from values as a reducer file has them.

    Parameters
    ----------
    design
        Name of a preset, path of a reducer file, or the content of such a file as nested dictionaries.
    changes
        Field of the file → value instead of its own, units as its name says, such as
        ``{"cycloid_stage.eccentricity_mm": 0.85}``.

    Returns
    -------
    Reducer
        Frozen, in SI units; what every other function takes.

    Raises
    ------
    InputError, UnknownNameError
        A preset, field or value that is not allowed.

    Examples
    --------
    >>> reducer("rv20e", {"cycloid_stage.eccentricity_mm": 0.85}).cycloid_stage.eccentricity
    0.00085
    """
    if isinstance(design, Mapping):
        place, data = "reducer", _copied(design)
    else:
        place = str(path := shipped_or_path(design, PRESETS, ".reducer.toml", "reducer"))
        data = read_toml(path)
    for name, value in (changes or {}).items():
        *tables, last = name.split(".")
        inner = data
        for table in tables:
            inner = inner.setdefault(table, {})
            if not isinstance(inner, dict):
                raise UnknownNameError.among(place, "table", table, data)
        inner[last] = value
    return validated(ReducerRecord, data, place).reducer()


def _copied(design: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _copied(value) if isinstance(value, Mapping) else value for name, value in design.items()}


@lru_cache(maxsize=4)
def _model(design: Reducer) -> EquivalentModel:
    return EquivalentModel(design)


def columns(reducer: Reducer) -> tuple[str, ...]:
    """Return the names of all deviations of a reducer, in the order of the rows that `deviations` gives.

    Examples
    --------
    >>> "pin.diameter" in columns(reducer())
    True
    """
    return _model(reducer).columns


def deviations(reducer: Reducer, by_name: Mapping[str, Any]) -> Float[np.ndarray, "sample column"]:
    """Return deviations as rows, one for every sample.

    Parameters
    ----------
    by_name
        Name of a column → its deviation, a number for all samples or an array of one for each [m, angles rad]. A
        deviation that is not named is 0; ``modification.equidistant``, ``modification.shift`` and
        ``modification.rotation`` are the amounts themselves, those of the reducer unless named.

    Raises
    ------
    UnknownNameError
        The reducer has no such deviation.
    InputError
        Arrays of different lengths.

    Examples
    --------
    >>> deviations(reducer(), {"pin.diameter": [1e-6, 2e-6, 3e-6]}).shape[0]
    3
    """
    names = columns(reducer)
    given = {**reducer.modification.deviations, **by_name}
    for name in given:
        if name not in names:
            raise UnknownNameError.among("deviations", "name", name, names)
    values = {name: np.atleast_1d(np.asarray(value, dtype=float)) for name, value in given.items()}
    sizes = {value.size for value in values.values()} - {1}
    if len(sizes) > 1 or any(value.ndim > 1 for value in values.values()):
        raise InputError.at("deviations", "number of samples", sorted(sizes), "one number, or one for every sample")
    found = np.zeros((max(sizes, default=1), len(names)))
    for name, value in values.items():
        found[:, names.index(name)] = value
    return found


def _rows(reducer: Reducer, given: Deviations) -> Float[np.ndarray, "sample column"]:
    if isinstance(given, Mapping):
        return deviations(reducer, given)
    rows = np.atleast_2d(np.asarray(given, dtype=float))
    if rows.shape[1] != len(columns(reducer)):
        raise InputError.at("deviations", "number of columns", rows.shape[1], f"{len(columns(reducer))}, `columns`")
    return rows


def transmission_error(
    reducer: Reducer, deviations: Deviations, carrier_angle: Sequence[float], torque: float = -1.0
) -> Float[np.ndarray, "sample angle"]:
    """Return the transmission error at given angles of the carrier.

    Parameters
    ----------
    deviations
        Errors of its parts, by name or as rows.
    carrier_angle
        Angles of the carrier [rad].
    torque
        Torque on the carrier, negative resists the rotation; any but 0 [N·m].

    Returns
    -------
    numpy.ndarray
        Rotation of the carrier beyond that of ideal gears; not a number where nothing converged [rad].

    Notes
    -----
    TE(θc) = θ(θc) − θc in the equilibrium of all springs, theory page equation (5), liu2020 equations (1)–(14).

    Examples
    --------
    A second wave of 6 µm of the housing's pitch makes a second wave of the error, the same after half a turn [″]:

    >>> found = transmission_error(reducer("rv20e_liu2020"), {"housing.pitch.cos2": 6e-6}, [0.5, 0.5 + np.pi])
    >>> (found * 206264.8).round(1).tolist()
    [[-27.5, -27.5]]
    """
    model = _model(at_torque(reducer, torque))
    angles = np.asarray(carrier_angle, dtype=float)
    return model.equilibria(_rows(reducer, deviations), torque, angles).transmission_error


class Extremes(NamedTuple):
    """Extremes of the transmission error over one turn of the carrier, for every sample."""

    largest: Float[np.ndarray, " sample"]  # [rad]
    smallest: Float[np.ndarray, " sample"]  # [rad]
    carrier_angle: Float[np.ndarray, "sample 2"]  # Where they are [rad]


def extremes(reducer: Reducer, deviations: Deviations, torque: float = -1.0) -> Extremes:
    """Return the extremes of the transmission error over one turn, refined beyond any grid of angles.

    Parameters
    ----------
    reducer, deviations, torque
        As of `transmission_error`.

    Examples
    --------
    >>> found = extremes(reducer("rv20e_liu2020"), {"housing.pitch.cos2": 6e-6})
    >>> (found.largest * 206264.8).round(1).item(), (found.smallest * 206264.8).round(1).item()  # [″]
    (3.2, -28.8)
    """
    found = _model(at_torque(reducer, torque)).extremes(_rows(reducer, deviations), torque)
    return Extremes(found.largest, found.smallest, found.carrier_angle)


def peak_to_peak(
    reducer: Reducer, deviations: Deviations, torque: float = -1.0
) -> Float[np.ndarray, " sample"] | float:
    """Return the peak-to-peak transmission error over one turn [rad], a number where there is one sample.

    Parameters
    ----------
    reducer, deviations, torque
        As of `transmission_error`.

    Examples
    --------
    >>> peaks = peak_to_peak(reducer("rv20e_liu2020"), {"housing.pitch.cos2": [6e-6, 12e-6]})
    >>> (peaks * 206264.8).round(1).tolist()  # [″]
    [32.0, 47.1]
    """
    found = extremes(reducer, deviations, torque)
    values = np.asarray(found.largest - found.smallest)
    return float(values[0]) if values.size == 1 else values


class Contact(NamedTuple):
    """What carries at given angles of the carrier, for every sample."""

    pins: Float[np.ndarray, "sample angle disc pin"]  # Force between every pin and every disc [N]
    pins_in_contact: Int[np.ndarray, "sample angle"]  # Pins that carry, all discs [-]


def contact(reducer: Reducer, deviations: Deviations, carrier_angle: Sequence[float], torque: float = -1.0) -> Contact:
    """Return the forces of all pins at given angles of the carrier.

    Parameters
    ----------
    reducer, deviations, carrier_angle, torque
        As of `transmission_error`.

    Examples
    --------
    Teeth without modification touch all pins but those without a lever:

    >>> found = contact(reducer("rv20e_liu2020", {"modification.equidistant_um": 0, "modification.shift_um": 0}), {},
    ...     [0.1], -100.0)
    >>> found.pins.shape, int(found.pins_in_contact[0, 0])
    ((1, 1, 2, 40), 38)
    """
    from tolalloc.reducers.equivalent.outputs import forces

    model = _model(at_torque(reducer, torque))
    found = model.equilibria(_rows(reducer, deviations), torque, np.asarray(carrier_angle, dtype=float))
    return Contact(forces(found).pins, found.pins_in_contact.astype(int))


class Clearance(NamedTuple):
    """What the tooth modification of a reducer leaves between one disc and the pins."""

    pin_angle: Float[np.ndarray, " angle"]  # Angle of the pins from the crank direction [rad]
    gap: Float[np.ndarray, " angle"]  # After the disc has turned until the first pin touches [m]
    backlash: float  # Of the whole reducer at its output, from one side to the other, gaps linear [rad]
    radial: float  # At tip and root [m]


def clearance(reducer: Reducer) -> Clearance:
    """Return the clearance of the modified teeth without errors and load.

    Raises
    ------
    InputError
        A pin overlaps the tooth.

    References
    ----------
    Li Lixing; distances are exact where the modification is large.

    Examples
    --------
    The shift −25 µm less the equidistant amount −17 µm leave 8 µm at tip and root:

    >>> found = clearance(reducer("rv20e_liu2020"))
    >>> round(found.radial * 1e6, 3), round(found.backlash * 206264.8, 1)  # [µm, ″]
    (8.0, 12.0)
    """
    from tolalloc.reducers.cycloid.clearance import clearance_of
    from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
    from tolalloc.reducers.equivalent.perfect import exact_loop

    found = clearance_of(ToothProfile.of(reducer))
    return Clearance(found.pin_angle, found.after, float(exact_loop(reducer).backlash[0]), found.radial)


def radial_clearance(reducer: Reducer, deviations: Deviations) -> Float[np.ndarray, " sample"]:
    """Return the smallest gap between all pins and teeth where the normal is radial, negative where they overlap [m].

    Parameters
    ----------
    reducer, deviations
        As of `transmission_error`.

    Examples
    --------
    >>> round(radial_clearance(reducer("rv20e_liu2020"), {}).item() * 1e6, 3)  # [µm]
    8.0
    """
    from tolalloc.reducers.equivalent.outputs import radial_clearance as smallest

    return smallest(_model(reducer), _rows(reducer, deviations))


class Zones(NamedTuple):
    """The cheapest zones, or the smallest ones where no zones keep all limits."""

    zones: Float[np.ndarray, " feature"]  # [unit of the zones]
    cost: float  # [cost units]
    bound: float  # No zones that keep all limits cost less; infinite where none keep them [cost units]
    prices: Float[np.ndarray, " stack"]  # What a limit that is wider by one unit saves [cost units per unit]
    kept: bool  # Whether all limits are kept


def allocate(
    factor: ArrayLike,
    smallest: ArrayLike,
    largest: ArrayLike,
    limits: ArrayLike,
    worst_case: Any = 0.0,
    root_sum_square: Any = 0.0,
    fixed: Any = 0.0,
) -> Zones:
    """Return the zones of least cost Σ (A + B/t) that keep linear tolerance stacks.

    Parameters
    ----------
    factor
        B of every feature [cost units × unit of the zones].
    smallest, largest
        Smallest and largest zone t of every feature [unit of the zones].
    limits
        Largest value of every stack.
    worst_case, root_sum_square
        What every stack (row) takes of every feature (column), 0 or above: worst_case·t + ‖root_sum_square∘t‖ ≤ limit.
    fixed
        A of every feature [cost units].

    Returns
    -------
    Zones
        With a bound that is computed without the solver.

    Raises
    ------
    InputError
        Numbers that make no such program.
    SolveError
        The convex program was not solved.

    Notes
    -----
    A second-order cone program; for one stack of squares t³ = B·μ/(2·w²) at the optimum, by the price μ of its square.

    Examples
    --------
    Two features of cost 1/t each in one worst-case stack of 1: half a unit each, at a cost of 2 + 2.

    >>> found = allocate([1, 1], [0.01, 0.01], [1, 1], [1.0], worst_case=[[1, 1]])
    >>> found.zones.round(6).tolist(), round(found.cost, 6), round(float(found.prices[0]), 4)
    ([0.5, 0.5], 4.0, 4.0)
    """
    from tolalloc.allocation.cost.model import Process, Reciprocal
    from tolalloc.allocation.search.process_choice import allocate as cheapest
    from tolalloc.allocation.space.problem import AllocationProblem, LeastInfeasible, PricedFeature, Stack

    falling, budgets = np.asarray(factor, dtype=float), np.asarray(limits, dtype=float)
    count, rows = len(falling), len(budgets)
    own, lower, upper = (np.broadcast_to(np.asarray(a, float), count).tolist() for a in (fixed, smallest, largest))
    worst, square = (np.broadcast_to(np.asarray(a, float), (rows, count)) for a in (worst_case, root_sum_square))
    made = [
        Process(name=f"{at}", cost=Reciprocal(fixed=a, factor=b), minimum=low, maximum=high)
        for at, (a, b, low, high) in enumerate(zip(own, falling.tolist(), lower, upper, strict=True), start=1)
    ]
    problem = AllocationProblem(
        features=tuple(PricedFeature(name=own.name, processes=(own,)) for own in made),
        stacks=tuple(
            Stack(name=f"{at + 1}", worst_case=worst[at], root_sum_square=square[at], budget=float(limit))
            for at, limit in enumerate(budgets)
        ),
    )
    found = cheapest(problem)
    if isinstance(found, LeastInfeasible):
        return Zones(found.zones, problem.cost(found.zones, found.processes), np.inf, np.full(rows, np.nan), False)
    return Zones(found.zones, found.cost, found.bound, found.prices, True)


def regulator(
    adjusting: Float[np.ndarray, "step state adjustment"],
    effort: Float[np.ndarray, "step adjustment"],
    final_weight: Float[np.ndarray, "state state"],
) -> Float[np.ndarray, "step adjustment state"]:
    """Return the gains of an assembly's adjustment, the linear-quadratic regulator u(k) = −K(k) z(k).

    Parameters
    ----------
    adjusting
        B(k): state per adjustment, zero where a part may not be turned [rad/rad].
    effort
        Diagonal of R(k), above 0 [-].
    final_weight
        Q: weight of the final errors, symmetric and positive semidefinite [-].

    Notes
    -----
    Minimises xᵀQx of the final state plus the sum of uᵀRu, theory page equation (56): K = (R + BᵀPB)⁻¹BᵀP,
    P = (I − BK)ᵀP(I − BK) + KᵀRK.

    References
    ----------
    zhang2025, with A = 1.

    Examples
    --------
    One angle, one step: K = q/(r + q).

    >>> regulator(np.ones((1, 1, 1)), np.ones((1, 1)), 3 * np.eye(1)).item()
    0.75
    """
    from tolalloc.wings.assembly.control import regulator as found
    from tolalloc.wings.assembly.steps import StateSpace

    turning = np.asarray(adjusting, dtype=float)
    steps, states = turning.shape[:2]
    space = StateSpace(
        entering=np.zeros((steps, states, states)),
        adjusting=turning,
        effort=np.asarray(effort, dtype=float),
        observing=(np.eye(states),) * steps,
    )
    return found(space, np.asarray(final_weight, dtype=float)).gains


def adjusted_errors(
    gains: Float[np.ndarray, "step adjustment state"],
    adjusting: Float[np.ndarray, "step state adjustment"],
    entering: Float[np.ndarray, "step state error"],
    errors: Float[np.ndarray, "sample error"],
) -> Float[np.ndarray, "sample state"]:
    """Return what errors of parts leave after all steps, every part measured before the first is mounted [rad].

    Parameters
    ----------
    gains, adjusting
        As of `regulator`.
    entering
        F(k): state per error of the parts that step k mounts [rad/rad].
    errors
        Errors of the parts, in their own axes [rad].

    Examples
    --------
    >>> one = np.ones((1, 1, 1))
    >>> adjusted_errors(regulator(one, one[0], 3 * np.eye(1)), one, one, np.array([[4e-5]])).round(9).item()
    1e-05
    """
    state = np.zeros((len(errors), adjusting.shape[1]))
    for step, gain in enumerate(gains):
        state = state + errors @ entering[step].T
        known = state + errors @ entering[step + 1 :].sum(axis=0).T
        state = state - known @ (adjusting[step] @ gain).T
    return state


class SobolIndices(NamedTuple):
    """Sobol indices of every input, with 90 % intervals from independent scramblings."""

    first: Float[np.ndarray, " input"]  # First-order index [-]
    total: Float[np.ndarray, " input"]  # Total-effect index [-]
    first_interval: Float[np.ndarray, "2 input"]  # [-]
    total_interval: Float[np.ndarray, "2 input"]  # [-]


def sobol(
    function: Callable[[Float[np.ndarray, "sample input"]], Float[np.ndarray, " sample"]],
    inputs: int,
    blocks: int = 1024,
    seed: int = 1,
    resamples: int = 400,
) -> SobolIndices:
    """Return which inputs drive the variance of a function of independent uniform numbers.

    Parameters
    ----------
    function
        Answers to rows of numbers in [0, 1); not a number where there is none.
    inputs
        Number of inputs D [-].
    blocks
        Blocks of D + 2 samples of the Saltelli design, a power of two [-].
    seed
        Seed of the scrambling and of the resamples, 1 or more [-].
    resamples
        Draws from the errors of the indices [-].

    Raises
    ------
    SolveError
        More than one in a hundred samples has no answer.

    References
    ----------
    Saltelli et al. 2010 (first order), Jansen 1999 (total); Sobol' points as SALib draws them, in eight scramblings,
    from which the intervals come: the jackknife, Efron & Tibshirani 1993, ch. 11.

    Examples
    --------
    y = x₁ + 2·x₂ has the indices 1/5 and 4/5.

    >>> found = sobol(lambda x: x[:, 0] + 2 * x[:, 1], 2, blocks=8192)
    >>> found.first.round(2).tolist(), found.total.round(2).tolist()
    ([0.2, 0.8], [0.2, 0.8])
    """
    from tolalloc.drawings.seeds import SeedTree
    from tolalloc.models.model import Evaluation
    from tolalloc.sensitivity.ranking import share_interval
    from tolalloc.sensitivity.saltelli import REPLICATES, SaltelliDesign, saltelli_indices

    names, replicates = tuple(f"{at}" for at in range(inputs)), min(REPLICATES, blocks)
    design = SaltelliDesign(factor_groups=names, seed=seed, replicates=replicates)
    values = np.concatenate([np.asarray(function(x), dtype=float) for x in design.chunks(0, blocks)])
    status = (~np.isfinite(values)).astype(np.uint8)
    found = saltelli_indices(
        Evaluation(values=values[:, np.newaxis], status=status),
        inputs,
        SeedTree(seed),
        replicates=replicates,
        resamples=resamples,
    )
    intervals = [share_interval(own[0], found.unseen[0]) for own in (found.first_resamples, found.total_resamples)]
    return SobolIndices(found.first[0], found.total[0], *intervals)


class FailureProbability(NamedTuple):
    """Probability of a rare failure."""

    probability: float  # [-]
    standard_error: float  # Of the estimate [-]
    calls: int  # Samples that were asked for [-]
    cautions: tuple[str, ...]  # Reasons not to rely on it; empty if the method sees none


def failure_probability(
    distance: Callable[[Float[np.ndarray, "sample variable"]], Float[np.ndarray, " sample"]],
    variables: int,
    samples: int = 2000,
    runs: int = 5,
    seed: int = 1,
) -> FailureProbability:
    """Return the probability of a rare failure by subset simulation.

    Parameters
    ----------
    distance
        Distance from the limit of rows of independent standard normal numbers, negative where the product fails, not a
        number where there is none.
    variables
        Number of these numbers [-].
    samples
        Samples of each level, a multiple of 10 [-].
    runs
        Independent runs, whose mean is the estimate and whose scatter its standard error [-].

    Raises
    ------
    SolveError
        More than one in a hundred samples has no answer.

    References
    ----------
    Au & Beck 2001; Papaioannou et al. 2015.

    Examples
    --------
    A sum of two normal numbers beyond 4·√2 has a probability of Φ(−4) = 3.2e-5.

    >>> found = failure_probability(lambda u: 4 - u.sum(axis=1) / 2**0.5, 2)
    >>> 2e-5 < found.probability < 5e-5
    True
    """
    from tolalloc.capability.rare_failure import subset_simulation
    from tolalloc.drawings.seeds import SeedTree

    found = subset_simulation(_Distance(distance, variables), SeedTree(seed), samples, runs)
    return FailureProbability(found.probability, found.standard_error, found.calls, found.cautions)


class _Distance(NamedTuple):
    """A function as a limit state."""

    distance: Callable[..., Any]
    variables: int

    def __call__(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, " sample"]:
        return np.asarray(self.distance(u), dtype=float)
