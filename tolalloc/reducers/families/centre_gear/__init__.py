"""The RV reducer with centre gear and hollow shaft: its nominal design and file, then what its model has."""
