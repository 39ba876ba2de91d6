"""
Sorted parts
============

The cheapest zones of a hole and a shaft whose gap must stay within ±8 µm, for random parts and for parts that are
sorted into classes and mated class by class; sorting and parts that find no mate cost as well.

**Read off it:** where one more class saves less in the zones than it costs at assembly.
"""

import tolalloc as ta

row = {"plus": 10, "minus": -10, "unit": "µm", "min": 2, "max": 60, "cost": 10.0}
study = ta.Study(
    ta.model(lambda hole, shaft: 1000 * (hole - shaft), inputs={"hole": 10.0, "shaft": 10.0}, outputs=("gap [µm]",)),
    ta.Drawing.of_rows([{"id": "hole", "nominal": 10.0, **row}, {"id": "shaft", "nominal": 10.0, **row}]),
    limits={"gap [µm]": ta.Limit(lower=-8.0, upper=8.0)},
    compensators=[ta.Sorting("shaft", "hole", classes=(1, 2, 3, 4), class_cost=2.0, leftover_cost=2.0)],
    questions=[ta.Allocation(front=False, what_if=False)],
    effort=ta.Effort(
        allocation=ta.AllocationEffort(verification_units=2**13, confirmation_units=2**16, share_blocks=64)
    ),
)
answer = study.allocate()
print(answer.sentences[3])
answer.plot("assembly")
