"""The scene: a reducer and one of its units as a picture needs them, everything in millimetres and true proportion."""
