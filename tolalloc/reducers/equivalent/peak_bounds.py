"""What is certain of the peak-to-peak of random units over boxes of zones and clearances.

At two fixed angles the transmission error of a unit is a small convex problem whose data are linear in the scales of
its zones. Which contacts may change over a box bounds its derivative by every scale, and thus the peak-to-peak.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from tolalloc.models.unit_bounds import Least, ScaledUnits, Sign, least_by_slopes
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.cycloid.solvers import LAWS
from tolalloc.reducers.cycloid.solvers.pins import pin_slopes
from tolalloc.reducers.equivalent.condensation import CondensedAngles
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.solvers.records import CONVERGED

_STEPS = 40
"""Largest number of Newton steps, and of halvings of one [-]."""
_BALANCED = 1e-9
"""Unbalanced force over the largest one below which an equilibrium is found [-]."""
_GUESSES = 12
"""Guesses of how far compressions move over a box [-]."""
_WIDER = 1.15
"""Factor from one of them to the next [-]."""
_SOUND = 1e-13
"""Least eigenvalue of a stiffness over the largest one above which it is no rounding [-]."""


class _Curves(NamedTuple):
    """Units at one angle each, `item`; loads at scales and settings of 0, then their change by every variable."""

    stiffness: Float[np.ndarray, "item coordinate coordinate"]  # Of the retained coordinates [N/m]
    lever: Float[np.ndarray, "item coordinate pin"]  # Compression of every pin per coordinate [m/m]
    carrier: Float[np.ndarray, "item coordinate"]  # Carrier rotation per coordinate [rad/m]
    contact: Float[np.ndarray, "item pin"]  # Stiffness of a pin contact [N/m]
    log_length: Float[np.ndarray, "item pin"]  # Of the logarithmic law [-]
    force: Float[np.ndarray, "item load coordinate"]  # On the coordinates [N]
    touched: Float[np.ndarray, "item load pin"]  # Compression at no displacement [m]
    turned: Float[np.ndarray, "item load"]  # Carrier rotation at no displacement [rad]


def _loads(model: EquivalentModel, tables: CondensedAngles, values: Float[np.ndarray, "item load value"]) -> _Curves:
    """Return the units at their angles from what their columns and their change make of the values."""
    layout, items = model.error_columns.layout, len(tables.stiffness)
    discs, pins = tables.contact_by_disc.shape[1], layout.pins
    lever = np.zeros((items, tables.stiffness.shape[1], discs, pins))
    touched = np.zeros((*values.shape[:2], discs, pins))
    rows = values[..., : layout.torque + 1]
    radial, tangential, radius = (values[..., layout.pin + at * pins : layout.pin + (at + 1) * pins] for at in range(3))
    for disc in range(discs):
        by_disc, by_error = tables.contact_by_disc[:, disc], tables.contact_by_error[:, disc, :, np.newaxis]
        lever[:, 3 * disc : 3 * disc + 3, disc] = by_disc
        own = by_error[:, 0] * radial + by_error[:, 1] * tangential + radius
        own -= values[..., layout.flank, np.newaxis] * np.abs(by_disc[:, 2])[:, np.newaxis]
        first = layout.wave + disc * layout.waves
        own += values[..., first : first + layout.waves] @ by_error[:, 2 : 2 + layout.waves, 0]
        for kind in range(2):
            teeth = layout.tooth + (2 * disc + kind) * layout.teeth
            met = np.repeat(tables.tooth[:, disc, np.newaxis], values.shape[1], axis=1)
            own += np.take_along_axis(values, teeth + met, axis=2) * by_error[:, 2 + layout.waves + kind]
        touched[:, :, disc] = own
    return _Curves(
        stiffness=tables.stiffness,
        lever=lever.reshape(items, lever.shape[1], -1),
        carrier=tables.carrier_by_retained,
        contact=tables.contact_stiffness,
        log_length=tables.contact_log_length,
        force=rows @ tables.load,
        touched=touched.reshape(items, values.shape[1], -1),
        turned=(rows @ tables.carrier_by_load[:, :, np.newaxis])[..., 0],
    )


@dataclass(frozen=True, kw_only=True)
class PeakBounds:
    """Bounds of the peak-to-peak of units, each from the largest and the smallest angle of some of its curves."""

    law: int  # `tolalloc.reducers.cycloid.solvers.LAWS` [-]
    units: int  # Units, each with as many pairs of angles as there are designs [-]
    curves: _Curves  # Of every design and unit, at the angle of its largest, then of its smallest error
    start: Float[np.ndarray, "item coordinate"]  # Coordinates at these designs [m]

    @classmethod
    def of(
        cls,
        model: EquivalentModel,
        torque: float,
        units: ScaledUnits,
        designs: Float[np.ndarray, "design variable"],
        errors: Callable[[Float[np.ndarray, "unit column"], Float[np.ndarray, " setting"]], Float[np.ndarray, "..."]],
    ) -> PeakBounds:
        """Return the bounds of units, sharpest near some designs.

        Parameters
        ----------
        model, torque
            The equivalent model and the torque on its carrier [N·m].
        units
            Random units over the scales.
        designs
            Scales [-] and settings of the designs whose extreme angles are taken.
        errors
            From deviations and settings, in which they are linear, all columns of the model [m, angles rad].
        """
        count, groups, variables = len(units.standard), units.groups, designs.shape[1]
        every = np.concatenate([np.zeros((1, variables)), np.eye(variables)])
        at = [errors(units.deviations(own[np.newaxis, :groups]), own[groups:]) for own in every]
        columns = np.stack([at[0], *(own - at[0] for own in at[1:])], axis=1)
        mapped, layout = model.error_columns, model.error_columns.layout
        values = (mapped.matrix @ columns.reshape(-1, columns.shape[2]).T).T.reshape(*columns.shape[:2], -1)
        values[:, 0] += mapped.map.nominal
        values[:, 0, layout.torque] = torque
        curves, starts = [], []
        for design in designs:
            own = at[0] + np.tensordot(columns[:, 1:], design, axes=(1, 0))
            angles = model.extremes(own, torque).carrier_angle
            tables = model.tables_at(np.where(np.isfinite(angles), angles, 0.0).ravel())
            curves.append(_loads(model, tables, np.repeat(values, 2, axis=0)))
            for unit in range(count):
                pair = slice(2 * unit, 2 * unit + 2)
                alone = CondensedAngles(*(field[pair] for field in tables))
                solved = model.equilibria_of(alone, own[unit : unit + 1], torque, angles[unit])
                starts.append(np.where((solved.status == CONVERGED)[..., np.newaxis], solved.retained, 0.0)[0])
        return cls(
            law=LAWS[model.reducer.stiffness.pin_contact_law],
            units=count,
            curves=_Curves(*(np.concatenate(parts) for parts in zip(*curves, strict=True))),
            start=np.concatenate(starts),
        )

    def least(self, lower: Float[np.ndarray, " variable"], upper: Float[np.ndarray, " variable"], sign: Sign) -> Least:
        """Return what the peak-to-peak is at least anywhere in a box [arcsec]; of its largest value nothing."""
        variables = lower.size
        if sign < 0:
            return np.full(self.units, -np.inf), np.full((self.units, variables), np.inf)
        centre, half = (lower + upper) / 2, (upper - lower) / 2
        low, high = self._slopes(np.broadcast_to(centre, (len(self.start), variables)), half)
        low, high = low[0::2] - high[1::2], high[0::2] - low[1::2]
        known = np.isfinite(low).all(axis=1) & np.isfinite(high).all(axis=1)
        low, high = np.where(known[:, np.newaxis], low, 0.0), np.where(known[:, np.newaxis], high, 0.0)
        start, fall = least_by_slopes((low, high), lower, upper)
        rotation, *_ = self._equilibrium(np.repeat(start, 2, axis=0))
        values = (rotation[0::2] - rotation[1::2] + fall.sum(axis=1)) / ARCSECOND
        values = np.where(known & np.isfinite(values), values, -np.inf).reshape(-1, self.units)
        reach = np.where(known[:, np.newaxis], np.maximum(np.abs(low), np.abs(high)), np.inf) * (upper - lower)
        best = values.argmax(axis=0)
        return values.max(axis=0), reach.reshape(-1, self.units, variables)[best, np.arange(self.units)] / ARCSECOND

    def _pins(
        self, compression: Float[np.ndarray, "item pin"]
    ) -> tuple[Float[np.ndarray, "item pin"], Float[np.ndarray, "item pin"]]:
        """Return forces of pins and their derivatives [N, N/m]."""
        force, slope, flat = np.empty(compression.size), np.empty(compression.size), compression.ravel()
        pin_slopes(self.law, self.curves.contact.ravel(), self.curves.log_length.ravel(), flat, force, slope)
        return force.reshape(compression.shape), slope.reshape(compression.shape)

    def _stiffness(self, slope: Float[np.ndarray, "item pin"]) -> Float[np.ndarray, "item coordinate coordinate"]:
        lever = self.curves.lever
        return np.asarray(self.curves.stiffness + (lever * slope[:, np.newaxis]) @ lever.swapaxes(1, 2))

    def _equilibrium(
        self, variables: Float[np.ndarray, "item variable"]
    ) -> tuple[Float[np.ndarray, " item"], Float[np.ndarray, "item pin"], Float[np.ndarray, "item coordinate"]]:
        """Return rotation [rad], NaN where none was found, compressions and coordinates [m]."""
        own = self.curves
        force, touched, turned = (
            field[:, 0] + (field[:, 1:] * variables.reshape(*variables.shape, *[1] * (field.ndim - 2))).sum(axis=1)
            for field in (own.force, own.touched, own.turned)
        )

        def unbalanced(
            q: Float[np.ndarray, "item coordinate"],
        ) -> tuple[Float[np.ndarray, "item coordinate"], Float[np.ndarray, "item pin"], Float[np.ndarray, " item"]]:
            carried, slope = self._pins(touched + _along(own.lever, q))
            pushed = _against(own.lever, carried)
            elastic = (own.stiffness @ q[..., np.newaxis])[..., 0]
            size = np.abs(np.stack([pushed, elastic, force])).max(axis=(0, 2))
            return elastic + pushed - force, slope, size

        q = self.start.copy()
        for _ in range(_STEPS):
            gradient, slope, size = unbalanced(q)
            left = np.abs(gradient).max(axis=1) > _BALANCED * size
            if not left.any():
                break
            tangent = self._stiffness(slope)
            tangent += 1e-9 * np.trace(tangent, axis1=1, axis2=2)[:, np.newaxis, np.newaxis] * np.eye(q.shape[1])
            step = -np.linalg.solve(tangent, gradient[..., np.newaxis])[..., 0]
            part, first = np.where(left, 1.0, 0.0), (gradient * step).sum(axis=1)
            for _ in range(_STEPS):
                rising = (unbalanced(q + part[:, np.newaxis] * step)[0] * step).sum(axis=1) > -0.5 * first
                if not (rising & left).any():
                    break
                part = np.where(rising, part / 2, part)
            q = q + part[:, np.newaxis] * step
        rotation = turned + (own.carrier * q).sum(axis=1)
        gradient, _, size = unbalanced(q)
        balanced = np.abs(gradient).max(axis=1) <= 10 * _BALANCED * size
        return np.where(balanced, rotation, np.nan), touched + _along(own.lever, q), q

    def _slopes(
        self, centre: Float[np.ndarray, "item variable"], half: Float[np.ndarray, " variable"]
    ) -> tuple[Float[np.ndarray, "item variable"], Float[np.ndarray, "item variable"]]:
        """Return the least and the largest derivative of the rotation in a box, not finite where none is known.

        Theory page, equation (94). While every compression stays within ρ of that at the centre, the stiffness of its
        contact stays between two values, and so does what it can have moved by; a ρ that this does not exceed is one
        that is never left.
        """
        own = self.curves
        _, compression, _ = self._equilibrium(centre)
        _, slope = self._pins(compression)
        moved = self._moved(slope)[1]
        room = _WIDER * (np.abs(moved) * half[:, np.newaxis]).sum(axis=1) + 1e-3 * np.abs(compression).max(
            axis=1, keepdims=True
        ) * float(half.any())
        kept = np.zeros(len(compression), bool)
        for _ in range(_GUESSES):
            low, high = self._pins(compression - room)[1], self._pins(compression + room)[1]
            rotation, moved, weak, sound = self._moved(low)
            energy = np.sqrt((((high - low)[:, np.newaxis]) * moved**2).sum(axis=2)) / 2
            levers = np.concatenate([own.lever, own.carrier[..., np.newaxis]], axis=2)
            yielding = np.sqrt(np.maximum((levers * weak).sum(axis=1), 0.0))
            far = np.abs(moved) + energy[..., np.newaxis] * yielding[:, np.newaxis, :-1]
            reached = (far * half[:, np.newaxis]).sum(axis=1)
            kept = sound & (reached <= room).all(axis=1)
            if kept.all():
                break
            room = np.where(kept[:, np.newaxis], room, np.maximum(room, _WIDER * reached))
        error = np.where(kept[:, np.newaxis], energy * yielding[:, -1:], np.inf)
        return rotation - error, rotation + error

    def _moved(
        self, slope: Float[np.ndarray, "item pin"]
    ) -> tuple[
        Float[np.ndarray, "item variable"],
        Float[np.ndarray, "item variable pin"],
        Float[np.ndarray, "item coordinate weak"],
        Float[np.ndarray, " item"],
    ]:
        """Return the derivatives of rotation and compressions by every variable with contacts of some stiffness.

        Also the displacement under a unit force along every pin and the carrier, and whether anything holds the unit.
        """
        own, stiffness = self.curves, self._stiffness(slope)
        values = np.linalg.eigvalsh(stiffness)
        sound = values[:, 0] > _SOUND * values[:, -1]
        stiffness[~sound] = np.eye(stiffness.shape[1])
        loads = own.force[:, 1:].swapaxes(1, 2) - own.lever @ (
            slope[..., np.newaxis] * own.touched[:, 1:].swapaxes(1, 2)
        )
        right = np.concatenate([own.lever, own.carrier[..., np.newaxis], loads], axis=2)
        solved = np.linalg.solve(stiffness, right)
        pins = own.lever.shape[2]
        weak, by = solved[..., : pins + 1], solved[..., pins + 1 :]
        moved = own.touched[:, 1:] + by.swapaxes(1, 2) @ own.lever
        rotation = own.turned[:, 1:] + (own.carrier[..., np.newaxis] * by).sum(axis=1)
        return rotation, moved, weak, sound


def _along(
    lever: Float[np.ndarray, "item coordinate pin"], q: Float[np.ndarray, "item coordinate"]
) -> Float[np.ndarray, "item pin"]:
    return np.asarray((q[:, np.newaxis] @ lever)[:, 0])


def _against(
    lever: Float[np.ndarray, "item coordinate pin"], force: Float[np.ndarray, "item pin"]
) -> Float[np.ndarray, "item coordinate"]:
    return np.asarray((lever @ force[..., np.newaxis])[..., 0])
