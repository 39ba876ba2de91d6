"""A study with its questions, what runs them, and the folder of a run."""
