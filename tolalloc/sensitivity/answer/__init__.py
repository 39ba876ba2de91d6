"""The report on what drives a reducer's outputs."""
