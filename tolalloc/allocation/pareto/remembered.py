"""A problem and a response whose answers are remembered."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.pareto.answers import Answers, Checkpoint
from tolalloc.allocation.pareto.problem import Genes, Objective, Objectives, ParetoProblem
from tolalloc.model import Evaluation, Response


class RememberedProblem:
    """A problem that answers every design once.

    Parameters
    ----------
    problem
        The problem.
    checkpoint
        Where its answers are kept beyond this process.
    """

    def __init__(self, problem: ParetoProblem, checkpoint: Checkpoint | None = None) -> None:
        self.problem = problem
        genes = problem.genes
        bounds = np.array([genes.lower, genes.upper, genes.integer]).tolist()
        self.answers = Answers(
            self._ask, repr((genes.names, bounds, problem.objectives, problem.constraints)), checkpoint
        )

    @property
    def genes(self) -> Genes:
        """What the search may change."""
        return self.problem.genes

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """What is traded off."""
        return self.problem.objectives

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of the constraints."""
        return self.problem.constraints

    def __call__(self, designs: Float[np.ndarray, "design gene"]) -> Objectives:
        """Return the objectives of every design."""
        numbers, count = self.answers(designs), len(self.objectives)
        return Objectives(
            values=numbers[:, :count], violation=numbers[:, count:-1], status=numbers[:, -1].astype(np.uint8)
        )

    def _ask(self, designs: Float[np.ndarray, "design gene"]) -> Float[np.ndarray, "design number"]:
        answers = self.problem(designs)
        return np.column_stack([answers.values, answers.violation, answers.status])


class RememberedResponse:
    """A response that answers every sample once.

    Parameters
    ----------
    response
        The response.
    checkpoint
        Where its answers are kept beyond this process.
    """

    def __init__(self, response: Response, checkpoint: Checkpoint | None = None) -> None:
        self.response = response
        self.answers = Answers(self._ask, repr((response.columns, response.outputs)), checkpoint)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return self.response.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs with their units."""
        return self.response.outputs

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the outputs of every sample."""
        numbers = self.answers(x)
        return Evaluation(values=numbers[:, :-1], status=numbers[:, -1].astype(np.uint8))

    def _ask(self, x: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample number"]:
        evaluation = self.response(x)
        return np.column_stack([evaluation.values, evaluation.status])
