"""The report of an identification: its record, tables, figures and sentences."""
