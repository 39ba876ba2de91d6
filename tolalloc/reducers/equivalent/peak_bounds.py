"""What is certain of the peak-to-peak of random units over boxes of zones and clearances.

At two fixed angles the transmission error of a unit is a small convex problem whose data are linear in the scales of
its zones. Which contacts may change over a box bounds its derivative by every scale, and thus the peak-to-peak.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.models.unit_bounds import Least, ScaledUnits, Sign, least_by_slopes
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.cycloid.solvers import LAWS
from tolalloc.reducers.cycloid.solvers.pins import pin_forces
from tolalloc.reducers.equivalent.condensation import CondensedAngles
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.solvers.records import CONVERGED

AtItems = Float[np.ndarray, " item"]
"""A number of every item: a unit of a design at an angle."""
AtVariables = Float[np.ndarray, " variable"]
"""A number of every variable of a box."""
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
_SOFT = 1e-9
"""Stiffness over its trace that is added to one of a Newton step, so that something holds a loose unit [-]."""
_ROUNDED = 1e-3
"""Way over the largest compression that is guessed besides [-]."""


AtCoordinates = Float[np.ndarray, "item coordinate"]
AtPins = Float[np.ndarray, "item pin"]
Rotated = tuple[Float[np.ndarray, "item variable"], Float[np.ndarray, "item variable"]]
"""Least and largest derivative of the carrier's rotation by every variable [rad per variable]."""


