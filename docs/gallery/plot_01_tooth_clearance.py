"""
Gaps of the modified teeth
==========================

The clearance that the tooth modification leaves, from root to tip, once the first pin touches, and how far the load
closes it.

**Read off it:** the first pin touches where the clearance is zero; pins carry between the dashed lines, where the
load closes more than the clearance; at both ends, root and tip, the gap must stay open.
"""

import tolalloc as ta

modified = ta.contact(reducer="rv20e")
print(modified.sentences[0])
modified.plot("clearance")
