"""
Gaps of the modified teeth
==========================

What the tooth modification takes off, along the normal, from the root of a tooth to its tip.

**Read off it:** the teeth touch first where the curve, seen by its lever, is lowest; the ends of the curve are the gaps at
root and tip, where no tooth may press.
"""

import tolalloc as ta

modified = ta.contact(reducer="rv20e")
print(modified.sentences[0])
modified.plot("clearance")
