"""Compiled loops over pins."""
