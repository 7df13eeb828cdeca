"""The oracle, a bound on control: the steadiest contact force that an actuator reaches on a known line."""
