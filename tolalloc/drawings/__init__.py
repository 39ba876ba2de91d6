"""Error sources: tolerance tables, and the way from a drawing's zone to random columns."""
