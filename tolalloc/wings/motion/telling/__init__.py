"""What tells people of the answers of this wing, one teller for each kind."""
