"""A study, its stages and its run folder."""
