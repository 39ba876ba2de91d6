"""The reducer in time: the equivalent model with masses and damping beside its springs, and the virtual prototype."""
