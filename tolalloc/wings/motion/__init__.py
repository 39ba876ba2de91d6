"""The reducer in time: the equivalent model with masses and damping, the virtual prototype, and duty cycles."""
