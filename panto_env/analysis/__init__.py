"""Runs and what is made of them: single passes, sweeps, plots."""
