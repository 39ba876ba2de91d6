"""
A reducer in motion
===================

An RV-40E at full speed under load, after it was started: the equivalent model with the masses of its parts, and a
disc of 1 kg·m² at the output, beside the static model.

**Read off it:** how far motion leaves the static model. Without the mass at the output there is hardly a difference.
"""

import tolalloc as ta

motion = ta.simulate(reducer="rv40e", duration=0.9, ramp=0.3, step=1e-4, output_inertia=1.0)
print(motion.sentences[2])
motion.plot("transmission_error")
