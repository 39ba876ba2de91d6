"""Rare failures: the design point, subset simulation and importance sampling in standard normal space."""
