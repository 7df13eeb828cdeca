"""Paper 1's identification."""
