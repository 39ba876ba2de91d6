"""Which error drives which requirement, which order and the rejects, all 48 sources varying.

tolalloc rank studies/rv20e_sensitivity.py --quick

On liu2020's printed stiffness and its unit's magnitudes, to hold beside published orders: with the zones of a drawing
and the stiffness of a catalogue, `rv20e_allocation.py` ranks.
"""

import tolalloc as ta

study = ta.Study(
    ta.reducer("rv20e_liu2020", neglected=("disc*.tilt",)),
    ta.drawing("rv20e_all_sources"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0), ta.LOST_MOTION: ta.Limit(upper=1.0)},
    questions=[ta.Ranking()],
    name="rv20e_sensitivity",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
