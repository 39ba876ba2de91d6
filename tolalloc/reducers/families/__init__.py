"""Families of reducers as values: what says "disc", "crank" or "output pin" by a number or a name stands there."""
