"""Diagnosis: from the transmission error of one unit back to the errors of its parts."""
