"""Paper 1's active control, its section 5 and Figs 13 to 18."""
