"""What of a line explains measured forces: tensions, droppers, supports, found by Gauss-Newton on lanes."""
