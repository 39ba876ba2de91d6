"""What a zone costs: cost models, processes that compete for a feature, and the price of a unit."""
