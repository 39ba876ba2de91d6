"""Which process steps an RV-20E needs, where a step holds a smallest zone and its price does not fall with the zone.

tolalloc run studies/rv20e_processes.py --quick

Every step, price and smallest zone is assumed: put your own into a table like `rv20e_drawing.process_costs.csv`. No
zone is asked for that no process holds.
"""

import tolalloc as ta

study = ta.Study(
    ta.reducer(
        "rv20e", stiffness="rv20e_catalogue.stiffness.toml", flank_clearance=(1.0, 8.0), radial_clearance=(3.0, 30.0)
    ),
    ta.drawing("rv20e_drawing", costs="rv20e_drawing", gauge_ratio=10),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0), ta.LOST_MOTION: ta.Limit(upper=1.0)},
    questions=[ta.Allocation(fixed_first=False, what_if=False, front=False)],
    name="rv20e_processes",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