@dataclass(frozen=True, kw_only=True)
class _Curves:
    """Units at one angle each, `item`; loads at scales and settings of 0, then their change by every variable."""

    law: int  # `tolalloc.reducers.cycloid.solvers.LAWS` [-]
    stiffness: Float[np.ndarray, "item coordinate coordinate"]  # Of the retained coordinates [N/m]
    lever: Float[np.ndarray, "item coordinate pin"]  # Compression of every pin per coordinate [m/m]
    carrier: Float[np.ndarray, "item coordinate"]  # Carrier rotation per coordinate [rad/m]
    contact: Float[np.ndarray, "item pin"]  # Stiffness of a pin contact [N/m]
    log_length: Float[np.ndarray, "item pin"]  # Of the logarithmic law [-]
    force: Float[np.ndarray, "item load coordinate"]  # On the coordinates [N]
    touched: Float[np.ndarray, "item load pin"]  # Compression at no displacement [m]
    turned: Float[np.ndarray, "item load"]  # Carrier rotation at no displacement [rad]
    start: Float[np.ndarray, "item coordinate"]  # Coordinates from which equilibria are looked for [m]

    def at(self, rows: Int[np.ndarray, " chosen"]) -> _Curves:
        """Return some of the items."""
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        return _Curves(**{name: field if name == "law" else field[rows] for name, field in own.items()})

    @classmethod
    def joined(cls, parts: list[_Curves]) -> _Curves:
        """Return the items of several, one after the other."""
        names = [each.name for each in fields(cls) if each.name != "law"]
        together = {name: np.concatenate([getattr(own, name) for own in parts]) for name in names}
        return cls(law=parts[0].law, **together)

    def pins(self, compression: AtPins) -> tuple[AtPins, AtPins]:
        """Return forces of pins and their derivatives [N, N/m]."""
        return pin_forces(self.law, self.contact, self.log_length, compression)

    def tangent(self, slope: AtPins) -> Float[np.ndarray, "item coordinate coordinate"]:
        """Return the stiffness of the coordinates with contacts of some stiffness [N/m]."""
        return np.asarray(self.stiffness + (self.lever * slope[:, np.newaxis]) @ self.lever.swapaxes(1, 2))

    def unbalanced(
        self, q: AtCoordinates, touched: AtPins, force: AtCoordinates
    ) -> tuple[AtCoordinates, AtPins, AtItems]:
        """Return the unbalanced force, the stiffness of the contacts and the largest force [N, N/m, N]."""
        carried, slope = self.pins(touched + _along(self.lever, q))
        pushed, elastic = _against(self.lever, carried), _against(self.stiffness, q)
        return elastic + pushed - force, slope, np.abs(np.stack([pushed, elastic, force])).max(axis=(0, 2))

    def equilibrium(self, variables: Float[np.ndarray, "item variable"]) -> tuple[AtItems, AtPins]:
        """Return rotation [rad], NaN where none was found, and compressions [m], by Newton steps on the energy."""
        force, touched, turned = (
            field[:, 0] + (field[:, 1:] * variables.reshape(*variables.shape, *[1] * (field.ndim - 2))).sum(axis=1)
            for field in (self.force, self.touched, self.turned)
        )
        q, balanced = self.start.copy(), np.zeros(len(self.start), bool)
        for _ in range(_STEPS):
            left = np.flatnonzero(~balanced)
            own = self if len(left) == len(q) else self.at(left)
            gradient, slope, size = own.unbalanced(q[left], touched[left], force[left])
            there = np.abs(gradient).max(axis=1) <= _BALANCED * size
            balanced[left[there]] = True
            if there.all():
                break
            step = own.newton_step(gradient, slope)
            q[left] += _part(own, step, gradient, (q[left], touched[left], force[left]))[:, np.newaxis] * step
        rotation = turned + (self.carrier * q).sum(axis=1)
        return np.where(balanced, rotation, np.nan), touched + _along(self.lever, q)

    def newton_step(self, gradient: AtCoordinates, slope: AtPins) -> AtCoordinates:
        """Return the way to the minimum of the local quadratic energy [m]."""
        tangent = self.tangent(slope)
        tangent += _SOFT * np.trace(tangent, axis1=1, axis2=2)[:, np.newaxis, np.newaxis] * np.eye(tangent.shape[1])
        return np.asarray(-np.linalg.solve(tangent, gradient[..., np.newaxis])[..., 0])

    def slopes(self, centre: AtVariables, half: AtVariables) -> Rotated:
        """Return least and largest derivative of the rotation in a box, infinite where unknown [rad per variable].

        Theory page, equation (105). While every compression stays within ρ of that at the centre, the stiffness of its
        contact stays between two values, and so does what it can have moved by; a ρ that this does not exceed is one
        that is never left.
        """
        count, variables = len(self.start), centre.size
        rotation, compression = self.equilibrium(np.broadcast_to(centre, (count, variables)))
        low, high = np.full((count, variables), -np.inf), np.full((count, variables), np.inf)
        left = np.flatnonzero(np.isfinite(rotation))
        own, middle = self.at(left), compression[left]
        moved = own.moved(own.pins(middle)[1]).compression
        room = _WIDER * (np.abs(moved) * half[:, np.newaxis]).sum(axis=1)
        room += _ROUNDED * float(half.any()) * np.abs(middle).max(axis=1, keepdims=True, initial=0.0)
        for _ in range(_GUESSES):
            least, most = own.pins(middle - room)[1], own.pins(middle + room)[1]
            found = own.moved(least)
            energy = np.sqrt(((most - least)[:, np.newaxis] * found.compression**2).sum(axis=2)) / 2
            far = np.abs(found.compression) + energy[..., np.newaxis] * found.pin_yielding[:, np.newaxis]
            reached = (far * half[:, np.newaxis]).sum(axis=1)
            kept = found.sound & (reached <= room).all(axis=1)
            error = energy * found.carrier_yielding[:, np.newaxis]
            low[left[kept]], high[left[kept]] = (found.rotation - error)[kept], (found.rotation + error)[kept]
            on = np.flatnonzero(found.sound & ~kept)
            if not len(on):
                break
            left, own, middle, room = left[on], own.at(on), middle[on], np.maximum(room, _WIDER * reached)[on]
        return low, high

    def moved(self, slope: AtPins) -> _MovedContacts:
        """Return what every variable moves with contacts of some stiffness."""
        stiffness = self.tangent(slope)
        values = np.linalg.eigvalsh(stiffness)
        sound = values[:, 0] > _SOUND * values[:, -1]
        stiffness[~sound] = np.eye(stiffness.shape[1])
        loads = self.force[:, 1:].swapaxes(1, 2) - self.lever @ (
            slope[..., np.newaxis] * self.touched[:, 1:].swapaxes(1, 2)
        )
        levers = np.concatenate([self.lever, self.carrier[..., np.newaxis]], axis=2)
        solved = np.linalg.solve(stiffness, np.concatenate([levers, loads], axis=2))
        weak, by = solved[..., : levers.shape[2]], solved[..., levers.shape[2] :]
        yielding = np.sqrt(np.maximum((levers * weak).sum(axis=1), 0.0))
        return _MovedContacts(
            rotation=self.turned[:, 1:] + (self.carrier[..., np.newaxis] * by).sum(axis=1),
            compression=self.touched[:, 1:] + by.swapaxes(1, 2) @ self.lever,
            pin_yielding=yielding[:, :-1],
            carrier_yielding=yielding[:, -1],
            sound=sound,
        )


