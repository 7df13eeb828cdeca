"""The record of a run, its figures of merit, and their names and units."""
