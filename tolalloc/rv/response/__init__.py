"""The one seam between what is asked and what answers: errors in, outputs and statuses back."""
