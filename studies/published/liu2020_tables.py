"""What liu2020 prints in its Tables 5 to 7, and what it says when it is read with a pencil."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series

BOUNDS = {
    "crank_disc_bearing": (0.8e10, 1.3e10),
    "crank_carrier_bearing": (1.4e10, 1.8e10),
    "carrier_bearing": (7.4e10, 8.0e10),
}
"""Table 5 [N/m]."""

S_BEFORE, S_AFTER = 2.8180, 2.5651
"""Tables 5 and 6 [arcsec]."""

TABLE_6 = np.array(
    [
        (1.1015, 1.7993, 8.0),
        (1.1015, 1.7991, 7.9993),
        (1.1015, 1.7595, 8.0),
        (1.1015, 1.7582, 8.0),
        (1.1015, 1.8, 8.0),
        (1.1015, 1.706, 7.9396),
        (1.1015, 1.8, 8.0),
        (1.1014, 1.7821, 8.0),
        (1.1015, 1.7290, 7.9897),
        (1.1014, 1.7989, 7.9996),
    ]
)
"""K_pd, K_b, K_ca of ten searches with one and the same S [1e10 N/m]."""

TABLE_7 = np.array(
    [
        (100.71, 103.32, 103.05, 10.34),
        (103.57, 106.42, 106.18, 8.42),
        (105.71, 108.62, 108.23, 13.40),
        (109.28, 111.98, 111.76, 8.15),
        (112.14, 114.68, 114.49, 7.48),
        (113.12, 115.81, 115.46, 13.01),
        (118.46, 121.26, 121.03, 8.21),
        (121.36, 124.37, 123.93, 14.62),
        (122.74, 125.68, 125.42, 8.84),
        (125.42, 128.36, 128.14, 7.48),
    ]
)
"""Measured, modelled before and after [arcsec], and what liu2020 calls the gain [%]."""


@dataclass(frozen=True, kw_only=True)
class BiasOnly:
    """Model readings less one constant, against measured ones.

    Parameters
    ----------
    difference
        Model less measured, pair by pair [any].
    """

    difference: Float[np.ndarray, " pair"]

    @property
    def bias(self) -> float:
        """The constant: the mean difference [as difference]."""
        return float(self.difference.mean())

    @property
    def spread(self) -> float:
        """Sample standard deviation of the difference [as difference]."""
        return float(self.difference.std(ddof=1))

    @property
    def rms(self) -> float:
        """Root-mean-square of what the constant leaves [as difference]."""
        return float(self.difference.std())

    @property
    def leave_one_out(self) -> float:
        """Root-mean-square of what the constant of all other pairs leaves of each pair [as difference].

        Notes
        -----
        Leaving one of n pairs out moves the mean by its residual over n − 1, so its own residual grows by n/(n − 1).
        """
        pairs = self.difference.size
        return self.rms * pairs / (pairs - 1)


def improvement(before: Float[np.ndarray, " pair"], after: Float[np.ndarray, " pair"]) -> Float[np.ndarray, " pair"]:
    """Return (before − after)/before of the differences, what liu2020's Table 7 calls its gain [-]."""
    return np.asarray((before - after) / before)


def printed_section() -> Section:
    """Return what Tables 5 to 7 say when they are read with a pencil."""
    measured, before, after, gain = TABLE_7.T
    bias, fitted = BiasOnly(difference=before - measured), BiasOnly(difference=after - measured)
    share = 100 * improvement(before - measured, after - measured)
    table = pd.DataFrame(
        {
            "unit": np.arange(1, 11),
            "measured [arcsec]": measured,
            "model less measured, before [arcsec]": before - measured,
            "after [arcsec]": after - measured,
            "before less the constant [arcsec]": bias.difference - bias.bias,
            "gain, recomputed [%]": share,
            "gain, printed [%]": gain,
        }
    )
    at_bound = (TABLE_6[:, 1:] >= np.array([1.8, 8.0]) - 5e-5).sum(axis=0)
    return Section(
        heading="What liu2020 prints",
        paragraphs=(
            f"Table 7: the model is above the measurement by {bias.bias:.2f} ± {bias.spread:.2f}″ before and "
            f"{fitted.bias:.2f} ± {fitted.spread:.2f}″ after identification, in all ten units. The gain of "
            f"{gain.mean():.3f} % is the mean of (before − after)/before ({share.mean():.3f} % recomputed), that is "
            f"{bias.bias - fitted.bias:.2f}″ of about {measured.mean():.0f}″.",
            f"One constant taken off the model before identification leaves {bias.rms:.2f}″ rms, and "
            f"{bias.leave_one_out:.2f}″ when each unit is left out of its own constant; identification leaves "
            f"{np.sqrt((fitted.difference**2).mean()):.2f}″. A constant explains the printed residual better than any "
            "stiffness: look for a bias of the bench or of the errors' measurement first.",
            f"Table 6: ten searches end at the same S of {S_AFTER:.4f}″ ({S_BEFORE:.4f}″ before) while K_b runs from "
            f"{TABLE_6[:, 1].min():.3f} to {TABLE_6[:, 1].max():.3f} and K_ca from {TABLE_6[:, 2].min():.2f} to "
            f"{TABLE_6[:, 2].max():.2f} ·1e10 N/m, {at_bound[0]} and {at_bound[1]} of ten on the upper bound: S does "
            "not know them. The 50 measured units are not printed, so their S cannot be computed again.",
        ),
        figures=(_pairs_figure(measured, before, after, bias.bias),),
        tables=(("Table 7", table), ("Table 6", pd.DataFrame(TABLE_6, columns=["K_pd", "K_b", "K_ca [1e10 N/m]"]))),
    )


def _pairs_figure(measured: np.ndarray, before: np.ndarray, after: np.ndarray, bias: float) -> Figure:
    """Draw model less measured of the ten printed units."""
    rows = (("before", before), ("after identification", after), (f"before, less {bias:.2f}″", before - bias))
    return Figure(
        name="table_7",
        title="The ten printed units: identification takes off a tenth of what a constant takes off",
        x_label="measured peak-to-peak [arcsec]",
        y_label="model less measured [arcsec]",
        series=tuple(
            Series(label=label, kind="points", x=list(measured), y=list(values - measured)) for label, values in rows
        ),
        horizontal=((0.0, ""),),
    )
