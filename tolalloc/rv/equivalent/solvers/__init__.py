"""Compiled solvers: one sample or eight side by side, one angle or a turn, extremes, derivatives, forces."""
