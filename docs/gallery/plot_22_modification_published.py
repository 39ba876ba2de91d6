"""
Modification amounts as published
=================================

The equidistant and the shift amount with the least mean gap between teeth and pins, as li2018 asks for, and the profile
that they leave.

**Read off it:** the gap over the flank is even, which is what the objective asks for; what it does to backlash is another
matter.
"""

import tolalloc as ta

chosen = ta.modify("li2018", reducer="rv40e", radial=15.0)
print(chosen.sentences[0])
chosen.plot("clearance")
