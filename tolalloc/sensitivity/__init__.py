"""What matters: Sobol indices with confidence in the ranking, and the classical estimates beside them."""
