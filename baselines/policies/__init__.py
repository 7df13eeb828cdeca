"""Reference policies, one per file."""
