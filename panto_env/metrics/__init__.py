"""What is said of a run: its record, its figures of merit, and their names and units."""
