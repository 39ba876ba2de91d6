"""The single-stage cycloid drive: its nominal design and file, then what its model has."""
