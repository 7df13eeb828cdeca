"""Reference policies and the benchmark that compares policies."""
