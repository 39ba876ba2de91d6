"""A chain of three sizes whose shop has asked for each process what it costs."""

import tolalloc as ta

ROW = {"unit": "mm", "plus": 0.04, "minus": -0.04, "min": 0.005, "max": 0.3, "cost": 1}
WAYS = {
    "a": [("turned", 0.4, 0.05, 0.05, 0.25), ("ground", 1.5, 0.02, 0.01, 0.06)],
    "b": [("turned", 0.4, 0.05, 0.05, 0.25), ("ground", 1.5, 0.02, 0.01, 0.06)],
    "c": [("milled", 0.2, 0.08, 0.03, 0.3)],
}
study = ta.Study(
    ta.model(lambda a, b, c: a - b - 0.5 * c, inputs={"a": 40, "b": 30, "c": 19}, outputs=("gap [mm]",), name="gap"),
    ta.Drawing.of_rows([{"id": name, **ROW} for name in "abc"], costs=WAYS, currency="EUR"),
    limits={"gap [mm]": ta.Limit(lower=0.42, upper=0.58)},
    name="shop_prices",
)
