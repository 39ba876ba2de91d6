"""The tables of a study, as frames with a unit in every header."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.allocation.verification import VerifiedDesign
from tolalloc.capability.indices import Limits, quantile_interval
from tolalloc.capability.indices import capability as sample_capability
from tolalloc.drawing.sources import Source
from tolalloc.drawing.tolerance_table import with_zones
from tolalloc.report.results import StudyResults
from tolalloc.rv.cycloid.assessment import Assessment
from tolalloc.sensitivity.driver_tables import sobol_table
from tolalloc.units import ARCMINUTE, MEGAPASCAL, MICROMETRE


def ranking(results: StudyResults) -> pd.DataFrame:
    """Return the sources, largest total Sobol index first, with intervals and the hand estimate beside them.

    A source that stands on no drawing, or a block of correlated ones, has no zone and no hand estimate.
    """
    frame, names = sobol_table(results.sobol), [source.name for source in results.space.errors.active]
    for header, values in {
        "zone [µm]": results.space.errors.zones / MICROMETRE,
        "Sens of the quantile [arcsec/µm]": results.allocation.baseline.by_zone * MICROMETRE,
        "alone at its limit [arcsec]": results.classical.alone,
    }.items():
        frame[header] = frame["source"].map(dict(zip(names, values, strict=True)))
    return frame


def allocated_sources(results: StudyResults) -> tuple[Source, ...]:
    """Return all sources of the tolerance table at the chosen zones."""
    errors = results.space.errors
    chosen = results.space.zones(results.allocation.chosen.design)
    zones = dict(zip((source.name for source in errors.active), chosen, strict=True))
    return with_zones(errors.sources, [zones.get(source.name, source.zone) for source in errors.sources])


def before_after(results: StudyResults) -> pd.DataFrame:
    """Return the drawing table: zone and cost of every source before and after, and the two modification amounts."""
    space, chosen = results.space, results.allocation.chosen
    after = {source.name: source for source in allocated_sources(results)}
    index = {name: at for at, name in enumerate(results.sobol.sources)}
    share = results.sobol.total / results.sobol.total.sum() * 100
    active = {source.name: at for at, source in enumerate(space.errors.active)}
    rows = []
    for source in space.errors.sources:
        new = after[source.name]
        rows.append(
            {
                "source": source.name,
                "part": source.part,
                "callout": source.feature.value,
                "group": source.group,
                "zone before [µm]": source.zone / MICROMETRE,
                "zone after [µm]": new.zone / MICROMETRE,
                "change [%]": (new.zone / source.zone - 1) * 100 if source.zone else 0.0,
                "contribution before [%]": _contribution(results, share, index, source),
                "cost before [cost units]": source.cost,
                "cost after [cost units]": new.cost,
                "Sens after [arcsec/µm]": (
                    chosen.by_zone[active[source.name]] * MICROMETRE if source.name in active else 0.0
                ),
                "locked": "yes" if source.locked else "no",
            }
        )
    return pd.DataFrame(rows)


def _contribution(
    results: StudyResults, share: Float[np.ndarray, " source"], index: dict[str, int], source: Source
) -> float:
    """Return the contribution of a source [%], not a number for one that shares a block with correlated others."""
    if source.name in index:
        return float(share[index[source.name]])
    return np.nan if source in results.space.errors.active else 0.0


def modification(results: StudyResults) -> pd.DataFrame:
    """Return the modification amounts, the clearances they leave and how exact teeth then carry, before and after."""
    stage = results.reducer.cycloid_stage
    pairs = (results.reducer.modification, results.space.modification(results.allocation.chosen.design))
    rows: dict[str, list[float]] = {
        "equidistant Δr_rp [µm]": [amounts.equidistant / MICROMETRE for amounts in pairs],
        "shift Δr_p [µm]": [amounts.shift / MICROMETRE for amounts in pairs],
        "flank clearance, smallest nominal gap [µm]": [
            amounts.flank_clearance(stage) / MICROMETRE for amounts in pairs
        ],
        "radial clearance at tip and root [µm]": [amounts.radial_clearance / MICROMETRE for amounts in pairs],
    }
    for name, value in _CONTACT.items():
        rows[name] = [float("nan") if found is None else value(found) for found in results.contacts]
    return pd.DataFrame([{"amount": name, "before": old, "after": new} for name, (old, new) in rows.items()])


_CONTACT: dict[str, Callable[[Assessment], float]] = {
    "backlash of teeth and pins [arcmin]": lambda found: found.clearance.backlash / ARCMINUTE,
    "fewest pins in contact at rated torque [-]": lambda found: float(found.single.pins_in_contact.min()),
    "largest pin force at rated torque [N]": lambda found: float(found.single.force.max()),
    "peak pressure at rated torque [MPa]": lambda found: float(found.single.pressure.max()) / MEGAPASCAL,
}
"""What the more loaded disc does, exact parts and Hertzian line contact at every pin."""


def _statistics(label: str, design: VerifiedDesign, limit: float, target: float) -> dict[str, object]:
    """Return what a capability sheet says of one design."""
    values, achieved = design.sample.values, design.achieved
    found, kept = sample_capability(values, Limits(upper=limit)), quantile_interval(values, target)
    return {
        "design": label,
        "Cost [cost units]": design.cost,
        "Mean [arcsec]": found.mean,
        "Sigma [arcsec]": found.deviation_overall,
        "Min [arcsec]": float(values.min()),
        "Max [arcsec]": float(values.max()),
        "USL [arcsec]": limit,
        "Cpk [-]": found.cpk,
        "Ppk [-]": found.ppk,
        "Yield [%]": achieved.estimate * 100,
        "Yield low 95 % [%]": achieved.low * 100,
        "Yield high 95 % [%]": achieved.high * 100,
        "% out [%]": (1 - achieved.estimate) * 100,
        "PPM [1e-6]": (1 - achieved.estimate) * 1e6,
        "PPM if normal [1e-6]": found.normal_ppm,
        f"{target:.2%} quantile, low 95 % [arcsec]": kept.low,
        f"{target:.2%} quantile, high 95 % [arcsec]": kept.high if np.isfinite(kept.high) else "sample too small",
        "kept at the target yield [arcsec]": design.quantile_bound,
        "Units [-]": achieved.units,
        "OK": "yes" if design.met else "no",
    }


def capability(results: StudyResults) -> pd.DataFrame:
    """Return baseline, scaling by hand and chosen design side by side, each on its own fresh units."""
    allocation = results.allocation
    designs = {
        "tolerance table as it is": allocation.baseline,
        "all zones scaled alike": allocation.by_hand,
        "allocated": allocation.chosen,
    }
    return pd.DataFrame(
        [_statistics(label, design, results.limit, results.target) for label, design in designs.items()]
    )


def stack_up(results: StudyResults) -> pd.DataFrame:
    """Return worst case, root-sum-square and Monte Carlo at the zones of the tolerance table."""
    baseline = results.allocation.baseline.sample
    target = results.target
    rows = [
        ("worst case", results.classical.worst_case, "single errors at their limits, worst phase, summed"),
        ("root-sum-square", results.classical.root_sum_square, "the same, squared, summed, rooted, as if independent"),
        ("Monte Carlo mean", float(baseline.values.mean()), "real model, all errors together"),
        (f"Monte Carlo {target:.2%} quantile", baseline.quantile(target), "real model, all errors together"),
    ]
    return pd.DataFrame(rows, columns=["estimate", "peak-to-peak [arcsec]", "assumes"])


def verified(results: StudyResults) -> pd.DataFrame:
    """Return every design that the search verified, in order."""
    allocation = results.allocation
    rows = []
    for design in (allocation.baseline, allocation.by_hand, *allocation.tried):
        row: dict[str, object] = {
            "design": design.name,
            "cost [cost units]": design.cost,
            "yield [%]": design.achieved.estimate * 100,
            "kept at the target yield [arcsec]": design.quantile_bound,
            "met": "yes" if design.met else "no",
        }
        rows.append(row | dict(zip(results.space.columns, design.design, strict=True)))
    return pd.DataFrame(rows).drop_duplicates("design")


def pareto(results: StudyResults) -> pd.DataFrame:
    """Return the Pareto front: cost, quantile told and checked, and the design."""
    front = results.front
    frame = pd.DataFrame(front.designs, columns=list(results.space.columns))
    frame.insert(0, "quantile on the kernel [arcsec]", front.on_kernel)
    frame.insert(0, "quantile on the surrogate [arcsec]", front.quantile)
    frame.insert(0, "cost [cost units]", front.cost)
    return frame


def mappings(results: StudyResults) -> pd.DataFrame:
    """Return how every zone became a distribution, and where the zone comes from."""
    rows = [(source.name, source.mapping, source.note) for source in results.space.errors.active]
    if results.stiffness and results.identified:
        source = results.stiffness.source
        rows.append((source.name, f"ln K/K0: {source.mapping}", results.identified.source))
    return pd.DataFrame(rows, columns=["source", "zone → distribution", "note of the table"])


def orders(results: StudyResults, largest: int = 130) -> pd.DataFrame:
    """Return the amplitude of every order of the shown units."""
    spectra = [example.orders for example in results.examples]
    frame = pd.DataFrame({"order of the output turn [-]": spectra[0].order[:largest]})
    for example, spectrum in zip(results.examples, spectra, strict=True):
        frame[f"{example.label} [arcsec]"] = spectrum.amplitude[0, :largest] * (180 * 3600 / np.pi)
    return frame
