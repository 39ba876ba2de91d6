"""Angular tolerances of parts that are adjusted while they are assembled."""
