"""The tables of an assembly: what is turned at every step, what that leaves of limits, and what precision buys."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import isnan, nan
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from tolalloc.reading.units import ARCSECOND
from tolalloc.reports.columns import Table, of_positions
from tolalloc.wings.assembly.adjustment import AdjustedParts, AssemblyResult
from tolalloc.wings.assembly.steps import adjustable

if TYPE_CHECKING:
    import pandas as pd

READ = 2
"""Digits behind the point of an arcsecond that a bench can turn or read [-]."""
_KEPT = 6
"""Digits behind the point of a number in a report, whatever its unit; the others are rounding errors [-]."""
PRECISION = "precision Q [-]"
"""Header of the weight of the final angles."""


def rounded(table: Table[Any]) -> pd.DataFrame:
    """Return a table without digits that mean nothing, and without −0."""
    found = table.frame().round(_KEPT)
    numbers = found.select_dtypes("float").columns
    found[numbers] = found[numbers] + 0.0
    return found


def at_state_weight(result: AssemblyResult) -> int:
    """Return where the plan's precision stands in the sweep; 0, nothing turned, stands first."""
    return int(np.flatnonzero(result.sweep.state_weights == result.plan.state_weight)[0])


def norm_of(result: AssemblyResult) -> str:
    """Return what the norm of measured parts is called."""
    return "norm" if (result.plan.weights == 1).all() else "weighted norm"


def has_limits(result: AssemblyResult) -> bool:
    """Return whether any angle is limited; costs may be stated without."""
    required = result.plan.requirements
    return required is not None and bool(np.isfinite([required.tilt_limit, required.rotation_limit]).any())


def tilt_and_rotation(
    angles: Float[np.ndarray, "*steps state"],
) -> tuple[Float[np.ndarray, "*steps part"], Float[np.ndarray, "*steps part"]]:
    """Return √(x² + y²) and z of every part from x, y and z part by part [rad]; of standard deviations likewise."""
    of_parts = angles.reshape(*angles.shape[:-1], -1, 3)
    return np.hypot(of_parts[..., 0], of_parts[..., 1]), of_parts[..., 2]


def states(result: AssemblyResult) -> Float[np.ndarray, "step 2 state"]:
    """Return the angles after each step, as mounted and as adjusted: measured, or three standard deviations [rad]."""
    if result.measured is None:
        return 3 * result.expected
    sequence = result.measured.sequence
    return np.stack([sequence.mounted, sequence.adjusted], axis=1)


def turns(result: AssemblyResult) -> Float[np.ndarray, "step part 3"]:
    """Return what is turned at every step: for measured parts, or three standard deviations [rad]."""
    if result.measured is not None:
        return result.measured.sequence.adjustments.reshape(len(result.plan.steps), -1, 3)
    plan = result.plan
    maps = result.gains.errors
    variances = maps.adjustments_by_part**2 @ plan.variances + (maps.adjustments_by_noise**2).sum(axis=-1)
    return np.asarray(3 * np.sqrt(variances).reshape(len(plan.steps), -1, 3))


def step_table(result: AssemblyResult) -> pd.DataFrame:
    """Return one row per step and turned part; a part that is turned by less than can be read has none."""
    import pandas as pd

    chain, kind = result.plan.chain, "" if result.measured else ", 3σ"
    rows = []
    turned = np.round(turns(result) / ARCSECOND, READ) + 0.0  # no −0
    tilt, rotation = (np.round(each[:, 1] / ARCSECOND, READ) + 0.0 for each in tilt_and_rotation(states(result)))
    for number, step in enumerate(result.plan.steps):
        moved = np.flatnonzero(adjustable(chain, step) & turned[number].any(axis=1))
        for at in moved if moved.size else [None]:
            left = chain.names.index(step.mount) if at is None else at
            axes = np.zeros(3) if at is None else turned[number, at]
            # Turns of measured parts follow from the file; what is measured meanwhile changes nothing.
            measure = {} if result.measured else {"measure": ", ".join(step.measure) or "nothing"}
            rows.append(
                {
                    "step [-]": number + 1,
                    "mount": step.mount,
                    **measure,
                    "turn": "nothing" if at is None else chain.names[at],
                    **{f"{axis}{kind} [arcsec]": own for axis, own in zip("xyz", axes, strict=True)},
                    f"tilt left{kind} [arcsec]": tilt[number, left],
                    f"rotation left{kind} [arcsec]": rotation[number, left],
                }
            )
    return pd.DataFrame(rows)


def angle_table(result: AssemblyResult, measured: AdjustedParts) -> pd.DataFrame:
    """Return every angle of measured parts: the part's error, its tolerance, and the final state."""
    part, axis = zip(*product(result.plan.chain.names, "xyz"), strict=True)
    columns = {
        "part": part,
        "axis": axis,
        "error of the part [arcsec]": measured.errors.ravel() / ARCSECOND,
        "tolerance, ± [arcsec]": result.plan.tolerances.ravel() / ARCSECOND,
        "unadjusted [arcsec]": measured.unadjusted.ravel() / ARCSECOND,
        "unadjusted, finite rotations [arcsec]": measured.exact.ravel() / ARCSECOND,
        "adjusted [arcsec]": measured.adjusted.ravel() / ARCSECOND,
        "turns miss, 3σ [arcsec]": (3 * measured.missed).ravel() / ARCSECOND,
    }
    return rounded(of_positions("angles", columns))


