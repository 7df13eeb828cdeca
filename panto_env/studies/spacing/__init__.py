"""Distances between two pantographs: which are bad, and which theory says so."""
