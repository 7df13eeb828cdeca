"""Pages of HTML from results that have been written to files."""
