"""The drawing of `rv20e_allocation.py` on the believable RV-20E: bearings that give the rigidity of a catalogue.

tolalloc identify --catalogue --reducer rv20e --write rv20e_catalogue.stiffness.toml
tolalloc run studies/rv20e_believable.py --quick
"""

import tolalloc as ta

study = ta.Study(
    ta.reducer(
        "rv20e",
        stiffness="rv20e_catalogue.stiffness.toml",
        flank_clearance=(1.0, 8.0),
        radial_clearance=(5.0, 40.0),
    ),
    ta.drawing("rv20e_table4"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0, show=ta.AtYield(target=0.9973))},
    questions=[ta.Allocation(fixed_first=False, what_if=False, front=False)],
    name="rv20e_believable",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
