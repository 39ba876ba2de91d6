"""The contact solve in plain NumPy, batched over samples: what the compiled kernel has to beat.

Everything is built from the spring rows alone. At each angle one product gives the loads of all samples, and Newton's
method takes all that are still under way through the same step. Samples stand on the last axis, so that every line
works on long rows.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from numpy_tables import Tables, condensed_tables
from plain_rows import spring_groups

from tolalloc.reducers.equivalent.springs import HARMONICS
from tolalloc.reducers.reducer.design import Reducer

_ANGLES_AT_ONCE = 64
_WHOLE_STEPS = 8  # by then, what has not settled goes round in circles
_SEARCHED_STEPS = 100
_LONGEST = 1e-4  # metres; a longer step is the ridge's, not the springs'
_GRAZING = 1e-15  # metres; rounding decides whether a pin this close touches, and its force is nothing

Contacts = Float[np.ndarray, "contact sample"]
Vectors = Float[np.ndarray, "coordinate sample"]


class NumpyKernel:
    """Transmission error curves of a reducer at fixed carrier angles, for pins on linear springs without play.

    Parameters
    ----------
    reducer
        Nominal design and stiffness.
    carrier_angle
        Carrier angles [rad].
    orders
        Orders of the harmonic deviations of pitch and run-out [-].
    batch
        Samples that go through the arrays together; with 1,024 they fill, but do not overflow, the caches [-].
    """

    def __init__(
        self,
        reducer: Reducer,
        carrier_angle: Float[np.ndarray, " angle"],
        orders: tuple[int, ...] = HARMONICS,
        batch: int = 1024,
    ) -> None:
        self.batch = batch
        self.newton_steps = 0  # of all samples and angles so far
        parts = []
        for first in range(0, carrier_angle.size, _ANGLES_AT_ONCE):
            groups = spring_groups(reducer, carrier_angle[first : first + _ANGLES_AT_ONCE], orders)
            if reducer.stiffness.pin_contact_law == "logarithmic" or any(group.contact == "play" for group in groups):
                raise ValueError("NumpyKernel solves pins on linear springs without play only; this reducer has more.")
            self.columns = tuple(name for group in groups for name in group.columns)
            parts.append(condensed_tables(reducer, groups))
        self._tables = Tables(*(np.concatenate(table) for table in zip(*parts, strict=True)))

    def curves(self, errors: Float[np.ndarray, "sample column"], torque: float) -> Float[np.ndarray, "sample angle"]:
        """Return the carrier rotation of every sample, NaN where no equilibrium was found [rad].

        Parameters
        ----------
        errors
            Deviations in the order of ``columns`` [m].
        torque
            Torque on the carrier; negative resists the rotation [N·m].
        """
        values = np.vstack([errors.T, np.full(errors.shape[0], torque)])
        present = np.any(values != 0.0, axis=1)
        by_error = np.ascontiguousarray(self._tables.by_error[:, :, present])
        rotation = np.empty((by_error.shape[0], errors.shape[0]))
        for first in range(0, errors.shape[0], self.batch):
            batch = slice(first, first + self.batch)
            self._turn(np.ascontiguousarray(values[present, batch]), by_error, rotation[:, batch])
        return rotation.T

    def _turn(
        self,
        values: Float[np.ndarray, "column sample"],
        by_error: Float[np.ndarray, "angle row column"],
        rotation: Float[np.ndarray, "angle sample"],
    ) -> None:
        """Set the rotations of one batch, each angle started from the last one's equilibrium."""
        contacts, size = self._tables.by_disc.shape[1:]
        q, loads = np.zeros((size, values.shape[1])), np.empty((by_error.shape[1], values.shape[1]))
        for angle, tables in enumerate(zip(by_error, *self._tables[1:], strict=True)):
            at = Tables(*tables)
            np.matmul(at.by_error, values, out=loads)
            self.newton_steps += equilibria(at, loads[:contacts], loads[contacts:-1], q)
            rotation[angle] = loads[-1] + at.rotation_by_disc @ q
            q[:, np.isnan(q[0])] = 0.0  # what failed is no guess for the next angle


