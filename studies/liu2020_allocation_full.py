"""The replica `liu2020_allocation.py` in depth: processes, grades, several requirements, modification, certificate.

tolalloc allocate studies/liu2020_allocation_full.py --quick

Its loads are as little believable as those of `liu2020_allocation.py`.
"""

import tolalloc as ta

study = ta.Study(
    ta.reducer("rv20e_liu2020", stiffness="rv20e_table6", flank_clearance=(1.0, 5.0), radial_clearance=(5.0, 20.0)),
    ta.drawing("rv20e_table4", costs="rv20e"),
    limits={
        ta.PEAK_TO_PEAK: ta.Limit(upper=60.0, show=ta.AtYield(target=0.9973)),
        ta.LOST_MOTION: ta.Limit(upper=0.5, show=ta.AtCpk(target=1.33)),
        ta.RADIAL_CLEARANCE: ta.Limit(lower=-5.0, show=ta.AtYield(target=0.9973)),
    },
    questions=[
        ta.Allocation(grades=True, unit_price=ta.UnitPrice(inspection=1.0, rework_share=0.3, rework=15.0, scrap=5.0))
    ],
    name="liu2020_allocation_full",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
