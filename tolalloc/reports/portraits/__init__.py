"""One portrait for each kind of model that has more to say than any model."""
