"""Which source makes which order of a unit's transmission error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.cycloid.solvers import LAWS, LINEAR
from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import waves

TORQUE, CLEARANCE, CURVATURE = "torque", "nominal clearance", "curvature of the contact law"


@dataclass(frozen=True, kw_only=True)
class Attribution:
    """A curve of transmission error as a sum over sources."""

    sources: tuple[str, ...]  # Names of the sources that contribute, the torque and the nominal clearances among them
    # What each adds to the transmission error at each angle; their sum is the curve [rad]
    contribution: Float[np.ndarray, "source angle"]
    order: Int[np.ndarray, " order"]  # Waves per output turn [-]
    # What each adds to the amplitude of each order: its wave's component along the whole wave, negative where it
    # cancels; the sum is the amplitude [rad]
    share: Float[np.ndarray, "source order"]
    amplitude: Float[np.ndarray, " order"]  # Amplitude of each order of the whole curve [rad]


def attribute(model: EquivalentModel, errors: Float[np.ndarray, "1 column"], torque: float) -> Attribution:
    """Return what every source of one unit [m, angles rad] adds to its transmission error and to each order.

    Theory page, equation (32). All gaps, clearances and the torque scaled together scale the transmission error, as
    long as the contact law is linear, so Euler's theorem splits it into deviation times derivative. The split holds for
    this unit: with other errors other pins carry, and a source's share changes. Under the logarithmic law the part that
    is not proportional is listed by itself.
    """
    curve, derivatives = model.rotation_derivatives(errors, torque)
    parts: dict[str, Float[np.ndarray, " angle"]] = {}
    clearance = model.error_columns.matrix.T @ model.error_columns.map.nominal
    for source, values in ((source_name, errors[0]), (lambda _: CLEARANCE, clearance)):
        for at in np.flatnonzero(values):
            name = source(model.columns[at])
            parts[name] = parts.get(name, 0.0) + values[at] * derivatives.by_error[:, at]
    parts[TORQUE] = torque * derivatives.by_torque
    if LAWS[model.reducer.stiffness.pin_contact_law] != LINEAR:
        parts[CURVATURE] = curve[0] - np.sum(list(parts.values()), axis=0)
    contribution = np.array(list(parts.values()))
    parts_of_order = waves(contribution)
    total = parts_of_order.sum(axis=0)
    amplitude = np.abs(total)
    direction = np.divide(total, amplitude, out=np.zeros_like(total), where=amplitude > 0)
    return Attribution(
        sources=tuple(parts),
        contribution=contribution,
        order=np.arange(1, amplitude.size + 1),
        share=np.real(parts_of_order * direction.conj()),
        amplitude=amplitude,
    )
