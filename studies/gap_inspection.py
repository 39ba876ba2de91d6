"""What the shop must prove of its parts, and how they are inspected: the plan for a gap between four parts.

tolalloc run studies/gap_inspection.py --quick

The yield is promised for processes of Cp 1.33, as `population` says; "uniform" would demand nothing but the zones. No
zone may be below ten times the uncertainty of its gauge. The plan stands in drawing.xlsx and inspection.dfd of the run
folder. All numbers are assumed.
"""

import tolalloc as ta

SIZES = {"housing": 42.0, "ring": 6.0, "bearing": 15.0, "shoulder": 20.9}
COSTS = {"housing": 10.0, "ring": 0.5, "bearing": 5.0, "shoulder": 10.0}
ROW = {"unit": "µm", "plus": 25, "minus": -25, "min": 5, "max": 120, "uncertainty": 3.0, "provenance": "assumed"}
rows = [{"id": part, "nominal": size, "cost": COSTS[part], **ROW} for part, size in SIZES.items()]


def gap(housing, ring, bearing, shoulder):
    """Return the gap [µm] between parts of these sizes [mm]."""
    return 1000 * (housing - ring - bearing - shoulder)


study = ta.Study(
    ta.model(gap, inputs=SIZES, outputs=("gap [µm]",)),
    ta.Drawing.of_rows(rows, population=1.33, gauge_ratio=10),
    limits={"gap [µm]": ta.Limit(lower=70.0, upper=130.0)},
    questions=[ta.Allocation(front=False, what_if=False)],
    name="gap_inspection",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()
