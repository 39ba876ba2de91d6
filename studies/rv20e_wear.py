"""Whether an RV-20E keeps its limits at the end of its life, with worn pins and flanks, and what drives them then.

tolalloc run studies/rv20e_wear.py --quick

Lost motion is limited to the 1′ of the catalogue for new parts and to 1.1′ for worn ones. The 1.1′, duty, hours and the
wear coefficient are assumed: the hours may be wrong by a factor of ten until one worn reducer has been measured.
"""

import tolalloc as ta

WORK = ta.LoadCase("work", torque=-100.0, speed=15.0)
WORN = ta.LoadCase("3000 h", hours=3000.0)

study = ta.Study(
    ta.reducer("rv20e", load_cases=(WORK, WORN)),
    ta.drawing("rv20e_drawing"),
    limits={
        ta.at(ta.LOST_MOTION, WORN): ta.Limit(upper=1.1),
        ta.LOST_MOTION: ta.Limit(upper=1.0),
        ta.at(ta.PEAK_TO_PEAK, WORN): ta.Limit(upper=60.0),
    },
    questions=[ta.Ranking()],
    name="rv20e_wear",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
