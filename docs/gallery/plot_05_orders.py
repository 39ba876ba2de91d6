"""
Orders of the transmission error
================================

The same curve as waves per output turn. An RV-20E has 40 pins and discs of 39 teeth.

**Read off it:** order 1 is run-out of whole parts; 39 and 40 and their multiples are pins, teeth and crankshafts.
"""

import tolalloc as ta

turn = ta.te(reducer="rv20e_liu2020", unit="table4")
turn.plot("orders")
