"""Choosing the two modification amounts by a source's method, with every algorithm and the sure reference beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.progress import Progress
from tolalloc.rv.cycloid.assessment import assess
from tolalloc.rv.cycloid.clearance import LARGE
from tolalloc.rv.modification.answer import ModificationResults
from tolalloc.rv.modification.binary_ga import binary_search
from tolalloc.rv.modification.problem import ModificationProblem
from tolalloc.rv.modification.reference import polish, reference
from tolalloc.rv.modification.residual_gap import residual_gap
from tolalloc.rv.modification.result import SearchResult, Spread
from tolalloc.rv.modification.rotated_profile import METRICS, Metric, rotated_profile_fit
from tolalloc.rv.modification.searches import ALGORITHMS, search
from tolalloc.rv.reducer.design import Reducer
from tolalloc.units import ARCMINUTE, MICROMETRE

METHODS = ("song2019", "li2018")

ASSUMPTIONS = {
    "song2019": (
        "song2019 prints no box, generations or care for bounds: 0…1 mm, 0…±1 mm, 400 generations, pymoo's repair",
        "song2019's condition Δr_rp − |Δr_p| > 0 is none for a negative shift; Δr_rp − Δr_p keeps the radial clearance",
    ),
    "li2018": (
        "li2018's formulas are lost: least mean gap, radial clearance kept, no interference, is a well-posed reading",
        "work interval 25…100° in 100 steps, amounts 0…100 µm: li2018 prints none",
        "li2018's algorithm: crossover 0.8, best fitness twice the mean, penalty and extrapolation by SUMT: unprinted",
    ),
}
"""What the methods' sources do not print."""

Searcher = Callable[[ModificationProblem, int], SearchResult]


@dataclass(frozen=True, kw_only=True)
class ModificationStudy:
    """What is to be chosen, and how thoroughly.

    Parameters
    ----------
    method
        ``song2019``: closest to a rotated profile; ``li2018``: least gap on the working flank.
    radial_clearance
        Smallest clearance at tip and root [m].
    rotation
        δ of the profile to come close to, song2019 only [rad].
    metric
        Distance of the profiles, song2019 only.
    shift_sign
        1 for a positive and −1 for a negative shift, song2019 only [-].
    require_gap
        Whether no pin may interfere after closing at φ0, song2019 only; li2018 always asks for it.
    seeds
        Searches of each algorithm [-].
    seed
        First seed [-].
    """

    method: str
    radial_clearance: float = 15 * MICROMETRE
    rotation: float = 0.005
    metric: Metric = "same_angle"
    shift_sign: int = 1
    require_gap: bool = False
    seeds: int = 8
    seed: int = 1

    def __post_init__(self) -> None:
        place = "tolalloc modify"
        if self.method not in METHODS:
            raise UnknownNameError.among(place, "method", self.method, METHODS)
        if self.metric not in METRICS:
            raise UnknownNameError.among(place, "metric", self.metric, METRICS)
        for name, value, good, allowed in (
            ("seeds", self.seeds, 1 <= self.seeds <= 1000, "1 to 1000"),
            ("seed", self.seed, self.seed >= 0, "0 or a positive integer"),
            (
                "radial clearance",
                f"{self.radial_clearance / MICROMETRE:g} µm",
                0 <= self.radial_clearance <= 1e-3,
                "0 to 1000 µm",
            ),
        ):
            if not good:
                raise InputError.at(place, name, value, allowed)

    def problem(self, reducer: Reducer) -> ModificationProblem:
        """Return what is minimised on a reducer's cycloid stage."""
        if self.method == "li2018":
            return residual_gap(reducer.cycloid_stage, self.radial_clearance)
        return rotated_profile_fit(
            reducer.cycloid_stage,
            shift_sign=self.shift_sign,
            metric=self.metric,
            rotation=self.rotation,
            radial_clearance=self.radial_clearance,
            require_gap=self.require_gap,
        )

    def searchers(self) -> dict[str, Searcher]:
        """Return pymoo's algorithms, and for li2018 its own."""

        def by_pymoo(name: str) -> Searcher:
            return lambda problem, seed: search(problem, name, seed)

        own: dict[str, Searcher] = {"binary genetic algorithm": binary_search} if self.method == "li2018" else {}
        return {**{name: by_pymoo(name) for name in ALGORITHMS}, **own}


def choose(study: ModificationStudy, reducer: Reducer, torque: float, progress: Progress) -> ModificationResults:
    """Return the best amounts, how every algorithm found them, and what they do on the reducer.

    Parameters
    ----------
    study
        What is to be chosen.
    reducer
        Nominal design; its own modification is replaced.
    torque
        Torque on the carrier for the contact [N·m].
    progress
        Told of every algorithm and every finished search.

    Raises
    ------
    InputError
        No amounts meet the constraints, or the best ones cannot be ground or mounted.
    """
    problem = study.problem(reducer)
    progress.begin("reference")
    best = reference(problem)
    progress.advance(1)
    if best.violation > 0:
        equidistant, shift = (
            f"{low / MICROMETRE:g}…{high / MICROMETRE:g} µm"
            for low, high in zip(problem.lower, problem.upper, strict=True)
        )
        raise InputError(
            f"{reducer.name}: no equidistant amount of {equidistant} with a shift of {shift} will meet the "
            f"constraints; the nearest miss them by {best.violation / MICROMETRE:.3g} µm; "
            "allowed is less radial clearance."
        )
    spreads, polished = [], []
    for name, searcher in study.searchers().items():
        progress.begin(name)
        results = []
        for seed in range(study.seed, study.seed + study.seeds):
            results.append(searcher(problem, seed))
            progress.advance(1)
        spreads.append(Spread(results=tuple(results), reference=best))
        polished.append(Spread(results=tuple(polish(problem, result) for result in results), reference=best).share)
    return ModificationResults(
        method=study.method,
        problem=problem,
        reference=best,
        spreads=tuple(spreads),
        polished=tuple(polished),
        assessment=assess(replace(reducer, modification=best.modification), torque),
        seed=study.seed,
        warnings=_warnings(study, reducer),
        assumptions=(*ASSUMPTIONS[study.method], "sizes of the genetic algorithm and of CMA-ES: ours"),
    )


def _warnings(study: ModificationStudy, reducer: Reducer) -> tuple[str, ...]:
    """Return what the method itself must warn of."""
    if study.method != "song2019" or study.rotation * reducer.cycloid_stage.disc_pitch_radius <= LARGE:
        return ()
    return (
        f"A rotation of {study.rotation:g} rad is {study.rotation / ARCMINUTE:.0f} arcmin of play to each side; a "
        "precision reducer has one or two: ask for less before setting a drawing.",
    )
