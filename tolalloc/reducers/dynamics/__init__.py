"""The equivalent model in time: masses and damping beside its springs, driven through a speed and a torque profile."""
