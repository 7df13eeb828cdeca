"""Single passes, sweeps, and plots of them."""
