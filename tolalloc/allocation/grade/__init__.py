"""The zones that a drawing asks for: ISO 286 grades, preferred numbers, and the ladder of each source."""
