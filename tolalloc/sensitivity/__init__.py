"""What drives an output: indices with the confidence of their ranking, and the measures beside them."""
