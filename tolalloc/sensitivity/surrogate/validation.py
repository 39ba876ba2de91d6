"""The error and the speed of candidates for a surrogate on answers that none of them has seen, and which one is used.

Folds outside: every unit is predicted by a fit that has not seen it. Whatever a candidate tunes (a weight, the length
of a Gaussian process), it tunes inside the fold that it is given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

from tolalloc.capability.indices import require_share
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation, Response, Samples
from tolalloc.sensitivity.surrogate.regression import NEEDED_Q2

LARGEST_QUANTILE_ERROR = 0.02
"""Largest error of the quantile over the quantile with which a surrogate is used [-]."""
ENOUGH_Q2 = 0.99
"""Q² of a surrogate that may be used above which no other is tried: what is left to gain is not worth its fit [-]."""
LARGEST_FAILED_SHARE = 0.01
"""Largest share of failed predictions with which a surrogate is used [-]."""
FOLDS = 5
FEWEST_OF_FOLD = 2
"""Samples of a fold, without which its error has no scatter [-]."""
_CLOCKED, _CLOCKED_FOLDS = 256, 2
"""Samples of some folds on which the candidate and the response are clocked, the shortest time of a fold counts [-]."""


@runtime_checkable
class Candidate(Protocol):
    """What becomes a surrogate when it is fitted."""

    @property
    def name(self) -> str:
        """What a table calls it."""
        ...

    def fit(self, x: Samples, y: Float[np.ndarray, " sample"]) -> Response:
        """Return the surrogate through the answers."""
        ...


@dataclass(frozen=True, kw_only=True)
class Answers:
    """Good answers of a response, dealt out to folds."""

    x: Samples  # Columns of every sample [m, angles rad]
    y: Float[np.ndarray, " sample"]  # The answers [output]
    fold: Int[np.ndarray, " sample"]  # Fold of every sample [-]
    response: Response  # What gave the answers


@dataclass(frozen=True, kw_only=True)
class Score:
    """What a candidate is worth on held-out answers."""

    name: str  # The candidate
    q2: float  # Predictivity 1 − Σ(error²)/Σ(deviation from the training mean²) [-]
    rms_error: float  # Root-mean-square error [output]
    quantile_error: float  # Quantile of the predictions less that of the answers [output]
    quantile: float  # Quantile of the answers [output]
    target: float  # Share of the units below that quantile [-]
    speed: float  # Predictions in the time of one answer [-]
    per_second: float  # Predictions per second [1/s]
    # Answers that each fit saw, at least; answers that were predicted [-]
    trained: int
    held_out: int
    failed: int  # Failed predictions, which the errors leave out [-]

    @property
    def quantile_share(self) -> float:
        """Error of the quantile over the quantile [-]."""
        return self.quantile_error / self.quantile

    @property
    def failed_share(self) -> float:
        """Failed predictions over all [-]."""
        return self.failed / self.held_out

    @property
    def shortfalls(self) -> tuple[str, ...]:
        """What keeps the candidate from being used; nothing if it has earned its place."""
        passed = {
            "q2": self.q2 >= NEEDED_Q2,
            "quantile": abs(self.quantile_share) <= LARGEST_QUANTILE_ERROR,
            "failed": self.failed_share <= LARGEST_FAILED_SHARE,
        }
        return tuple(name for name, enough in passed.items() if not enough)


def answers_of(
    response: Response,
    x: Samples,
    seeds: SeedTree,
    folds: int = FOLDS,
    largest_failed_share: float = 0.01,
    evaluation: Evaluation | None = None,
) -> Answers:
    """Return the answers of a response, its first output, in random folds; it is asked where no evaluation is known.

    k folds of n/k samples each, drawn without replacement: Stone 1974, J. R. Stat. Soc. B 36, 111–147.
    """
    if not 2 <= folds <= x.shape[0] // FEWEST_OF_FOLD:
        raise InputError.at("surrogate", "folds", folds, f"2 to half of the {x.shape[0]} samples")
    fold = np.empty(x.shape[0], int)
    fold[seeds.generator().permutation(fold.size)] = np.arange(fold.size) % folds
    if evaluation is None:
        evaluation = response(x)
    good, y = evaluation.good, evaluation.values[:, 0]
    failed = int((~good).sum())
    if failed > largest_failed_share * fold.size:
        raise SolveError(
            f"Surrogate: {failed} of {fold.size} samples to learn from failed; allowed is {largest_failed_share:.4g} "
            "of them."
        )
    return Answers(x=x[good], y=y[good], fold=fold[good], response=response)


def cross_validate(candidate: Candidate, answers: Answers, quantile: float = 0.9973) -> Score:
    """Return what a candidate is worth where every answer is predicted by a fit to the other folds.

    The quantile compared has that share of the units below it; the clocked speed alone differs from run to run.

    Q² = 1 − Σ (y − ŷ)² / Σ (y − ȳ)², with ŷ and ȳ from the other folds: Stone 1974, J. R. Stat. Soc. B 36, 111–147.
    """
    require_share("surrogate", "quantile", quantile)
    predicted, mean = np.full(answers.y.size, np.nan), np.empty(answers.y.size)
    seconds, own_seconds, trained = list[float](), list[float](), list[int]()
    for own in range(int(answers.fold.max()) + 1):
        seen, unseen = answers.fold != own, answers.fold == own
        fitted = candidate.fit(answers.x[seen], answers.y[seen])
        predicted[unseen] = fitted(answers.x[unseen]).known[:, 0]
        mean[unseen] = answers.y[seen].mean()
        if len(seconds) < _CLOCKED_FOLDS:  # in turns, so that another program slows both down alike
            few = answers.x[unseen][:_CLOCKED]
            seconds.append(_seconds(answers.response, few))
            own_seconds.append(_seconds(fitted, few))
        trained.append(int(seen.sum()))
    good = np.isfinite(predicted)
    if not good.any():
        raise SolveError(f"Surrogate: every prediction of {candidate.name} failed.")
    y, error = answers.y[good], predicted[good] - answers.y[good]
    limit = float(np.quantile(y, quantile))
    return Score(
        name=candidate.name,
        q2=float(1 - (error**2).sum() / ((y - mean[good]) ** 2).sum()),
        rms_error=float(np.sqrt((error**2).mean())),
        quantile_error=float(np.quantile(predicted[good], quantile)) - limit,
        quantile=limit,
        target=quantile,
        speed=min(seconds) / min(own_seconds),
        per_second=1 / min(own_seconds),
        trained=min(trained),
        held_out=answers.y.size,
        failed=int((~good).sum()),
    )


def _seconds(response: Response, x: Samples) -> float:
    """Return the time that a response takes for one sample [s]."""
    start = perf_counter()
    response(x)
    return float((perf_counter() - start) / x.shape[0])


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Candidates, what they are worth, and the one that was chosen."""

    output: str  # What is predicted, with its unit of measurement
    scores: tuple[Score, ...]  # One per candidate that was tried
    untried: tuple[str, ...]  # Names of the candidates that were not, as one before them left too little to gain
    best: int  # Place of the highest Q² among those that passed the gate, or among all if none did [-]
    chosen: Response | None  # That candidate fitted to all answers; none if no candidate passed


