"""Independent verification sample: random units that no search has seen, most of those that are solved near a limit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.output_sample import LimitedSample
from tolalloc.allocation.space.requirement import AtYield, Requirement
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.linear_function import LinearLaw, NearPlane
from tolalloc.capability.monte_carlo import ProcessUncertainty
from tolalloc.capability.near_limit import Drawn, SolvedUnits
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import Evaluation, Response
from tolalloc.sensitivity.surrogate.regression import QuadraticForm, fit_quadratic_form

_LEARNT = 0.8
"""Share of the units that the regression learns from; the others tell how far it is off [-]."""
_WORST = 0.1
"""Share of those others, with the largest excess, that tell what units at a limit are predicted [-]."""
_ERRORS = 2.0
"""Standard deviations below that from which a unit is near [-]."""
_MOST_NEAR = 0.35
"""Share of near units beyond which nothing is saved by telling them from far ones [-]."""
_FEWEST = 10
"""Units that such a line is drawn through, at least [-]."""
_STRENGTH = 1000.0
"""Of the ridge; cross-validation chooses it for the peak-to-peak of an RV-20E from 1,152 and from 6,144 units [-]."""
_AT_ONCE = 2**17
"""Units that are solved at once, so that the deviations of millions are never all kept [-]."""


@dataclass(frozen=True, kw_only=True)
class Screen:
    """Calls units near a limit or far from it, by a regression through the units of a design's search.

    Notes
    -----
    Nothing depends on its being right (`tolalloc.capability.near_limit`): where it is wrong more units are solved.
    """

    excess: QuadraticForm  # Predicted excess over every limit [unit of the output]
    # Least predicted excess of a near unit [unit of the output]
    least: Float[np.ndarray, " side"]
    share: float  # Units that are near [-]

    @classmethod
    def through(
        cls,
        requirements: tuple[Requirement, ...],
        outputs: Mapping[str, Float[np.ndarray, " unit"]],
        redraw: Callable[[], Float[np.ndarray, "unit column"]],
    ) -> Screen | None:
        """Return the screen learnt from units, none where a requirement is no yield, or where it would tell too little.

        Parameters
        ----------
        requirements
            What is limited.
        outputs
            Outputs of the units [units of their names].
        redraw
            Returns the deviations of these units [m, angles rad].
        """
        if not all(isinstance(own.guarantee, AtYield) for own in requirements):
            return None
        excess = np.concatenate([own.limits.excess(own.read(outputs)) for own in requirements]).T
        known = np.isfinite(excess).all(axis=1)
        learnt = int(_LEARNT * np.count_nonzero(known))
        if np.count_nonzero(known) - learnt < _FEWEST:
            return None
        x, excess = redraw()[known], excess[known]
        predicted = fit_quadratic_form(x[:learnt], excess[:learnt], _STRENGTH)
        held_out = zip(predicted(x[learnt:]).T, excess[learnt:].T, strict=True)
        least = np.array([_least_of_near(*own) for own in held_out])
        share = float((predicted(x) >= least).any(axis=1).mean())
        return cls(excess=predicted, least=least, share=share) if share <= _MOST_NEAR else None

    def __call__(self, x: Float[np.ndarray, "unit column"]) -> Bool[np.ndarray, " unit"]:
        """Return which units are near a limit."""
        return np.asarray((self.excess(x) >= self.least).any(axis=1))


def _least_of_near(predicted: Float[np.ndarray, " held_out"], excess: Float[np.ndarray, " held_out"]) -> float:
    """Return the predicted excess from which a unit is near [unit of the output].

    A ridge predicts the worst units too good, the more so the worse they are; a line through them reaches the limit.
    """
    worst = np.argsort(excess)[-max(int(_WORST * excess.size), _FEWEST) :]
    if np.ptp(excess[worst]) == 0:
        return float(predicted[worst].min())
    slope, at_limit = np.polyfit(excess[worst], predicted[worst], 1)
    errors = predicted[worst] - at_limit - slope * excess[worst]
    return float(at_limit - _ERRORS * errors.std(ddof=2))


@dataclass(frozen=True, kw_only=True)
class IndependentSample:
    """Outputs of units that no search has seen, most of them near a limit."""

    units: SolvedUnits  # Which of the drawn units they are
    outputs: dict[str, Float[np.ndarray, " solved"]]  # Outputs of all requirements, NaN where a unit has none
    leaving: dict[str, int]  # Output with a law → units solved whatever was predicted that do not keep to it [-]
    planes: dict[str, Float[np.ndarray, " solved"]]  # Output near a plane → what that says [unit of the output]

    def limited(
        self,
        requirement: Requirement,
        law: LinearLaw | None,
        nearest: Mapping[str, NearPlane],
        uncertainty: ProcessUncertainty | None = None,
    ) -> LimitedSample:
        """Return what the units say of a requirement.

        Parameters
        ----------
        requirement
            What is limited.
        law
            Of its output, none where it has none.
        nearest
            Output → plane near it.
        uncertainty
            What measured parts leave open of what is limited.
        """
        plain = self.units.drawn.whatever == self.units.drawn.units
        return LimitedSample(
            values=requirement.read(self.outputs),
            units=self.units,
            limits=requirement.limits,
            law=law,
            leaving=self.leaving.get(requirement.output, 0),
            controls=requirement.controls(nearest, self.planes) if plain else (),
            uncertainty=uncertainty,
        )


@dataclass(frozen=True, kw_only=True)
class SolvedPart:
    """Units that were solved, such as those of one look."""

    evaluation: Evaluation  # All outputs that are limited, the leading one first
    units: SolvedUnits  # Which of the drawn units they are
    leaving: dict[str, int]  # Output with a law → units solved whatever was predicted that do not keep to it [-]
    planes: dict[str, Float[np.ndarray, " solved"]]  # Output near a plane → what that says [unit of the output]

    @property
    def plain(self) -> Evaluation:
        """Those that were solved whatever was predicted: a random sample like any other."""
        kept = self.units.whatever
        return Evaluation(values=self.evaluation.values[kept], status=self.evaluation.status[kept])

    @property
    def known(self) -> Float[np.ndarray, "solved output"]:
        """The outputs, not a number where a unit has none [units of their names]."""
        return self.evaluation.known

    @classmethod
    def joined(cls, parts: list[SolvedPart]) -> SolvedPart:
        """Return all units of several parts as one."""
        drawn = [own.units.drawn for own in parts]
        return cls(
            evaluation=Evaluation.joined([own.evaluation for own in parts]),
            units=SolvedUnits(
                drawn=Drawn(units=sum(own.units for own in drawn), whatever=sum(own.whatever for own in drawn)),
                near=np.concatenate([own.units.near for own in parts]),
                whatever=np.concatenate([own.units.whatever for own in parts]),
            ),
            leaving={output: sum(own.leaving[output] for own in parts) for output in parts[0].leaving},
            planes={output: np.concatenate([own.planes[output] for own in parts]) for output in parts[0].planes},
        )


@dataclass(frozen=True, kw_only=True)
class UnitSolver:
    """Draws units of one design; solves those that a screen calls near a limit, and some whatever it calls them."""

    response: Response  # The real model with all outputs that are limited, the leading one first
    space: DesignSpace  # The design variables
    design: Float[np.ndarray, " variable"]  # Scales [-] and settings
    laws: dict[str, LinearLaw]  # Law of every limited output that is linear, at the zones of the design
    nearest: dict[str, NearPlane]  # Plane near every output that is near one, of a linear one its own
    screen: Screen | None  # Tells near units from far ones; without it all are solved

    def solved(self, seeds: SeedTree, drawn: Drawn) -> SolvedPart:
        """Return so many units of a node of the seed tree; those solved whatever is predicted come first."""
        errors = self.space.errors
        experiment = Experiment(self.response, errors, self.space.zones(self.design), seeds)
        rows, near, parts, first = list[Float[np.ndarray, "unit column"]](), list[Bool[np.ndarray, " unit"]](), [], 0
        for uniform in seeds.uniform_chunks(drawn.units, len(errors.columns)):
            x = experiment.deviations(errors.standard_values(uniform))
            is_near = self.screen(x) if self.screen else np.ones(len(x), bool)
            kept = is_near | (first + np.arange(len(x)) < drawn.whatever)
            rows.append(x[kept] if self.screen else x)
            near.append(is_near[kept])
            first += len(x)
            if sum(map(len, rows)) >= _AT_ONCE:
                parts.append(self._answered(np.concatenate(rows)))
                rows.clear()
        parts += [self._answered(np.concatenate(rows))] if rows else []
        evaluation = Evaluation.joined([own for own, *_ in parts])
        off_the_law = {name: np.concatenate([own[name] for _, own, _ in parts]) for name in self.laws}
        whatever = np.arange(evaluation.status.size) < drawn.whatever
        return SolvedPart(
            evaluation=evaluation,
            units=SolvedUnits(drawn=drawn, near=np.concatenate(near), whatever=whatever),
            leaving={name: int(np.count_nonzero(own[whatever])) for name, own in off_the_law.items()},
            planes={name: np.concatenate([own[name] for *_, own in parts]) for name in self.nearest},
        )

    def _answered(
        self, x: Float[np.ndarray, "unit column"]
    ) -> tuple[Evaluation, dict[str, Bool[np.ndarray, " unit"]], dict[str, Float[np.ndarray, " unit"]]]:
        """Return what the model says of units, which of them leave the laws of linear outputs, and what planes say."""
        evaluation = self.response(x)
        values = dict(zip(self.response.outputs, evaluation.known.T, strict=True))
        off_the_law = {output: law.function.leaves(x, values[output]) for output, law in self.laws.items()}
        return evaluation, off_the_law, {output: near(x) for output, near in self.nearest.items()}
