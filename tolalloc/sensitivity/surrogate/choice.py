"""Which surrogate stands in for a response: the best of those that have earned it, or none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.models.model import Evaluation, Response
from tolalloc.sensitivity.surrogate.regression import NEEDED_Q2
from tolalloc.sensitivity.surrogate.validation import Candidate, Score, answers_of, cross_validate

LARGEST_QUANTILE_ERROR = 0.02
"""Largest error of the quantile over the quantile with which a surrogate is used [-]."""
ENOUGH_Q2 = 0.99
"""Q² of a surrogate that may be used above which no other is tried: what is left to gain is not worth its fit [-]."""
LARGEST_FAILED_SHARE = 0.01
"""Largest share of failed predictions with which a surrogate is used [-]."""


def shortfalls(score: Score) -> tuple[str, ...]:
    """Return what a candidate fails in, one phrase each; nothing if it has earned its place."""
    quantile_error, failed = abs(score.quantile_share), score.failed / score.held_out
    checks = (
        (score.q2 >= NEEDED_Q2, f"Q² = {score.q2:.3f} is below {NEEDED_Q2:g}"),
        (
            quantile_error <= LARGEST_QUANTILE_ERROR,
            f"its {score.quantile_name} is off by {quantile_error:.1%}, more than {LARGEST_QUANTILE_ERROR:.1%}",
        ),
        (
            failed <= LARGEST_FAILED_SHARE,
            f"{failed:.1%} of its predictions fail, more than {LARGEST_FAILED_SHARE:.1%}",
        ),
    )
    return tuple(phrase for passed, phrase in checks if not passed)


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Candidates, what they are worth, and the one that was chosen."""

    output: str  # What is predicted, with its unit of measurement
    scores: tuple[Score, ...]  # One per candidate that was tried
    untried: tuple[str, ...]  # Names of the candidates that were not, as one before them left too little to gain
    failed: int  # Answers to learn from that failed and were left out [-]
    best: int  # Place of the highest Q² among those that passed the gate, or among all if none did [-]
    chosen: Response | None  # That candidate fitted to all answers; none if no candidate passed

    @property
    def reason(self) -> str:
        """Sentence that says why."""
        score = self.scores[self.best]
        if self.chosen is None:
            return f"No surrogate is used; the best, {score.name}, does not pass: {'; '.join(shortfalls(score))}."
        untried = f" Not tried, as no more can be gained: {', '.join(self.untried)}." if self.untried else ""
        return (
            f"The surrogate is {score.name}: Q² = {score.q2:.3f} on {score.held_out} answers that it had not seen, its "
            f"{score.quantile_name} off by {abs(score.quantile_share):.1%}.{untried}"
        )

    @property
    def table(self) -> dict[str, list[str] | list[float] | list[int]]:
        """Columns of a table with one row per candidate, by headers that state the unit."""
        unit, quantile = self.output[self.output.rindex("[") :], self.scores[self.best].quantile_name
        return {
            "candidate": [score.name for score in self.scores],
            "Q² [-]": [score.q2 for score in self.scores],
            f"rms error {unit}": [score.rms_error for score in self.scores],
            f"error of the {quantile} {unit}": [score.quantile_error for score in self.scores],
            f"error of the {quantile} [%]": [score.quantile_share * 100 for score in self.scores],
            "predictions per second [1/s]": [score.per_second for score in self.scores],
            "speed over the response [-]": [score.speed for score in self.scores],
            "trained on [-]": [score.trained for score in self.scores],
            "held out [-]": [score.held_out for score in self.scores],
            "failed [-]": [score.failed for score in self.scores],
            "falls short": ["; ".join(shortfalls(score)) or "nowhere" for score in self.scores],
        }


def choose(
    response: Response,
    candidates: Sequence[Candidate],
    x: Float[np.ndarray, "sample column"],
    seeds: SeedTree,
    quantile: float = 0.9973,
    largest_failed_share: float = 0.01,
    evaluation: Evaluation | None = None,
) -> Choice:
    """Return the candidate with the highest Q² among those tried that pass the gate, fitted to all answers.

    Parameters
    ----------
    response
        What is stood in for; its first output counts.
    candidates
        What may stand in, in the order of trying; one that passes with `ENOUGH_Q2` ends it.
    x
        Columns of random samples to learn from and to be judged on, in five folds [m, angles rad].
    seeds
        Node of the seed tree.
    quantile
        Share of the units below the quantile that is compared, the yield that the surrogate is asked about [-].
    largest_failed_share
        Share of samples that may fail in the response [-].
    evaluation
        What the response says of the samples, where that is known.

    Raises
    ------
    InputError
        No candidate, too few samples, or a quantile outside 0 to 1.
    SolveError
        Too many samples failed.

    Notes
    -----
    The clocked speed stands in the table alone, because a choice that depends on it could not be repeated. The best of
    several scores is a little too good: with Q² = 0.95 and more the candidates' distances are far above that.
    """
    if not candidates:
        raise InputError.at("surrogate", "candidates", tuple(candidates), "one or more")
    answers = answers_of(response, x, seeds, largest_failed_share=largest_failed_share, evaluation=evaluation)
    scores = list[Score]()
    for candidate in candidates:
        scores.append(cross_validate(candidate, answers, quantile))
        if scores[-1].q2 >= ENOUGH_Q2 and not shortfalls(scores[-1]):
            break
    passed = [at for at, score in enumerate(scores) if not shortfalls(score)]
    best = max(passed or range(len(scores)), key=lambda at: scores[at].q2)
    return Choice(
        output=response.outputs[0],
        scores=tuple(scores),
        untried=tuple(candidate.name for candidate in candidates[len(scores) :]),
        failed=answers.failed,
        best=best,
        chosen=candidates[best].fit(answers.x, answers.y) if passed else None,
    )
