"""Which measured part goes where, and how it is turned there, so that the units move most evenly."""
