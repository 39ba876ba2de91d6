"""Compiled functions of the cycloid stage."""
