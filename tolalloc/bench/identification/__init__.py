"""From measured units to stiffnesses, and to what the measurements cannot tell."""
