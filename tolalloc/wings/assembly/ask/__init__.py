"""Questions of this wing, one record each: what `tolalloc` and ``ta`` ask."""
