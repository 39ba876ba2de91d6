"""The tables of an assembly: what is turned at every step, what that leaves of limits, and what precision buys."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.assembly.steps import adjustable
from tolalloc.reading.units import ARCSECOND

if TYPE_CHECKING:
    from tolalloc.assembly.answer.answer import AdjustedParts, AssemblyAnswer

READ = 2
"""Digits behind the point of an arcsecond that a bench can turn or read [-]."""
_KEPT = 6
"""Digits behind the point of a number in a report, whatever its unit; the others are rounding errors [-]."""


def rounded(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a table without digits that mean nothing, and without −0."""
    found = frame.round(_KEPT)
    numbers = found.select_dtypes("float").columns
    found[numbers] = found[numbers] + 0.0
    return found


def at_precision(answer: AssemblyAnswer) -> int:
    """Return where the plan's precision stands in the sweep; 0, nothing turned, stands first."""
    return int(np.flatnonzero(answer.sweep.precisions == answer.plan.precision)[0])


def tilt_and_rotation(
    angles: Float[np.ndarray, "*steps state"],
) -> tuple[Float[np.ndarray, "*steps part"], Float[np.ndarray, "*steps part"]]:
    """Return √(x² + y²) and z of every part from x, y and z part by part [rad]; of standard deviations likewise."""
    of_parts = angles.reshape(*angles.shape[:-1], -1, 3)
    return np.hypot(of_parts[..., 0], of_parts[..., 1]), of_parts[..., 2]


def states(answer: AssemblyAnswer) -> Float[np.ndarray, "step 2 state"]:
    """Return the angles after each step, as mounted and as adjusted: measured, or three standard deviations [rad]."""
    if answer.measured is None:
        return 3 * answer.expected
    sequence = answer.measured.sequence
    return np.stack([sequence.mounted, sequence.adjusted], axis=1)


def turns(answer: AssemblyAnswer) -> Float[np.ndarray, "step part 3"]:
    """Return what is turned at every step: for measured parts, or three standard deviations [rad]."""
    if answer.measured is not None:
        return answer.measured.sequence.adjustments.reshape(len(answer.plan.steps), -1, 3)
    plan = answer.plan
    maps = answer.gains.errors
    variances = maps.adjustments_by_part**2 @ plan.variances + (maps.adjustments_by_noise**2).sum(axis=-1)
    return np.asarray(3 * np.sqrt(variances).reshape(len(plan.steps), -1, 3))


def step_table(answer: AssemblyAnswer) -> pd.DataFrame:
    """Return one row per step and turned part; a part that is turned by less than can be read has none."""
    chain, kind = answer.plan.chain, "" if answer.measured else ", 3σ"
    rows = []
    turned = np.round(turns(answer) / ARCSECOND, READ) + 0.0  # no −0
    tilt, rotation = (np.round(each[:, 1] / ARCSECOND, READ) + 0.0 for each in tilt_and_rotation(states(answer)))
    for number, step in enumerate(answer.plan.steps):
        moved = np.flatnonzero(adjustable(chain, step) & turned[number].any(axis=1))
        for at in moved if moved.size else [None]:
            left = chain.names.index(step.mount) if at is None else at
            x, y, z = (0.0, 0.0, 0.0) if at is None else turned[number, at]
            rows.append(
                {
                    "step [-]": number + 1,
                    "mount": step.mount,
                    # Turns of measured parts follow from the file; what is measured meanwhile changes nothing.
                    **({} if answer.measured else {"measure": ", ".join(step.measure) or "nothing"}),
                    "turn": "nothing" if at is None else chain.names[at],
                    f"x{kind} [arcsec]": float(x),
                    f"y{kind} [arcsec]": float(y),
                    f"z{kind} [arcsec]": float(z),
                    f"tilt left{kind} [arcsec]": float(tilt[number, left]),
                    f"rotation left{kind} [arcsec]": float(rotation[number, left]),
                }
            )
    return pd.DataFrame(rows)


def angle_table(answer: AssemblyAnswer) -> pd.DataFrame:
    """Return every angle of measured parts: the part's error, its tolerance, and the final state."""
    measured = answer.measured
    if measured is None:
        return pd.DataFrame()
    columns = {
        "error of the part [arcsec]": measured.errors,
        "tolerance, ± [arcsec]": answer.plan.tolerances,
        "unadjusted [arcsec]": measured.unadjusted,
        "unadjusted, finite rotations [arcsec]": measured.exact,
        "adjusted [arcsec]": measured.adjusted,
        "turns miss, 3σ [arcsec]": 3 * measured.missed,
    }
    part, axis = zip(*product(answer.plan.chain.names, "xyz"), strict=True)
    values = {name: each.ravel() / ARCSECOND for name, each in columns.items()}
    return rounded(pd.DataFrame({"part": part, "axis": axis, **values}))


