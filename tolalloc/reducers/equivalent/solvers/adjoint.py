"""Exact derivatives of the transmission error by every value and every stiffness, at the converged contact set.

At equilibrium the carrier rotation is w·q + t·v with the energy's gradient zero: one solve of its tangent for the
adjoint λ gives the derivative by everything that moves the gradient. A weighted sum of pin forces goes the same way.

An extreme of the curve is a kink, where a branch A that rises with the angle meets a branch B that falls. Its value
follows from A(θ, ε) = B(θ, ε), so its derivative is the mean of both branches' derivatives, each weighted by the
other's slope. Where the extreme is smooth both slopes vanish alike and the mean is as good as either.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tolalloc.reducers.equivalent.solvers.contact_solver import (
    assemble,
    compress,
    contact_force,
    play_force,
    solve_tangent,
    values_of,
)
from tolalloc.reducers.equivalent.solvers.records import CONVERGED, NOT_FINITE, Given
from tolalloc.reducers.equivalent.solvers.workspace import interpolation, make_memory, solve_between
from tolalloc.running.compiled import in_threads, jit, jit_in_place

_AT_ONCE = 32  # samples that a thread takes together


@jit
def _adjoint(problem, work, carrier_by_retained, carrier, of_pins, q, adjoint):
    """Solve tangent·λ = ∂(carrier·rotation + Σ of_pin·force)/∂q at the equilibrium q.

    The compressions stay in the work space.
    """
    compress(problem, q, work.compression, work.play)
    assemble(problem, work.compression, work.play, q, work.gradient, work.tangent)
    aim, pins = -carrier * carrier_by_retained, problem.by_disc.shape[2]
    for c in range(of_pins.size):
        if of_pins[c] == 0.0:
            continue
        d, k = c // pins, c % pins
        _, slope = contact_force(problem, c, work.compression[c])
        for i in range(3):
            aim[3 * d + i] -= of_pins[c] * slope * problem.by_disc[d, i, k]
    solve_tangent(work.tangent, aim, adjoint)


@jit_in_place
def _pin_adjoints(problem, work, of_pins, adjoint, tilt_by_pin, weight_of_pin):
    """Set the derivative by every pin's compression and by half its tilt; return that by ln C.

    It is that of the sum of forces itself, less λ·∂gradient/∂compression.
    """
    by_stiffness = 0.0
    pins = problem.by_disc.shape[2]
    for c in range(weight_of_pin.size):
        d, k = c // pins, c % pins
        force, slope = contact_force(problem, c, work.compression[c])
        lever = -of_pins[c]
        for i in range(3):
            lever += problem.by_disc[d, i, k] * adjoint[3 * d + i]
        weight_of_pin[c] = -slope * lever
        tilt_by_pin[c] = 0.0
        half = problem.half_tilt[c]
        if abs(work.compression[c]) < half:
            tilt_by_pin[c] = -lever * (slope - force / half)  # ∂F/∂half of equation (31) at constant compression
        by_stiffness -= lever * force  # under every law the force grows in proportion to C
    return by_stiffness


@jit_in_place
def _add_pins(at, weight, tables, layout, weight_of_pin, out):
    """Add the derivative by all values that act on the pins at one node."""
    pins, table = layout.pins, tables.contact_by_error[at]
    for d in range(table.shape[0]):
        for k in range(pins):
            own = weight * weight_of_pin[d * pins + k]
            if own == 0.0:
                continue
            out[layout.pin + k] += own * table[d, 0, k]
            out[layout.pin + pins + k] += own * table[d, 1, k]
            out[layout.pin + 2 * pins + k] += own
            for m in range(layout.waves):
                out[layout.wave + d * layout.waves + m] += own * table[d, 2 + m, k]
            for kind in range(2):
                tooth = layout.tooth + (2 * d + kind) * layout.teeth + tables.tooth[at, d, k]
                out[tooth] += own * table[d, 2 + layout.waves + kind, k]


@jit_in_place
def _add_tilt(problem, turn, face_width, layout, values, tilt_by_pin, factor, out):
    """Add the derivative by the tilts of the discs."""
    pins = layout.pins
    for d in range(problem.by_disc.shape[0]):
        x, y = values[layout.tilt + 2 * d], values[layout.tilt + 2 * d + 1]
        tilt_x, tilt_y = turn[0] * x - turn[1] * y, turn[1] * x + turn[0] * y
        for k in range(pins):
            nx, ny = problem.by_disc[d, 0, k], problem.by_disc[d, 1, k]
            side = 1.0 if tilt_y * nx - tilt_x * ny > 0.0 else -1.0
            own = factor * 0.5 * face_width * side * tilt_by_pin[d * pins + k]
            out[layout.tilt + 2 * d] += own * (turn[1] * nx - turn[0] * ny)
            out[layout.tilt + 2 * d + 1] += own * (turn[0] * nx + turn[1] * ny)


@jit_in_place
def _add_rows(at, weight, carrier, tables, layout, values, q, adjoint, play_pull, own_play, out, by_row):
    """Add the derivative by the spring rows' values and by all their stiffnesses at one node."""
    rows, elements = tables.row_stiffness.shape[1], tables.play_stiffness.shape[1]
    for m in range(layout.torque + 1):
        value = carrier * tables.carrier_by_load[at, m]
        for i in range(q.size):
            value += tables.load[at, m, i] * adjoint[i]
        for e in range(elements):
            value += play_pull[e, 0] * tables.play_by_load[at, m, e, 0]
            value += play_pull[e, 1] * tables.play_by_load[at, m, e, 1]
        out[m] += weight * value
    for r in range(rows):
        # A row's adjoint compression: through the retained coordinates and, at the torque's place, through the others.
        compression, lever = 0.0, carrier * tables.row_by_load[at, r, layout.torque]
        for m in range(layout.torque + 1):
            compression += tables.row_by_load[at, r, m] * values[m]
        for i in range(q.size):
            compression += tables.row_by_retained[at, r, i] * q[i]
            lever += tables.row_by_retained[at, r, i] * adjoint[i]
        by_row[r] -= weight * lever * compression
    for e in range(elements):
        by_row[rows + e] += weight * own_play[e]