def equilibria(at: Tables, undisturbed: Contacts, force: Vectors, q: Vectors) -> int:
    """Bring q to equilibrium by whole steps, and by searched ones where those do not do; return how many it took."""
    everything, here, left, unsettled, steps = (undisturbed, force, q.copy()), q, np.arange(q.shape[1]), [], 0
    compression = at.by_disc @ here
    compression += undisturbed
    pressed = compression > 0.0
    for _ in range(_WHOLE_STEPS):
        step, _ = newton_step(at, here, force, compression, pressed)
        steps += left.size
        here = here + step
        compression = at.by_disc @ here
        compression += undisturbed
        before, pressed = pressed, compression > 0.0
        # With the same pins in contact, the energy is the quadratic that the step has just minimised.
        going = (before != pressed).any(axis=0)
        singular = np.abs(step).max(axis=0) > _LONGEST
        q[:, left] = here
        unsettled.append(left[singular])
        (kept,) = np.nonzero(going & ~singular)
        left, here, force, undisturbed = left[kept], here[:, kept], force[:, kept], undisturbed[:, kept]
        compression, pressed = compression[:, kept], pressed[:, kept]
        if kept.size == 0:
            break
    left = np.concatenate([*unsettled, left])
    q[:, left], searched = searched_equilibria(at, *(part[:, left] for part in everything))
    return steps + searched


def newton_step(
    at: Tables, q: Vectors, force: Vectors, compression: Contacts, pressed: Bool[np.ndarray, "contact sample"]
) -> tuple[Vectors, Vectors]:
    """Return Newton's step [m] and minus the gradient [N]."""
    downhill = force - at.stiffness @ q
    downhill -= at.force_by_pin @ np.maximum(compression, 0.0)
    tangent = (pressed.astype(float).T @ at.tangent_by_pin).reshape(-1, *at.stiffness.shape)
    tangent += at.ridged
    return np.ascontiguousarray(np.linalg.solve(tangent, downhill.T[:, :, np.newaxis])[:, :, 0].T), downhill


def searched_equilibria(at: Tables, undisturbed: Contacts, force: Vectors, q: Vectors) -> tuple[Vectors, int]:
    """Return the equilibria, reached from anywhere because the energy falls with each step, and the number of steps."""
    found, left, steps = np.full_like(q, np.nan), np.arange(q.shape[1]), 0
    for _ in range(_SEARCHED_STEPS):
        compression = at.by_disc @ q + undisturbed
        pressed = compression > 0.0
        step, downhill = newton_step(at, q, force, compression, pressed)
        steps += left.size
        rate = at.by_disc @ step
        whole = compression + rate
        going = (((whole > 0.0) != pressed) & (np.abs(whole) > _GRAZING)).any(axis=0)
        going |= np.abs(step).max(axis=0) > _LONGEST
        found[:, left[~going]] = (q + step)[:, ~going]
        start, bend = -(step * downhill).sum(axis=0), (step * (at.stiffness @ step)).sum(axis=0)
        length = exact_length(start, bend, at.pin_stiffness[:, np.newaxis], compression, rate)
        (kept,) = np.nonzero(going & np.isfinite(length))
        if kept.size == 0:
            break
        left, q = left[kept], (q + length * step)[:, kept]
        undisturbed, force = undisturbed[:, kept], force[:, kept]
    return found, steps


def exact_length(
    start: Float[np.ndarray, " sample"],
    bend: Float[np.ndarray, " sample"],
    pin_stiffness: Float[np.ndarray, "contact 1"],
    compression: Contacts,
    rate: Contacts,
) -> Float[np.ndarray, " sample"]:
    """Return how many steps away the energy is least, NaN if nowhere: its slope is straight from pin to pin.

    ``start`` is the energy's slope along the step, ``bend`` the condensed stiffness's part in the slope's own [N·m].
    """
    pressed = compression > 0.0
    turns = np.where(pressed, rate < 0.0, rate > 0.0)  # pins that touch or leave along the step
    where = np.where(turns, -compression / np.where(turns, rate, 1.0), np.inf)
    order = np.argsort(where, axis=0)
    jump = np.where(turns, np.where(pressed, -pin_stiffness, pin_stiffness), 0.0) * rate
    bend = bend + (pin_stiffness * pressed * rate**2).sum(axis=0)
    slope = np.cumsum(np.vstack([start, np.take_along_axis(jump * compression, order, axis=0)]), axis=0)
    curvature = np.cumsum(np.vstack([bend, np.take_along_axis(jump * rate, order, axis=0)]), axis=0)
    where = np.take_along_axis(where, order, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        rising = slope[:-1] + curvature[:-1] * where >= 0.0
        piece = np.where(rising.any(axis=0), rising.argmax(axis=0), len(where))[np.newaxis]
        length = -np.take_along_axis(slope, piece, axis=0)[0] / np.take_along_axis(curvature, piece, axis=0)[0]
    return np.where(length >= 0.0, length, np.nan)
