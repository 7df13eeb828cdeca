"""HTML pages from results stored in files."""