@jit
def _add_derivative(position, factor, carrier, of_pins, tables, layout, design, values, memory, derivative, s):
    """Add factor times the derivatives of carrier·rotation + Σ of_pin·force at one position; return the status."""
    problem, work, _, carrier_by_retained = memory
    q, adjoint = np.zeros(work.step.size), np.empty(work.step.size)
    rotation, status, _, _ = solve_between(position, tables, layout, design.face_width, values, q, memory)
    if status != CONVERGED:
        return status
    derivative.rotation[s] += factor * rotation
    _adjoint(problem, work, carrier_by_retained, carrier, of_pins, q, adjoint)
    weight_of_pin, tilt_by_pin = np.empty(problem.contact.size), np.empty(problem.contact.size)
    derivative.by_pin[s] += factor * _pin_adjoints(problem, work, of_pins, adjoint, tilt_by_pin, weight_of_pin)
    elements = problem.clearance.size
    play_pull, own_play = np.zeros((elements, 2)), np.zeros(elements)
    for e in range(elements):
        x, y, stiffness, free = work.play[e, 0], work.play[e, 1], problem.play_stiffness[e], problem.clearance[e]
        ax, ay = 0.0, 0.0
        for i in range(q.size):
            ax += problem.play_by_retained[e, 0, i] * adjoint[i]
            ay += problem.play_by_retained[e, 1, i] * adjoint[i]
        fx, fy, xx, xy, yy = play_force(stiffness, free, x, y)
        play_pull[e, 0], play_pull[e, 1] = -(xx * ax + xy * ay), -(xy * ax + yy * ay)
        own_play[e] = -(fx * ax + fy * ay) / stiffness
        if fx * fx + fy * fy > 0.0 and values[layout.clearance + e] > 0.0:
            reach = np.sqrt(x * x + y * y)
            derivative.by_value[s, layout.clearance + e] += factor * stiffness * (x * ax + y * ay) / reach
    first, weights = interpolation(position)
    turn = np.zeros(2)
    for node in range(4):
        at, weight = first + node, factor * weights[node]
        turn += weights[node] * tables.turn[at]
        _add_pins(at, weight, tables, layout, weight_of_pin, derivative.by_value[s])
        _add_rows(
            at, weight, carrier, tables, layout, values, q, adjoint, play_pull, own_play,
            derivative.by_value[s], derivative.by_row[s],
        )  # fmt: skip
    _add_tilt(problem, turn, design.face_width, layout, values, tilt_by_pin, factor, derivative.by_value[s])
    for d in range(problem.by_disc.shape[0]):
        for k in range(layout.pins):
            lever = abs(problem.by_disc[d, 2, k])
            derivative.by_value[s, layout.flank] -= factor * weight_of_pin[d * layout.pins + k] * lever
    return status


