"""The largest force of every kind over one turn of a unit."""

from __future__ import annotations

from tolalloc.reading.units import DEGREE
from tolalloc.reducers.equivalent.answers import Equilibria
from tolalloc.reducers.equivalent.outputs import forces
from tolalloc.reports.figure import Figure, Series

_INTERFACES = {
    "crank–disc bearing": "crank_disc_bearing",
    "crank–carrier bearing": "crank_carrier_bearing",
    "carrier bearing": "carrier_bearing",
}
"""What a line is called → the interface as in `Stiffness`."""


def force_figure(equilibria: Equilibria) -> Figure:
    """Draw the force of the most loaded pin and of the most loaded bearing of every kind over the turn [N]."""
    found = forces(equilibria)
    lines = {"pin": found.pins[0].max(axis=(1, 2))}
    lines |= {name: found.of(interface)[0].max(axis=1) for name, interface in _INTERFACES.items()}
    return Figure(
        name="forces",
        title="Force of the most loaded pin and bearings over one output turn",
        x_label="carrier angle [°]",
        y_label="force [N]",
        series=tuple(
            Series(label=name, kind="line", x=list(equilibria.carrier_angle / DEGREE), y=list(values))
            for name, values in lines.items()
        ),
    )
