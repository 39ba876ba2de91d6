"""
Torque against twist, with friction
===================================

The sun is held and the torque goes from plus to minus the rated one and back. Friction makes two branches of the
curve.

**Read off it:** the lost motion is the way between the middles of the loop at ±3 % of rated torque, the hysteresis
loss its width at zero, the torsional stiffness the slope of the outer parts.
"""

import tolalloc as ta

turn = ta.te(reducer="rv20e", unit="table4")
print(turn.sentences[1])
turn.plot("hysteresis")
