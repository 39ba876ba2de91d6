"""Which tolerances of an RV-20E keep its peak-to-peak transmission error below 60″, and what they cost.

tolalloc run studies/rv20e_allocation.py --quick
"""

from tolalloc.cli.main import run_script
from tolalloc.study.definition import Study

study = Study(
    name="rv20e_allocation",
    reducer="rv20e",
    tolerances="rv20e_baseline",
    unit="table4",
    stiffness="rv20e_table6",
    limit_arcsec=60.0,
    yield_target=0.9973,
    flank_clearance_um=(1.0, 5.0),
    radial_clearance_um=(5.0, 20.0),
    seed=1,
)

if __name__ == "__main__":
    run_script()
