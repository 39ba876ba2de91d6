"""Replicas of published algorithms: evidence that the package is held against, no part of it."""