def choose(
    response: Response,
    candidates: Sequence[Candidate],
    x: Samples,
    seeds: SeedTree,
    quantile: float = 0.9973,
    largest_failed_share: float = 0.01,
    evaluation: Evaluation | None = None,
) -> Choice:
    """Return the candidate with the highest Q² among those tried that pass the gate, fitted to all answers.

    The gate is Q² ≥ 0.95 of `cross_validate`, |error of the quantile| ≤ 2 % of it, and ≤ 1 % failed (own derivation).

    Parameters
    ----------
    candidates
        What may stand in, in the order of trying; one that passes with `ENOUGH_Q2` ends it.
    quantile
        The yield that the surrogate is asked about [-].
    x, largest_failed_share, evaluation
        As those of `answers_of`.

    Notes
    -----
    The clocked speed stands in the table alone, because a choice that depends on it could not be repeated. The best of
    several scores is a little too good: with Q² = 0.95 and more the candidates' distances are far above that.

    Examples
    --------
    >>> from tolalloc.sensitivity.surrogate.regression import RegressionCandidate, quadratic_regression
    >>> names, x = {"columns": ("a", "b"), "outputs": ("y [m]",)}, np.random.default_rng(1).normal(size=(400, 2))
    >>> candidate = RegressionCandidate(name="quadratic", estimator=quadratic_regression, **names)
    >>> choice = choose(candidate.fit(x, x.sum(axis=1)), [candidate], x, SeedTree(1))
    >>> choice.chosen is not None, choice.best
    (True, 0)
    """
    if not candidates:
        raise InputError.at("surrogate", "candidates", tuple(candidates), "one or more")
    answers = answers_of(response, x, seeds, largest_failed_share=largest_failed_share, evaluation=evaluation)
    scores = list[Score]()
    for candidate in candidates:
        scores.append(cross_validate(candidate, answers, quantile))
        if scores[-1].q2 >= ENOUGH_Q2 and not scores[-1].shortfalls:
            break
    passed = [at for at, score in enumerate(scores) if not score.shortfalls]
    best = max(passed or range(len(scores)), key=lambda at: scores[at].q2)
    return Choice(
        output=response.outputs[0],
        scores=tuple(scores),
        untried=tuple(candidate.name for candidate in candidates[len(scores) :]),
        best=best,
        chosen=candidates[best].fit(answers.x, answers.y) if passed else None,
    )
