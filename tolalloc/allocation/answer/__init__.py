"""The report on an allocation: what to write on the drawing, what it costs, and how sure that is."""
