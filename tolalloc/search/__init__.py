"""How a search came to its answer, whatever was searched."""
