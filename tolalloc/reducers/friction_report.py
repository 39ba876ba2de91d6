"""What a report says of friction: torque by kind of contact, efficiency, and the loop with both its branches."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tolalloc.reading.units import ARCMINUTE
from tolalloc.reducers.equivalent.friction_loop import FrictionLoop
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.friction import CONTACTS
from tolalloc.reports.document import Section

if TYPE_CHECKING:
    import pandas as pd

    from tolalloc.reports.figure import Figure

_UNIT = 0
"""Sample of a loop that is the unit [-]."""


def friction_summary(loop: FrictionLoop) -> dict[str, Any]:
    """Return efficiency, loop and friction by contact of the unit, for a program."""
    return {
        "efficiency_at_rated_torque_percent": 100.0 * float(loop.rated.efficiency[_UNIT]),
        "no_load_torque_nm": float(loop.no_load.friction_torque[_UNIT]),
        "lost_motion_arcmin": float(loop.lost_motion[_UNIT] / ARCMINUTE),
        "hysteresis_loss_arcmin": float(loop.hysteresis_loss[_UNIT] / ARCMINUTE),
        "by_contact": [
            {
                "contact": CONTACTS[name],
                "rated_nm": float(torque[_UNIT]),
                "no_load_nm": float(loop.no_load.by_contact[name][_UNIT]),
            }
            for name, torque in loop.rated.by_contact.items()
        ],
    }


def friction_sentence(loop: FrictionLoop) -> str:
    """Return efficiency, torque without load and what friction makes of the loop, in one sentence."""
    found = friction_summary(loop)
    return (
        f"Friction leaves an efficiency of {found['efficiency_at_rated_torque_percent']:.1f} % at rated torque, seals "
        f"and churning not counted, and takes {found['no_load_torque_nm']:.2g} N·m at the output without load, mean "
        f"over a turn of all contacts; with it the lost motion is {found['lost_motion_arcmin']:.2f}′, the hysteresis "
        f"loss {found['hysteresis_loss_arcmin']:.2g}′."
    )


def friction_section(reducer: Reducer, loop: FrictionLoop) -> Section:
    """Return the section on friction."""
    words = (
        "Torque that friction takes at the output, mean over a turn, and the twist of the carrier from minus to plus "
        "the rated torque and back, the sun held."
    )
    return Section(
        heading="Friction",
        paragraphs=(words,),
        figures=(loop_figure(loop),),
        tables=(("friction", friction_table(reducer, loop)),),
    )


def friction_table(reducer: Reducer, loop: FrictionLoop) -> pd.DataFrame:
    """Return the friction torque of every kind of contact, at rated torque and without torque."""
    import pandas as pd

    found, rated = friction_summary(loop)["by_contact"], abs(loop.rated.torque)
    coefficients = {CONTACTS[name]: value for name, value in vars(reducer.friction).items()}
    rows = [(own["contact"], f"{coefficients[own['contact']]:g}", own["rated_nm"], own["no_load_nm"]) for own in found]
    rows.append(("together", "", sum(row[2] for row in rows), sum(row[3] for row in rows)))
    return pd.DataFrame(
        [(name, value, f"{at:.3g}", f"{100 * at / rated:.2f}", f"{idle:.2g}") for name, value, at, idle in rows],
        columns=[
            "contact",
            "coefficient [-]",
            "rated torque [N·m]",
            "of the rated torque [%]",
            "without torque [N·m]",
        ],
    )


def loop_figure(loop: FrictionLoop) -> Figure:
    """Return twist over torque with both branches."""
    from tolalloc.reports.figure import Figure, Series

    torque = list(loop.torque)
    branches = (("torque rising", loop.rising), ("torque falling", loop.falling))
    return Figure(
        name="hysteresis",
        title=(
            f"Hysteresis: {loop.lost_motion[_UNIT] / ARCMINUTE:.2f}′ lost motion, "
            f"{loop.hysteresis_loss[_UNIT] / ARCMINUTE:.2g}′ hysteresis loss"
        ),
        x_label="torque on the carrier [N·m]",
        y_label="twist [arcmin]",
        series=tuple(
            Series(label=label, kind="line", x=torque, y=list(branch[_UNIT] / ARCMINUTE)) for label, branch in branches
        ),
    )
