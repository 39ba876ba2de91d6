"""Everything that is known of an assembly before it begins."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.wings.assembly.chain import DatumFlowChain
from tolalloc.wings.assembly.steps import AssemblyStep, StateSpace, state_space

LARGEST_STATE_WEIGHT = 1e6
"""Largest precision that may be asked for: far beyond, gains lose their digits [-]."""


@dataclass(frozen=True, kw_only=True)
class AngularRequirements:
    """What the final angles must keep, and what the angular tolerances of the parts cost."""

    # Limit of three standard deviations of every part's tilt, x and y together; infinite where there is none [rad]
    tilt_limit: Float[np.ndarray, " part"]
    rotation_limit: Float[np.ndarray, " part"]  # The same of its rotation about the datum's axis [rad]
    # Bounds of every tolerance [rad]
    smallest: float
    largest: float
    form: str  # Cost of a tolerance t: ``reciprocal`` is fixed + factor/t, ``exponential`` fixed + factor·exp(−t/scale)
    factor: Float[np.ndarray, "part 3"]  # Of every part's three tolerances [cost units·rad, or cost units]
    fixed: Float[np.ndarray, "part 3"]  # The same [cost units]
    scale: Float[np.ndarray, "part 3"]  # The same, of the exponential form [rad]
    effort_price: float = 0.0  # Cost of one unit of effort times angle² [cost units/rad²]


@dataclass(frozen=True, kw_only=True)
class AssemblyPlan:
    """Chain, steps and weights of one assembly."""

    # What it is, and who describes it
    name: str
    source: str
    chain: DatumFlowChain  # The parts
    steps: tuple[AssemblyStep, ...]  # The steps
    # Angular tolerance of every part about its own axes, ±, three standard deviations [rad]
    tolerances: Float[np.ndarray, "part 3"]
    state_weight: float  # Q, weight of the final errors against the effort [-]
    weights: Float[np.ndarray, " part"]  # Further weight of every part's final errors [-]
    # Standard deviation of one reading, and of what an adjustment misses, per axis and step [rad]
    measurement_noise: float
    adjustment_noise: float
    requirements: AngularRequirements | None = None  # Limits and costs, if any are stated
    reducer: str = ""  # Preset or file of the reducer that the parts' errors act on; empty if there is none
    assumptions: tuple[str, ...] = ()  # What no source prints

    @cached_property
    def space(self) -> StateSpace:
        """The assembly as a linear system."""
        return state_space(self.chain, self.steps)

    @property
    def variances(self) -> Float[np.ndarray, " error"]:
        """Variance of every part error [rad²]."""
        return np.asarray((self.tolerances / 3).ravel() ** 2)

    def final_weight(self, state_weight: float | None = None) -> Float[np.ndarray, "state state"]:
        """Return the weight matrix of the final errors, Q(N), at a precision in place of the plan's own [-]."""
        own = self.state_weight if state_weight is None else state_weight
        return np.diag(own * np.repeat(self.weights, 3))

    @property
    def turning_fewer(self) -> AssemblyPlan:
        """The same assembly in which every step turns the part that it mounts, and no other."""
        own = ({"adjust": tuple(set(step.adjust) & {step.mount})} for step in self.steps)
        steps = tuple(step.model_copy(update=each) for step, each in zip(self.steps, own, strict=True))
        return replace(self, steps=steps)
