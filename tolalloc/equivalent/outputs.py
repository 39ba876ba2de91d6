"""What engineers read off the equilibria: orders of the transmission error, torsional stiffness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from tolalloc.equivalent.transmission_error import EquivalentModel


@dataclass(frozen=True, kw_only=True)
class Orders:
    """Waves of the transmission error per output turn.

    Parameters
    ----------
    order
        Waves per output turn [-].
    amplitude
        Half the peak-to-peak of each wave, output side [rad].
    phase
        Angle by which the wave, written as a cosine, leads [rad].
    """

    order: Int[np.ndarray, " order"]
    amplitude: Float[np.ndarray, "sample order"]
    phase: Float[np.ndarray, "sample order"]

    def main(self, count: int, sample: int = 0) -> list[tuple[int, float]]:
        """Return the strongest orders of one sample with their amplitude [rad], strongest first."""
        strongest = np.argsort(-self.amplitude[sample])[:count]
        return [(int(self.order[at]), float(self.amplitude[sample, at])) for at in strongest]


def order_spectrum(transmission_error: Float[np.ndarray, "sample angle"]) -> Orders:
    """Return the orders 1, 2, … of curves on equally spaced angles of one output turn.

    Parameters
    ----------
    transmission_error
        Curves over one whole turn, the end point left out [rad].
    """
    angles = transmission_error.shape[1]
    waves = np.fft.rfft(transmission_error, axis=1)[:, 1 : (angles + 1) // 2] * (2 / angles)
    return Orders(order=np.arange(1, waves.shape[1] + 1), amplitude=np.abs(waves), phase=np.angle(waves))


def torsional_stiffness(
    model: EquivalentModel, errors: Float[np.ndarray, "sample column"], torque: float, other_torque: float
) -> Float[np.ndarray, " sample"]:
    """Return the torsional stiffness between two torques, its twist averaged over one turn [N·m/rad].

    Parameters
    ----------
    model
        The reducer.
    errors
        Deviations in the order of the model's columns [m].
    torque, other_torque
        The two torques on the carrier [N·m].
    """
    twist = [model.curves(errors, value).transmission_error.mean(axis=1) for value in (torque, other_torque)]
    return np.asarray((torque - other_torque) / (twist[0] - twist[1]))
