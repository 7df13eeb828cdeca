"""The bound: the steadiest contact force that an actuator reaches on a line that it knows beforehand."""
