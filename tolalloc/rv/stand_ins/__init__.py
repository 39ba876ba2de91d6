"""Stand-ins for the equivalent model that use its structure."""
