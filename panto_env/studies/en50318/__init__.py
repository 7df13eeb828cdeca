"""Validation of the flexible catenary."""
