"""Questions that a command asks without a study: one record each."""
