"""The benchmark that compares policies."""
