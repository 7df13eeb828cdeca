"""Paper 3's parameter studies."""
