"""The tables of an assembly: what is turned at every step, what that leaves, and what precision buys."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.assembly.answer.answer import AssemblyAnswer
from tolalloc.assembly.steps import adjustable
from tolalloc.units import ARCSECOND

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
    """Return √(x² + y²) and z of every part; of standard deviations likewise.

    Parameters
    ----------
    angles
        About x, y and z, part by part [rad].
    """
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
