"""Reference policies, one a file."""
