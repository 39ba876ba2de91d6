"""Four like spacers in one row of the table, uniform as they come from the saw."""

import tolalloc as ta


def length(plate, spacer1, spacer2, spacer3, spacer4):
    return plate + spacer1 + spacer2 + spacer3 + spacer4


study = ta.Study(
    ta.model(length, inputs=("plate", "spacer1", "spacer2", "spacer3", "spacer4"), outputs=("length [mm]",)),
    ta.drawing("parts.csv"),
    limits={"length [mm]": ta.Limit(lower=51.75, upper=52.25)},
    name="spacers_4x",
)
