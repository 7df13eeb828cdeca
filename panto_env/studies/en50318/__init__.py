"""Validation of the flexible catenary: EN 50318:2002, and what discretisation and window do to figures."""
