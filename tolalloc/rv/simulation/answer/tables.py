"""Tables of a simulated reducer."""

from __future__ import annotations

import pandas as pd

from tolalloc.rv.simulation.answer.results import SimulationResults
from tolalloc.units import ARCSECOND, DEGREE, RPM


def range_text(least: int, most: int) -> str:
    """Return a range of counts as people write it."""
    return f"{least}" if least == most else f"{least}…{most}"


def steady_row(results: SimulationResults) -> dict[str, object]:
    """Return one line of a table of engines: the steady part in motion."""
    difference = results.difference / ARCSECOND
    return {
        "engine": results.engine,
        "mean transmission error [arcsec]": float(results.transmission_error.mean() / ARCSECOND),
        "peak-to-peak [arcsec]": results.peak_to_peak[0] / ARCSECOND,
        "beside rest, rms [arcsec]": float((difference**2).mean() ** 0.5),
        "beside rest, largest [arcsec]": float(abs(difference).max()),
        **{
            f"pins in contact, disc {disc + 1} [-]": range_text(*counts) for disc, counts in enumerate(results.contacts)
        },
        "largest pin force [N]": results.largest_force[0],
        "output speed [rpm]": results.output_speed / RPM,
        "ratio [-]": results.ratio,
        "power out over power in [%]": 100 * results.output_power / results.input_power,
        "computing time [s]": results.seconds,
    }


def rest_row(results: SimulationResults) -> dict[str, object]:
    """Return the line of the static model in the same table."""
    return {
        "engine": "at rest",
        "mean transmission error [arcsec]": float(results.at_rest.transmission_error.mean() / ARCSECOND),
        "peak-to-peak [arcsec]": results.peak_to_peak[1] / ARCSECOND,
        **{
            f"pins in contact, disc {disc + 1} [-]": range_text(*counts)
            for disc, counts in enumerate(results.contacts_at_rest)
        },
        "largest pin force [N]": results.largest_force[1],
        "computing time [s]": results.at_rest.seconds,
    }


def steady_table(results: SimulationResults) -> pd.DataFrame:
    """Return the steady part in motion and at rest, one quantity per row."""
    moving, resting = steady_row(results), rest_row(results)
    names = [name for name in moving if name != "engine"]
    return pd.DataFrame(
        {
            "quantity": names,
            "in motion": [moving[name] for name in names],
            "at rest": [resting.get(name, "") for name in names],
        }
    )


def series_table(results: SimulationResults) -> pd.DataFrame:
    """Return everything over time, units in the headers."""
    series, contacts = results.series, results.series.pins_in_contact
    return pd.DataFrame(
        {
            "time [s]": series.time,
            "carrier angle [deg]": series.carrier_angle / DEGREE,
            "input speed [rpm]": series.input_speed / RPM,
            "output speed [rpm]": series.output_speed / RPM,
            "output acceleration [rad/s²]": series.output_acceleration,
            "transmission error [arcsec]": series.transmission_error / ARCSECOND,
            **{f"pins in contact, disc {disc + 1} [-]": contacts[:, disc] for disc in range(contacts.shape[1])},
            "input torque [N·m]": series.input_torque,
            "output torque [N·m]": series.output_torque,
        }
    )
