"""An assembly as a linear system: what every step brings in, can turn, and sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.chain import DatumFlowChain
from tolalloc.assembly.steps import Step, adjustable, efforts, observed


@dataclass(frozen=True, kw_only=True)
class StateSpace:
    """Steps mount → measure → adjust: z = x + F w, y = C z + v, x⁺ = z + B (u + n).

    Parameters
    ----------
    entering
        F(k): state per error of every part, zero for parts that the step does not mount [rad/rad].
    adjusting
        B(k): state per adjustment of every part in its own axes, zero where it may not be turned [rad/rad].
    effort
        Diagonal of R(k) [-].
    observing
        C(k): readings per state [-].

    Notes
    -----
    zhang2025's equations with A = 1, in the causal order: what a step brings in is measured before it is adjusted;
    otherwise the last part's error could never be taken out.
    """

    entering: Float[np.ndarray, "step state error"]
    adjusting: Float[np.ndarray, "step state adjustment"]
    effort: Float[np.ndarray, "step adjustment"]
    observing: tuple[Float[np.ndarray, "_reading state"], ...]

    @property
    def steps(self) -> int:
        """Number of steps [-]."""
        return int(self.entering.shape[0])

    @property
    def states(self) -> int:
        """Number of states [-]."""
        return int(self.entering.shape[1])


def state_space(
    chain: DatumFlowChain, steps: Sequence[Step], transform: Float[np.ndarray, "state error"] | None = None
) -> StateSpace:
    """Return the linear system of an assembly.

    Parameters
    ----------
    chain
        The parts.
    steps
        The steps.
    transform
        `DatumFlowChain.transform` unless given, or `DatumFlowChain.twist_transform` for six coordinates a part
        [rad/rad].
    """
    whole = chain.transform if transform is None else transform
    size = whole.shape[0] // len(chain.parts)
    mounted = np.array([[name == step.mount for name in chain.names] for step in steps])
    turned = np.array([adjustable(chain, step) for step in steps])
    return StateSpace(
        entering=whole * np.repeat(mounted, size, axis=1)[:, np.newaxis],
        adjusting=whole * np.repeat(turned, size, axis=1)[:, np.newaxis],
        effort=np.repeat([efforts(chain, step) for step in steps], size, axis=1),
        observing=tuple(np.kron(observed(chain, step), np.eye(size)) for step in steps),
    )
