"""The commands: words in, an answer out."""
