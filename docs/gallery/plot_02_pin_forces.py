"""
Pin forces at one phase of the crank
====================================

The force of each pin of one disc under rated torque, with exact parts: by the law of the model at every pin, and by the
linear method of the textbooks.

**Read off it:** which pins carry, and how much more the most loaded one carries than the mean.
"""

import tolalloc as ta

modified = ta.contact(reducer="rv20e")
print(modified.sentences[1])
modified.plot("forces")
