"""The RV reducer and the single-stage drive: one model of this package, and its own tools.

`reducer` is the nominal one with its files, `cycloid` its tooth stage, `equivalent` the spring model that is solved,
`response` what that answers to random units, `families` what tells one kind of drive from another. `choice.reducer`
binds one to a drawing as `model.ReducerModel`; `contact`, `modification` and `transmission_error` answer questions of
their own.
"""

PEAK_TO_PEAK = "peak-to-peak transmission error [arcsec]"
"""Output side, one output turn, at the torque of the study."""
LOST_MOTION = "lost motion [arcmin]"
"""Between ±3 % of the rated torque."""
BACKLASH = "backlash [arcmin]"
"""Twist at no torque, between both directions."""
TORSIONAL_STIFFNESS = "torsional stiffness [N·m/arcmin]"
"""Between 3 % and 100 % of the rated torque."""
TORQUE = "torque [N·m]"
"""Condition of every answer: torque on the carrier, negative where it resists the rotation."""
DISC_TEMPERATURE = "discs warmer than the ring [K]"
"""Condition of every answer: temperature of the discs less that of the ring of pins, 0 unless said."""
PRELOAD = "largest pin force without torque [N]"
"""What pins and teeth press before any torque acts: a preloaded unit if it reaches what the rated torque makes."""
FRICTION_TORQUE = "largest friction torque of the pins without load [N·m]"
"""Of discs sliding on pins alone, largest over a turn, at the output: from that preload and an assumed coefficient."""
EFFICIENCY = "efficiency at rated torque [%]"
"""Of the contacts alone; of reducers whose bearings and gears are stated by their dimensions, as the next two."""
LOST_MOTION_WITH_FRICTION = "lost motion with friction [arcmin]"
"""Between the middles of the loop's width at ±3 % of the rated torque."""
HYSTERESIS_LOSS = "hysteresis loss [arcmin]"
"""Width of the loop with friction at no torque."""
RADIAL_CLEARANCE = "radial clearance at tip and root [µm]"
"""Smallest one of a unit; negative where a tooth tip or root interferes."""
