"""Paper 2: the rig, the estimator, diagnosis, and motors in the head (its Figs 5 to 15)."""
