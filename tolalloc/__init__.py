"""Which drawing tolerance of an RV reducer drives its transmission error, and which tolerances are the cheapest."""
