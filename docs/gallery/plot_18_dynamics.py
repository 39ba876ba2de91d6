"""
A reducer in motion
===================

An RV-40E starts, runs at full speed and is loaded. The equivalent model moves with the masses of its parts.

**Read off it:** how long the motion needs to settle, and how far it leaves the static model.
"""

import tolalloc as ta

motion = ta.simulate(reducer="rv40e", duration=0.9, ramp=0.3, step=1e-4, output_inertia=1.0)
print(motion.sentences[2])
motion.plot("transmission_error")
