"""Compiled solvers: one sample or many side by side, one angle or a turn, extremes, derivatives, forces."""
