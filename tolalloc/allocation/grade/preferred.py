"""Preferred zones for callouts without a nominal size: position, pitch, run-out, and radii.

Notes
-----
The values are the rounded ones of ISO 3, R′10, which a drawing can carry: 3.2 where R10 itself has 3.15. One step is
26 %, about what a shop's cost tells apart; with the customary 1–2–5 a step is 100 % or 150 %, and rounding a zone down
to it gives away up to 60 % of that zone; with R′20 a step is 12 %, and ladders double their length for savings below
the uncertainty of any cost.

References
----------
ISO 3, Preferred numbers: Series of preferred numbers; ISO 497, more rounded values.
"""

from __future__ import annotations

import numpy as np

from tolalloc.units import MICROMETRE

SERIES = "R′10"
"""Name of the series."""

_DECADE = (1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.3, 8.0)
"""Its values within one decade [-]."""

ZONES = np.array([*(float(f"{value}e{power}") for power in range(-1, 3) for value in _DECADE), 1000.0]) * MICROMETRE
"""All zones from 0.1 µm to 1 mm [m]."""
