"""What is asked: the design variables with their bounds, and what must be shown of every limited output."""
