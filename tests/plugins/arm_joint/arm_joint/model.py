"""A model: two lengths in a row."""

import tolalloc as ta

STACK = ta.model(lambda a, b: a + b, inputs={"a": 10.0, "b": 5.0}, outputs=("length [mm]",), name="stack")
