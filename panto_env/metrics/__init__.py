"""What is said of a run: its record and its figures."""
