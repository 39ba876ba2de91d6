"""The cheapest drawing of an RV-20E in depth: processes, grades, several requirements, modification, certificate.

tolalloc allocate studies/rv20e_allocation_full.py --quick
"""

from tolalloc.allocation.cost.unit_price import UnitPrice
from tolalloc.allocation.guarantee import AtCpk
from tolalloc.capability.indices import Limits
from tolalloc.cli.main import run_script
from tolalloc.study.definition import Study

LOST_MOTION = "lost motion [arcmin]"
RADIAL = "radial clearance at tip and root [µm]"

study = Study(
    name="rv20e_allocation_full",
    reducer="rv20e",
    tolerances="rv20e_baseline",
    process_costs="rv20e",
    stiffness="rv20e_table6",
    limit_arcsec=60.0,
    yield_target=0.9973,
    other_limits={LOST_MOTION: Limits(upper=0.5), RADIAL: Limits(lower=-5.0)},
    guarantees={LOST_MOTION: AtCpk(target=1.33)},
    grades=True,
    unit_price=UnitPrice(inspection=1.0, rework_share=0.3, rework=15.0, scrap=5.0),
    flank_clearance_um=(1.0, 5.0),
    radial_clearance_um=(5.0, 20.0),
    seed=1,
)

if __name__ == "__main__":
    run_script()
