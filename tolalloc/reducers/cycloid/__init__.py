"""The cycloid stage: tooth profile, modification, clearance and loaded contact of discs and pins."""
