"""Which tolerances of an RV-20E keep its peak-to-peak transmission error below 60″, and what they cost.

tolalloc run studies/rv20e_allocation.py --quick
"""

import tolalloc as ta

study = ta.Study(
    ta.reducer(
        "rv20e_liu2020",
        stiffness="rv20e_table6",
        flank_clearance=(1.0, 5.0),
        radial_clearance=(5.0, 20.0),
        unit="table4",
    ),
    ta.drawing("rv20e_table4"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0, show=ta.AtYield(target=0.9973))},
    questions=[ta.Ranking(), ta.Allocation(fixed_first=False, what_if=False)],
    name="rv20e_allocation",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
