"""
How many pins carry
===================

The number of pins that carry changes while the crank turns by one pin pitch.

**Read off it:** the smallest number, which is what a check of the pressure has to hold for.
"""

import tolalloc as ta

modified = ta.contact(reducer="rv40e")
modified.plot("pins_in_contact")
