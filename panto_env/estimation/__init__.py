"""The contact force, and parameters, from the motion of a pantograph alone (paper 2, section 4.1)."""
