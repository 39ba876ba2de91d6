"""Rare failures: subset simulation and widened sampling in standard normal space."""
