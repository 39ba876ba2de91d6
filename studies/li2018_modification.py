"""li2018's modification of an RV-40E: closed form, the patent's genetic algorithm, and others, over many seeds.

python studies/li2018_modification.py [--quick] [--out FOLDER]
"""

from __future__ import annotations

import pandas as pd
from published.li2018_closed_form import closed_form
from published.modification_comparison import compared, comparison_document

import tolalloc as ta
from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.modification import ModificationRequest, reference, residual_gap
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reports.document import Document, Section
from tolalloc.running.progress import Progress

RADIAL_CLEARANCE = 15 * MICROMETRE


def ladder() -> pd.DataFrame:
    """Return closed form and reference for several reducers and radial clearances."""
    rows = []
    for name in ("rv20e_liu2020", "rv40e_xi2015", "rv80e"):
        stage = load_reducer(name).cycloid_stage
        for clearance_um in (5.0, 15.0, 30.0):
            exact = closed_form(stage, clearance_um * MICROMETRE)
            found = reference(residual_gap(stage, clearance_um * MICROMETRE, largest=200 * MICROMETRE))
            rows.append(
                {
                    "reducer": name,
                    "radial clearance [µm]": clearance_um,
                    "equidistant amount, closed form [µm]": f"{exact.equidistant / MICROMETRE:.5f}",
                    "shift amount, closed form [µm]": f"{exact.shift / MICROMETRE:.5f}",
                    "reference differs by, relative [-]": float(
                        max(abs(found.amounts / (exact.equidistant, exact.shift) - 1))
                    ),
                }
            )
    return pd.DataFrame(rows)


def build(quick: bool, progress: Progress) -> Document:
    """Return the report."""
    reducer = load_reducer("rv40e_xi2015")
    request = ModificationRequest(method="li2018", radial_clearance=RADIAL_CLEARANCE)
    found = compared(request, reducer, -reducer.load.rated_torque, range(2 if quick else 30), progress)
    progress.begin("closed form")
    section = Section(
        heading="Closed form",
        paragraphs=(
            "Least mean gap with a radial clearance of j or more and no interference is a linear program whose optimum "
            "is Δr_rp = j/(1 − q), Δr_p = j·q/(1 − q), whatever the work interval. The patent's formulas are lost; its "
            "“difference of two curves” taken literally is least without any shift.",
        ),
        tables=(("closed form", ladder()),),
    )
    return comparison_document(found, section)


study = ta.Study(questions=[ta.Calculation(build)], name="li2018_modification")

if __name__ == "__main__":
    ta.run_script()
