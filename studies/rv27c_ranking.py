"""Which tolerance of an RV reducer with centre gear and hollow shaft drives its transmission error.

tolalloc run studies/rv27c_ranking.py --quick

Ratio and rated torque of the preset RV-27C come from a catalogue, from memory; all other numbers of it and of its
drawing are assumed. `tolalloc new mine --family rv-centre-gear` makes a folder for your own; `tolalloc allocate` on
this script finds the cheapest drawing, which takes minutes.
"""

import tolalloc as ta

study = ta.Study(
    ta.reducer("rv27c", flank_clearance=(1.0, 12.0), radial_clearance=(5.0, 30.0)),
    ta.drawing("rv27c_drawing"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=50.0)},
    questions=[ta.Ranking()],
    name="rv27c_ranking",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
