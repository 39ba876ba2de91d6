"""Which tolerances of an RV-20E keep what its catalogue promises, and which zones and modification are cheapest.

tolalloc run studies/rv20e_allocation.py --quick

Bearings that give the rigidity of a catalogue (`tolalloc identify --catalogue --reducer rv20e --write FILE`), all
sources of a drawing that can be built, and the limits at which a maker ships: 99.73 % of reducers below 60″ and 1′,
turning without load by at most 8 N·m at the output, none of their teeth tight at tip and root.
"""

import tolalloc as ta

SHIPPED = ta.AtYield(target=0.9973)

study = ta.Study(
    ta.reducer(
        "rv20e",
        stiffness="rv20e_catalogue.stiffness.toml",
        flank_clearance=(1.0, 8.0),
        radial_clearance=(3.0, 30.0),
    ),
    ta.drawing("rv20e_drawing"),
    limits={
        ta.PEAK_TO_PEAK: ta.Limit(upper=60.0, show=SHIPPED),
        ta.LOST_MOTION: ta.Limit(upper=1.0, show=SHIPPED),
        ta.FRICTION_TORQUE: ta.Limit(upper=8.0, show=SHIPPED),
        ta.RADIAL_CLEARANCE: ta.Limit(lower=0.0, show=SHIPPED),
    },
    questions=[ta.Ranking(), ta.Allocation(fixed_first=False, what_if=False)],
    name="rv20e_allocation",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
