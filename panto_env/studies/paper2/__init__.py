"""Paper 2: the rig, the estimator, the diagnosis and the motors."""
