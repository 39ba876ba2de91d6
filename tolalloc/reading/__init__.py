"""The door through which the user's files and arguments come in."""
