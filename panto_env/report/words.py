"""Sentences that a report must hold: what the model leaves out, and how its figures are meant."""

LEFT_OUT = """
Stitch wires, stagger and the lateral plane, longitudinal motion of droppers and arms, large rotations,
aerodynamic force on the wires, temperature. Motion is linear about the static shape, except for slack
droppers and the unilateral contact. A line is anchored at both ends; this influences its first and last
spans. EN 50318:2018 is not claimed.
""".strip()
"""As in docs/validation.md, which a test compares."""
ACCURACY = """
By default grid and time step leave σ, maximum and minimum within about 1 % of converged ones, contact loss
within 0.1 points; a contact harder than 100 kN/m, or settings coarser than the default, leave more, and the
run warned of it. The model itself is held against EN 50318:2002 and an independent finite-element model.
""".strip()
FILTER = """
Force statistics are of the contact force behind EN 50317's low-pass (20 Hz, sixth order); losses of contact
are of the raw force.
""".strip()
