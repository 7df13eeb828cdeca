"""Paper 2: the rig, the estimator, the diagnosis, and the motors of the collector head."""
