"""
What the limit costs
====================

The cheapest drawing for each value of a limit: the trade-off front. The model is a lever whose stroke must not become
too long, a plain function of two sizes.

**Read off it:** how much a tighter limit costs, and from where on it costs much.
"""

import tolalloc as ta


def stroke(lever, slide):
    return 1000 * (lever * slide / 30 - 30.1)  # µm above the nominal stroke


zone = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1}
drawing = ta.Drawing.of_rows(
    [{"id": "lever", "nominal": 30.1, "cost": 1, **zone}, {"id": "slide", "nominal": 30.0, "cost": 3, **zone}]
)
study = ta.Study(
    ta.model(stroke, inputs=("lever", "slide"), outputs=("stroke error [µm]",)),
    drawing,
    limits={"stroke error [µm]": ta.Limit(upper=40.0)},
    seed=1,
)
study.allocate(effort="quick").plot("front")
