"""Measured data of finished reducers: read from files, cleaned, every repair counted."""
