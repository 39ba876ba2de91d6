"""Parts of three shapes of distribution: a triangle, a trapezoid, and a Weibull one from the lower limit on."""

import tolalloc as ta

ROW = {"plus": 0.09, "minus": -0.09, "unit": "mm", "min": 0.03, "max": 0.5, "cost": 1}
study = ta.Study(
    ta.model(lambda a, b, c: a + b + c, inputs=("a", "b", "c"), outputs=("sum [mm]",), name="sum"),
    ta.Drawing.of_rows(
        [
            {"id": "a", "nominal": 5, "distribution": "triangular", **ROW},
            {"id": "b", "nominal": 7, "distribution": "trapezoid", "shape": 0.5, **ROW},
            {"id": "c", "nominal": 9, "distribution": "uniform", **ROW},
        ]
    ),
    limits={"sum [mm]": ta.Limit(lower=20.75, upper=21.25, show=ta.AtYield(target=0.99))},
    name="three_shapes",
)
