"""Search by pattern: where an output jumps with the zones, the derivatives of its units say little of its limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.requirement import AtYield
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier
from tolalloc.capability.halving import halved
from tolalloc.exceptions import FailedUnitsError
from tolalloc.models.model import is_fast

_MOVED, _LESS = 0.1, 8.0
"""Part of a zone by which it is moved to see whether an output jumps, and by what it is moved less again [-]."""
_JUMPING = 0.5
"""Part of the mean square that a smooth output would lose by that, of which a jumping one loses no more [-]."""
_UNITS, _UNITS_TO_COMPARE = 0.5, 2.0
"""Common units of the search, and others on which what it finds is compared with where it began, over those of a
verification [-]."""
_EVALUATIONS, _MOST_VARIABLES = 40, 8
"""Designs that are tried for each variable at most, and variables up to which a pattern is searched [-]."""
_ROUNDS, _AGAIN = 8, 0.01
"""Searches one after another, each around what the one before found, and the gain of cost for which one more is made
[-]."""
_FIRST_STEP = 0.2
"""First step of a ratio of zones, its ln, and of a setting, over its range [-]."""
_FAR_STEPS, _DEAREST = 10.0, 1e300
"""Steps to either side that the search may go in all [-], and the cost of what keeps no limits: pymoo
compares finite ones [cost units]."""
_FAR, _REACH, _PRECISION = 2.0, 0.5, 5e-4
"""Change of all zones alike within which a design comes to its limits, at first and around that, and its error: ln of a
factor [-]."""
_INSIDE = (0.0, 0.01, 0.02, 0.04)
"""Changes of all zones by which what is found is taken inside until a verification shows it, ln of a factor [-]."""
_GAIN = 0.002
"""Relative gain of cost below which what was found is no better [-]."""

Design = Float[np.ndarray, " variable"]


def alike(space: DesignSpace, design: Design, change: float) -> Design:
    """Return a design with all zones changed alike, as far as their ranges go; the change is the ln of a factor [-]."""
    zones = np.append(design[: len(space.groups)] * np.exp(change), space.settings_of(design))
    return np.asarray(np.clip(zones, space.lower, space.upper))


@dataclass(frozen=True, kw_only=True)
class CommonUnits:
    """Units by their standard values, the same for every design."""

    verifier: Verifier
    standard: Float[np.ndarray, "unit column"]  # Standard values [-]

    @classmethod
    def of(cls, verifier: Verifier, name: str, share: float = _UNITS) -> CommonUnits:
        """Return so many units over those of a verification, others for every name."""
        errors = verifier.space.errors
        uniform = verifier.seeds.child(name).uniform_chunks(int(share * verifier.units), len(errors.columns))
        return cls(verifier=verifier, standard=np.concatenate([errors.standard_values(chunk) for chunk in uniform]))

    def values(self, design: Design) -> dict[str, Float[np.ndarray, " unit"]]:
        """Return the limited outputs of the units at a design, NaN where one has none."""
        space, model = self.verifier.space, self.verifier.model.at(self.verifier.space.settings_of(design))
        names = tuple(dict.fromkeys(name for own in self.verifier.requirements for name in own.outputs))
        found = model.reading(names)(space.errors.deviations(self.standard, space.zones(design)))
        return dict(zip(names, found.known.T, strict=True))

    def keep(self, design: Design) -> bool:
        """Return whether as many of them as must keep the limits."""
        model, values = self.verifier.model.at(self.verifier.space.settings_of(design)), self.values(design)
        asked = [own.in_force(model) for own in self.verifier.requirements]
        kept = [np.mean(own.limits.kept_by(own.read(values))) for own in asked]
        targets = [own.guarantee.target for own in asked if isinstance(own.guarantee, AtYield)]
        return bool(np.all(np.array(kept) >= targets))

    def scaled(self, design: Design, reach: float = _REACH) -> Design | None:
        """Return a design with its zones scaled alike until the limits are just kept, none where that is too far."""
        space, halvings = self.verifier.space, int(np.ceil(np.log2(reach / _PRECISION)))
        if not self.keep(alike(space, design, -reach)):
            return None
        change = halved(lambda change: self.keep(alike(space, design, change)), -reach, reach, halvings)
        return alike(space, design, float(change))

    def cost(self, design: Design) -> float:
        """Return what a design costs once it just keeps the limits, infinite where that is far [cost units]."""
        found = self.scaled(design)
        return np.inf if found is None else float(self.verifier.space.cost(found))


def jumps(verifier: Verifier, design: VerifiedDesign) -> bool:
    """Return whether a limited output jumps where a zone grows, as with a class or a step.

    Parameters
    ----------
    verifier
        Has the model, one whose units are many; no other is asked, nor one of more than nine zones.
    design
        Where it is asked; not where laws decide.

    Notes
    -----
    With a zone larger by h a smooth output, and one with kinks, differs by h in every unit, one that jumps by as much
    as ever in a part h of them: the mean square grows with h² or with h (own derivation). It is compared at 10 % and
    at an eighth of that.

    Examples
    --------
    >>> from tests.builders import verifier_of_sum
    >>> smooth = verifier_of_sum(6.0, 8.0, limit=5.0, guarantee=AtYield(0.99))
    >>> jumps(smooth, smooth.verify(smooth.space.uniform(1.0), "drawn"))
    False
    """
    groups = len(verifier.space.groups)
    if not is_fast(verifier.model) or groups > _MOST_VARIABLES + 1 or not design.quantiles:
        return False
    units = CommonUnits.of(verifier, "jumps")
    before = units.values(design.design)

    def squares(at: int, by: float) -> list[float]:
        moved = units.values(design.design * np.where(np.arange(design.design.size) == at, 1 + by, 1.0))
        changes = ((moved[name] - own)[np.isfinite(moved[name] - own)] for name, own in before.items())
        return [float(change @ change) / max(change.size, 1) for change in changes]

    pairs = [
        pair for at in range(groups) for pair in zip(squares(at, _MOVED), squares(at, _MOVED / _LESS), strict=True)
    ]
    return any(less * _LESS**2 * _JUMPING > more > 0 for more, less in pairs)


def by_pattern(verifier: Verifier, start: VerifiedDesign) -> VerifiedDesign | None:
    """Return a verified design that a search by pattern finds cheaper than one that keeps the limits, if it does.

    Parameters
    ----------
    verifier
        Verifies it. Where no output jumps, where not all is asked as a yield, and of many variables there is none.

    Notes
    -----
    Nelder and Mead's simplex over the ratios of the zones and the settings, each design scaled alike until the common
    units just keep the limits.

    References
    ----------
    F. Gao, L. Han, Comput. Optim. Appl. 51 (2012) 259–277, for the steps in several dimensions.
    """
    space = verifier.space
    yields = all(isinstance(own.guarantee, AtYield) for own in verifier.requirements)
    if not (start.met and yields and _first_steps(space).size <= _MOST_VARIABLES and jumps(verifier, start)):
        return None
    units = CommonUnits.of(verifier, "pattern")
    found = units.scaled(start.design, _FAR)
    for _ in range(_ROUNDS):
        if found is None:
            return None
        before, found = float(space.cost(found)), units.scaled(_Around(units=units, design=found).best)
        if found is None or space.cost(found) > (1 - _AGAIN) * before:
            break
    fresh = CommonUnits.of(verifier, "pattern compared", _UNITS_TO_COMPARE)
    best = None if found is None else fresh.scaled(found)
    if best is None or space.cost(best) > (1 - _GAIN) * start.cost:
        return None
    verified = None
    for number, inside in enumerate(_INSIDE, start=1):
        try:
            verified = verifier.verify(alike(space, best, -inside), f"pattern {number}").evenly_divided()
        except FailedUnitsError:  # further inside fewer units are without an answer
            continue
        if verified.met:
            break
    return verified


def _first_steps(space: DesignSpace) -> Float[np.ndarray, " change"]:
    """Return the first step of every change: ln of a ratio of zones [-], a free setting [unit of its name]."""
    size = space.shared.upper - space.shared.lower
    return np.append(np.full(len(space.groups) - 1, _FIRST_STEP), _FIRST_STEP * size[size > 0])


@dataclass(frozen=True, kw_only=True)
class _Around:
    """Designs around one, by the changes of the ratios of its zones and of its free settings."""

    units: CommonUnits
    design: Design

    def at(self, changes: Float[np.ndarray, " change"]) -> Design:
        """Return the design at some changes; the last zone keeps its size."""
        space, ratios = self.units.verifier.space, len(self.units.verifier.space.groups) - 1
        design = self.design.copy()
        design[:ratios] *= np.exp(changes[:ratios])
        design[ratios + 1 + np.flatnonzero(space.shared.upper > space.shared.lower)] += changes[ratios:]
        return np.asarray(np.clip(design, space.lower, space.upper))

    @property
    def best(self) -> Design:
        """The cheapest that a simplex finds, each design scaled alike."""
        from pymoo.algorithms.soo.nonconvex.nelder import NelderMead
        from pymoo.optimize import minimize
        from pymoo.problems.functional import FunctionalProblem

        steps = _first_steps(self.units.verifier.space)
        if not steps.size:
            return self.design

        def cost(changes: Float[np.ndarray, " change"]) -> float:
            return min(self.units.cost(self.at(changes)), _DEAREST)

        reach = _FAR_STEPS * steps
        problem = FunctionalProblem(steps.size, cost, xl=-reach, xu=reach)
        simplex = NelderMead(x0=np.zeros(steps.size), init_simplex_scale=0.5 / _FAR_STEPS)
        return self.at(minimize(problem, simplex, ("n_evals", _EVALUATIONS * steps.size), seed=0).X)
