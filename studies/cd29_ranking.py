"""Which tolerance of a single-stage cycloid drive, as joints of cobots have it, drives its transmission error.

tolalloc run studies/cd29_ranking.py --quick

All dimensions of the preset CD-29 (29:1, eight output pins) and all zones and costs of its drawing are assumed: no
maker prints them. `tolalloc new mine --family single-stage` makes a folder for your own; `tolalloc allocate` on this
script finds the cheapest drawing, which takes minutes.
"""

import tolalloc as ta

study = ta.Study(
    ta.reducer("cd29", flank_clearance=(1.0, 12.0), radial_clearance=(5.0, 30.0)),
    ta.drawing("cd29_drawing"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=80.0)},
    questions=[ta.Ranking()],
    name="cd29_ranking",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