def gain_table(answer: AssemblyAnswer) -> pd.DataFrame:
    """Return K of every step, one row per angle that may be turned."""
    plan = answer.plan
    angles = [f"{part}.{axis}" for part, axis in product(plan.chain.names, "xyz")]
    rows = [
        {"step [-]": number, "turned": angles[row]}
        | {f"{name} [-]": float(gain) for name, gain in zip(angles, gains[row], strict=True)}
        for number, (step, gains) in enumerate(zip(plan.steps, answer.gains.regulator.gains, strict=True), start=1)
        for row in np.flatnonzero(np.repeat(adjustable(plan.chain, step), 3))
    ]
    return rounded(pd.DataFrame(rows))


def sweep_table(answer: AssemblyAnswer) -> pd.DataFrame:
    """Return what is to be expected over the precision."""
    sweep, names = answer.sweep, answer.plan.chain.names
    columns: dict[str, Any] = {
        "precision Q [-]": sweep.precisions,
        "all angles, rms [arcsec]": sweep.total / ARCSECOND,
        "another unit of Q takes off [%]": sweep.next_unit * 100,
        "effort [arcsec²]": sweep.effort / ARCSECOND**2,
    }
    if answer.measured:
        columns[f"{norm_of(answer)} of {answer.measured.name} [arcsec]"] = answer.measured.norms / ARCSECOND
    for kind, values in (("tilt", sweep.tilt), ("rotation", sweep.rotation)):
        columns |= {f"{kind} of {name}, 3σ [arcsec]": 3 * values[:, at] / ARCSECOND for at, name in enumerate(names)}
    return rounded(pd.DataFrame(columns))


def norm_of(answer: AssemblyAnswer) -> str:
    """Return what the norm of measured parts is called."""
    return "norm" if (answer.plan.weights == 1).all() else "weighted norm"


MISSED = "turns miss, 3σ [arcsec]"


def has_limits(answer: AssemblyAnswer) -> bool:
    """Return whether any angle is limited; costs may be stated without."""
    required = answer.plan.requirements
    return required is not None and bool(np.isfinite([required.tilt_limit, required.rotation_limit]).any())


def characteristic_table(answer: AssemblyAnswer) -> pd.DataFrame:
    """Return tilt and rotation of every characteristic before and after adjusting, and its limits if any are stated."""
    if answer.measured:
        columns = _measured_finals(answer.measured)
    else:
        sweep, at = answer.sweep, at_precision(answer)
        finals = 3 * np.concatenate([sweep.tilt, sweep.rotation], axis=1) / ARCSECOND
        columns = {
            "before, 3σ [arcsec]": finals[0],
            "after, 3σ [arcsec]": finals[at],
            "noise, 3σ [arcsec]": _noise_alone(answer),
        }
    names = answer.plan.chain.names
    frame = rounded(
        pd.DataFrame(
            {"characteristic": names * 2, "angle": ["tilt"] * len(names) + ["rotation"] * len(names)} | columns
        )
    )
    required = answer.plan.requirements
    if required is None or not has_limits(answer):
        return frame
    limits = np.concatenate([required.tilt_limit, required.rotation_limit]) / ARCSECOND
    limited = rounded(frame.assign(**{"limit [arcsec]": np.where(np.isfinite(limits), limits, np.nan)}))
    return limited.assign(OK=[_kept(row) for _, row in limited.iterrows()])


def _kept(row: pd.Series) -> str:
    """Return whether a limit is kept; in doubt where what the turns miss may lead beyond it."""
    limit = row["limit [arcsec]"]
    if np.isnan(limit):
        return ""
    after = abs(row.iloc[3])
    if after > limit:
        return "no"
    return "in doubt" if after + row.get(MISSED, 0.0) > limit else "yes"


def _noise_alone(answer: AssemblyAnswer) -> Float[np.ndarray, " characteristic"]:
    """Return three standard deviations of tilts, then of rotations, that perfect parts would be left with [arcsec]."""
    errors = answer.gains.errors
    return np.concatenate(tilt_and_rotation(3 * np.sqrt(np.diag(errors.noise_covariance)))) / ARCSECOND


def _measured_finals(measured: AdjustedParts) -> dict[str, Float[np.ndarray, " characteristic"]]:
    """Return tilts before rotations, unadjusted, adjusted and what the turns miss [arcsec]."""
    before, after = (
        np.concatenate(tilt_and_rotation(each.ravel())) for each in (measured.unadjusted, measured.adjusted)
    )
    # Whichever way a tilt points, it misses no more than its larger axis does.
    missed = 3 * np.concatenate([measured.missed[:, :2].max(axis=1), measured.missed[:, 2]])
    columns = {"before [arcsec]": before, "after [arcsec]": after, MISSED: missed}
    return {name: values / ARCSECOND for name, values in columns.items()}


def larger(answer: AssemblyAnswer) -> tuple[str, ...]:
    """Return which tilts and rotations adjusting leaves larger, with both values."""
    frame = answer.characteristics
    rose = frame.iloc[:, 3].abs().round(READ) > frame.iloc[:, 2].abs().round(READ)
    return tuple(f"{row[1]} of {row[0]} ({row[2]:.2f} → {row[3]:.2f}″)" for row in frame[rose].itertuples(index=False))
