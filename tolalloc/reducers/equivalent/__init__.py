"""The equivalent model: rows of springs, their equilibrium against the pins, and the transmission error."""
