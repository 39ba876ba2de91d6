"""
Modification amounts as published
=================================

The equidistant and the shift amount with the least mean gap between teeth and pins, as li2018 asks for, and the
clearance that they leave.

**Read off it:** the clearance is nearly zero over the whole flank, which is what this objective asks for. It is paid
for with backlash, which the printed answer of ``ta.modify`` names.
"""

import tolalloc as ta

chosen = ta.modify("li2018", reducer="rv40e", radial=15.0)
print(chosen.sentences[0])
chosen.plot("clearance")