def gain_table(result: AssemblyResult) -> pd.DataFrame:
    """Return K of every step, one row per angle that may be turned."""
    plan, gains = result.plan, result.gains.regulator.gains
    angles = [f"{part}.{axis}" for part, axis in product(plan.chain.names, "xyz")]
    rows = [
        (at, int(row))
        for at, step in enumerate(plan.steps)
        for row in np.flatnonzero(np.repeat(adjustable(plan.chain, step), 3))
    ]
    columns = {
        "step [-]": [at + 1 for at, _ in rows],
        "turned": [angles[row] for _, row in rows],
        **{f"{angle} [-]": [float(gains[at][row, state]) for at, row in rows] for state, angle in enumerate(angles)},
    }
    return rounded(of_positions("gains", columns))


def sweep_table(result: AssemblyResult) -> pd.DataFrame:
    """Return what is to be expected over the precision."""
    sweep, measured, names = result.sweep, result.measured, result.plan.chain.names
    norm = f"{norm_of(result)} of {measured.name} [arcsec]" if measured else ""
    columns = {
        PRECISION: sweep.state_weights,
        "all angles, rms [arcsec]": sweep.total / ARCSECOND,
        "another unit of Q takes off [%]": sweep.next_unit * 100,
        "effort [arcsec²]": sweep.effort / ARCSECOND**2,
        **({norm: measured.norms / ARCSECOND} if measured else {}),
        **{f"tilt of {name}, 3σ [arcsec]": 3 * sweep.tilt[:, at] / ARCSECOND for at, name in enumerate(names)},
        **{f"rotation of {name}, 3σ [arcsec]": 3 * sweep.rotation[:, at] / ARCSECOND for at, name in enumerate(names)},
    }
    return rounded(of_positions("sweep", columns))


@dataclass(frozen=True, kw_only=True)
class AdjustedAngle:
    """Tilt or rotation of one part before and after adjusting, as a report states it [arcsec]."""

    part: str
    angle: str  # Tilt or rotation
    before: float
    after: float
    noise: float  # What exact parts would be left with; of measured parts what the turns miss, three deviations
    limit: float  # Not a number where there is none

    def kept(self, *, measured: bool) -> str:
        """Return whether a limit is kept; in doubt where what the turns miss may lead beyond it."""
        if isnan(self.limit):
            return ""
        if abs(self.after) > self.limit:
            return "no"
        return "in doubt" if abs(self.after) + (self.noise if measured else 0.0) > self.limit else "yes"

    @property
    def risen(self) -> bool:
        """Whether adjusting leaves it larger than a bench can read."""
        return bool(np.round(abs(self.after), READ) > np.round(abs(self.before), READ))


def characteristics(result: AssemblyResult) -> tuple[AdjustedAngle, ...]:
    """Return tilts before rotations of all parts."""
    names, required = result.plan.chain.names, result.plan.requirements
    finals = np.round(_finals(result), _KEPT) + 0.0
    limits = np.full(2 * len(names), nan)
    if required is not None:
        stated = np.concatenate([required.tilt_limit, required.rotation_limit]) / ARCSECOND
        limits = np.round(np.where(np.isfinite(stated), stated, np.nan), _KEPT)
    return tuple(
        AdjustedAngle(
            part=part,
            angle=angle,
            before=float(finals[0, at]),
            after=float(finals[1, at]),
            noise=float(finals[2, at]),
            limit=float(limits[at]),
        )
        for at, (angle, part) in enumerate(product(("tilt", "rotation"), names))
    )


def characteristic_table(result: AssemblyResult) -> pd.DataFrame:
    """Return tilt and rotation of every characteristic before and after adjusting, and its limits if any are stated."""
    measured, rows = result.measured is not None, characteristics(result)
    kind, noise = ("", "turns miss") if measured else (", 3σ", "noise")
    columns: dict[str, list[Any]] = {
        "characteristic": [row.part for row in rows],
        "angle": [row.angle for row in rows],
        f"before{kind} [arcsec]": [row.before for row in rows],
        f"after{kind} [arcsec]": [row.after for row in rows],
        f"{noise}, 3σ [arcsec]": [row.noise for row in rows],
    }
    if has_limits(result):
        columns["limit [arcsec]"] = [row.limit for row in rows]
        columns["OK"] = [row.kept(measured=measured) for row in rows]
    return of_positions("characteristics", columns).frame()


def _finals(result: AssemblyResult) -> Float[np.ndarray, "3 characteristic"]:
    """Return tilts before rotations before and after adjusting, and what noise leaves or turns miss [arcsec]."""
    measured = result.measured
    if measured is None:
        sweep, noise = result.sweep, 3 * np.sqrt(np.diag(result.gains.errors.noise_covariance))
        finals = 3 * np.concatenate([sweep.tilt, sweep.rotation], axis=1) / ARCSECOND
        alone = np.concatenate(tilt_and_rotation(noise)) / ARCSECOND
        return np.stack([finals[0], finals[at_state_weight(result)], alone])
    before, after = (
        np.concatenate(tilt_and_rotation(each.ravel())) for each in (measured.unadjusted, measured.adjusted)
    )
    # Whichever way a tilt points, it misses no more than its larger axis does.
    missed = 3 * np.concatenate([measured.missed[:, :2].max(axis=1), measured.missed[:, 2]])
    return np.stack([before, after, missed]) / ARCSECOND


def larger(result: AssemblyResult) -> tuple[str, ...]:
    """Return which tilts and rotations adjusting leaves larger, with both values."""
    rows = [row for row in characteristics(result) if row.risen]
    return tuple(f"{row.angle} of {row.part} ({row.before:.2f} → {row.after:.2f}″)" for row in rows)
