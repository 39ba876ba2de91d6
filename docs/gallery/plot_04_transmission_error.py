"""
Transmission error over one turn
================================

One reducer with measured part errors (liu2020, Table 4) under a small torque, over one turn of the output.

**Read off it:** the distance from the lowest to the highest point is the peak-to-peak transmission error, which a
drawing limits; the slow wave comes from run-out, the fast one from pins and teeth.
"""

import tolalloc as ta

turn = ta.te(reducer="rv20e_liu2020", unit="table4")
print(turn.sentences[0])
turn.plot("transmission_error")
