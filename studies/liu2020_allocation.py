"""The allocation on liu2020's reducer: printed stiffnesses, and the magnitudes of its one measured unit as zones.

tolalloc run studies/liu2020_allocation.py --quick

A replica to hold beside the paper, no drawing to follow: with the printed stiffnesses the reducer is about 30 times
stiffer than those of catalogues, so forces, loads and preload are not believable; `rv20e_allocation.py` is.
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
    name="liu2020_allocation",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
