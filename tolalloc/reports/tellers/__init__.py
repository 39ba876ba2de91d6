"""One teller for each kind of result: its tables, figures and sentences."""
