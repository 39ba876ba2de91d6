"""RV-80E eines Büros: deutsche Köpfe, je eine Zeile für sechs Exzenter und sechs Bohrungen, Bolzen 8 h5."""

import tolalloc as ta

study = ta.Study(
    ta.reducer("rv80e", flank_clearance=(1.0, 12.0), radial_clearance=(5.0, 30.0)),
    ta.drawing("toleranzen.csv"),
    limits={ta.RADIAL_CLEARANCE: ta.Limit(lower=3.0), ta.PRELOAD: None},
    neglected=["*"],
    questions=[ta.Ranking(), ta.Allocation(front=False, what_if=False)],
    name="office_rv80e",
)
