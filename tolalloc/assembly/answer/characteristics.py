"""Tilt and rotation of every characteristic before and after adjusting, and whether its limits are kept."""

from __future__ import annotations

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.assembly.answer.answer import AdjustedParts, AssemblyAnswer
from tolalloc.assembly.answer.tables import READ, at_precision, rounded, tilt_and_rotation
from tolalloc.units import ARCSECOND

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