@dataclass(frozen=True, kw_only=True)
class _MovedContacts:
    """What every variable moves, and the root of what a unit force moves along itself."""

    rotation: Float[np.ndarray, "item variable"]  # Of the carrier [rad per variable]
    compression: Float[np.ndarray, "item variable pin"]  # Of every contact [m per variable]
    pin_yielding: Float[np.ndarray, "item pin"]  # Under a force on a pin [√(m/N)]
    carrier_yielding: AtItems  # Under a torque on the carrier [√(rad/(N·m))]
    sound: Bool[np.ndarray, " item"]  # Whether anything holds the unit


def _part(
    curves: _Curves, step: AtCoordinates, gradient: AtCoordinates, place: tuple[AtCoordinates, AtPins, AtCoordinates]
) -> AtItems:
    """Return how much of a step is gone, halved until the energy's slope along it has fallen to a half."""
    q, touched, force = place
    part, first = np.ones(len(step)), (gradient * step).sum(axis=1)
    for _ in range(_STEPS):
        there, *_ = curves.unbalanced(q + part[:, np.newaxis] * step, touched, force)
        rising = (there * step).sum(axis=1) > -first / 2
        if not rising.any():
            break
        part = np.where(rising, part / 2, part)
    return part


def _loads(
    model: EquivalentModel, tables: CondensedAngles, values: Float[np.ndarray, "item load value"], start: AtCoordinates
) -> _Curves:
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
        law=LAWS[model.reducer.stiffness.pin_contact_law],
        stiffness=tables.stiffness,
        lever=lever.reshape(items, lever.shape[1], -1),
        carrier=tables.carrier_by_retained,
        contact=tables.contact_stiffness,
        log_length=tables.contact_log_length,
        force=rows @ tables.load,
        touched=touched.reshape(items, values.shape[1], -1),
        turned=(rows @ tables.carrier_by_load[:, :, np.newaxis])[..., 0],
        start=start,
    )


