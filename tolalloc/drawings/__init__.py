"""Error sources: tolerance tables, built units, and the way from a drawing's zone to random columns."""
