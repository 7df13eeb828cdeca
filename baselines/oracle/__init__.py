"""The bound: the steadiest contact force that an actuator can reach on a line that it knows, ahead of time."""