@dataclass(frozen=True, kw_only=True)
class PeakBounds:
    """Bounds of the peak-to-peak of units, each from the largest and the smallest angle of some of its curves."""

    units: int  # Units, each with as many pairs of angles as there are designs [-]
    curves: _Curves  # Of every design and unit, at the angle of its largest, then of its smallest error

    @classmethod
    def of(
        cls,
        model: EquivalentModel,
        torque: float,
        units: ScaledUnits,
        designs: Float[np.ndarray, "design variable"],
        errors: Callable[[Float[np.ndarray, "unit column"], Float[np.ndarray, " setting"]], Float[np.ndarray, "..."]],
    ) -> PeakBounds:
        """Return the bounds of units, sharpest near some designs, scales [-] and settings.

        The errors are all columns of the model, from deviations and settings, in which they are linear [m, angles rad].
        """
        count, groups, variables = len(units.standard), units.groups, designs.shape[1]
        every = np.concatenate([np.zeros((1, variables)), np.eye(variables)])
        at = [errors(units.deviations(own[np.newaxis, :groups]), own[groups:]) for own in every]
        columns = np.stack([at[0], *(own - at[0] for own in at[1:])], axis=1)
        mapped, layout = model.error_columns, model.error_columns.layout
        values = (mapped.matrix @ columns.reshape(-1, columns.shape[2]).T).T.reshape(*columns.shape[:2], -1)
        values[:, 0] += mapped.map.nominal
        values[:, 0, layout.torque] = torque
        curves = []
        for design in designs:
            own = at[0] + np.tensordot(columns[:, 1:], design, axes=(1, 0))
            angles = model.extremes(own, torque).carrier_angle
            tables = model.tables_at(np.where(np.isfinite(angles), angles, 0.0).ravel())
            start = [
                _retained(model, CondensedAngles(*(field[2 * unit : 2 * unit + 2] for field in tables)), each, torque)
                for unit, each in enumerate(own)
            ]
            curves.append(_loads(model, tables, np.repeat(values, 2, axis=0), np.concatenate(start)))
        return cls(units=count, curves=_Curves.joined(curves))

    def least(self, lower: AtVariables, upper: AtVariables, sign: Sign, rows: Int[np.ndarray, " unit"]) -> Least:
        """Return what the peak-to-peak is at least anywhere in a box [arcsec]; of its largest value nothing."""
        variables = lower.size
        if sign < 0:
            return np.full(len(rows), -np.inf), np.full((len(rows), variables), np.inf)
        designs = len(self.curves.start) // (2 * self.units)
        pairs = (np.arange(designs)[:, np.newaxis] * self.units + rows).ravel()
        curves = self.curves.at((2 * pairs[:, np.newaxis] + np.arange(2)).ravel())
        low, high = curves.slopes((lower + upper) / 2, (upper - lower) / 2)
        low, high = low[0::2] - high[1::2], high[0::2] - low[1::2]
        known = np.flatnonzero(np.isfinite(low).all(axis=1) & np.isfinite(high).all(axis=1))
        start, fall = least_by_slopes((low[known], high[known]), lower, upper)
        own = curves.at((2 * known[:, np.newaxis] + np.arange(2)).ravel())
        rotation, _ = own.equilibrium(np.repeat(start, 2, axis=0))
        least = (rotation[0::2] - rotation[1::2] + fall.sum(axis=1)) / ARCSECOND
        values, reach = np.full(len(pairs), -np.inf), np.full((len(pairs), variables), np.inf)
        values[known] = np.where(np.isfinite(least), least, -np.inf)
        reach[known] = np.maximum(np.abs(low[known]), np.abs(high[known])) * (upper - lower) / ARCSECOND
        by_design, every = values.reshape(designs, -1), np.arange(len(rows))
        best = by_design.argmax(axis=0)
        return np.asarray(by_design[best, every]), np.asarray(reach.reshape(designs, -1, variables)[best, every])


def _retained(
    model: EquivalentModel, tables: CondensedAngles, errors: Float[np.ndarray, " column"], torque: float
) -> Float[np.ndarray, "angle coordinate"]:
    """Return the coordinates of a unit at its two angles, 0 where it has no equilibrium [m]."""
    solved = model.equilibria_of(tables, errors[np.newaxis], torque, np.zeros(2))
    return np.asarray(np.where((solved.status == CONVERGED)[..., np.newaxis], solved.retained, 0.0)[0])


def _along(lever: Float[np.ndarray, "item coordinate pin"], q: AtCoordinates) -> AtPins:
    return np.asarray((q[:, np.newaxis] @ lever)[:, 0])


def _against(lever: Float[np.ndarray, "item coordinate pin"], force: AtPins) -> AtCoordinates:
    return np.asarray((lever @ force[..., np.newaxis])[..., 0])