@jit
def _slope(position, step, tables, layout, design, values, memory, q):
    """Return the change of the carrier rotation over one step of the position, from half before to half behind."""
    rotation = np.empty(2)
    for side in range(2):
        q[:] = 0.0
        rotation[side] = solve_between(
            position + (side - 0.5) * step, tables, layout, design.face_width, values, q, memory
        )[0]
    return rotation[1] - rotation[0]


@jit
def _clear(derivative, s, value):
    derivative.rotation[s], derivative.by_pin[s] = value, value
    derivative.by_value[s], derivative.by_row[s] = value, value


@jit
def _peak_to_peaks(first, last, tables, layout, mapped, design, errors, torque, position, step, derivative):
    memory = make_memory(design.law, tables)
    values, q, no_pins = np.empty((1, layout.end)), np.empty(tables.load.shape[2]), np.zeros(memory[0].contact.size)
    for s in range(first, last):
        if not np.isfinite(position[s]).all():
            _clear(derivative, s, np.nan)
            continue
        _clear(derivative, s, 0.0)
        values_of(errors[s : s + 1], torque, layout, mapped, values)
        memory[2].first[:] = -1
        for extreme in range(2):
            sign = 1.0 - 2.0 * extreme
            before, behind = position[s, extreme] - 2.0 * step, position[s, extreme] + 2.0 * step
            rise = max(sign * _slope(before, step, tables, layout, design, values[0], memory, q), 0.0)
            fall = max(-sign * _slope(behind, step, tables, layout, design, values[0], memory, q), 0.0)
            share = rise / (rise + fall) if rise + fall > 0.0 else 0.5
            for at, factor in ((before, sign * (1.0 - share)), (behind, sign * share)):
                given = (tables, layout, design, values[0], memory, derivative, s)
                outcome = _add_derivative(at, factor, 1.0, no_pins, *given)
                derivative.status[s] = max(derivative.status[s], outcome)


@jit
def _values(first, last, tables, layout, mapped, design, errors, torque, position, carrier, of_pins, derivative):
    memory, values = make_memory(design.law, tables), np.empty((1, layout.end))
    positions = position.size // torque.size
    for s in range(first, last):
        sample = s // positions
        _clear(derivative, s, 0.0)
        derivative.status[s] = NOT_FINITE
        if values_of(errors[sample : sample + 1], torque[sample], layout, mapped, values)[0]:
            memory[2].first[:] = -1
            given = (tables, layout, design, values[0], memory, derivative, s)
            derivative.status[s] = _add_derivative(position[s], 1.0, carrier, of_pins[sample], *given)


def solve_peak_to_peak_derivatives(tables: Any, given: Given, position: Any, step: Any, derivative: Any) -> None:
    """Fill the derivatives of the peak-to-peak from the positions of its two extremes, [sample, 2].

    ``step`` is the distance in nodes within which the extremes were found. Theory page equation (23).
    """

    def solve(part: slice) -> None:
        _peak_to_peaks(part.start, part.stop, tables, *given, position, step, derivative)

    in_threads(solve, len(given[3]), _AT_ONCE)


def solve_value_derivatives(
    tables: Any, given: Given, position: Any, carrier: float, of_pins: Any, derivative: Any
) -> None:
    """Fill the derivatives of carrier·rotation + Σ of_pin·force of every sample, theory page equation (23) [per m].

    Each at its torque. ``position`` has as many for each sample, one sample after another, as have the derivatives;
    ``of_pins`` are the weights of a sample's pins, disc by disc.
    """

    def solve(part: slice) -> None:
        _values(part.start, part.stop, tables, *given, position, carrier, of_pins, derivative)

    in_threads(solve, position.size, _AT_ONCE)
