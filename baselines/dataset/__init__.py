"""Data for learning: recorded episodes as Minari data sets, and a table of simulated designs."""
