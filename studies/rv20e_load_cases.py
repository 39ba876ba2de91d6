"""Which error drives an RV-20E's limits, each in its own load case: cold, warm, or at rated torque.

tolalloc run studies/rv20e_load_cases.py --quick

The 2 K between discs and ring and the limits are assumed; `rv20e_allocation.py` finds the cheapest drawing with such
load cases.
"""

import tolalloc as ta

COLD, WARM = ta.LoadCase("cold", disc_temperature=-2.0), ta.LoadCase("warm", disc_temperature=2.0)
RATED = ta.LoadCase("rated", torque=-167.0)

study = ta.Study(
    ta.reducer("rv20e", load_cases=(COLD, WARM, RATED)),
    ta.drawing("rv20e_drawing"),
    limits={
        ta.at(ta.LOST_MOTION, COLD): ta.Limit(upper=1.2),
        ta.at(ta.FRICTION_TORQUE, WARM): ta.Limit(upper=10.0),
        ta.at(ta.PEAK_TO_PEAK, RATED): ta.Limit(upper=60.0),
    },
    questions=[ta.Ranking()],
    name="rv20e_load_cases",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
