"""Compiled time steps of many samples."""
