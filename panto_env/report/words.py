"""Fixed sentences of a report: limits of the model, accuracy, and meaning of its figures."""

LEFT_OUT = """
Stitch wires, stagger and the lateral plane, longitudinal motion of droppers and arms, large rotations,
aerodynamic force on the wires, temperature. Motion is linear about the static shape, except for slack
droppers and the unilateral contact. A line is anchored at both ends; this influences its first and last
spans. EN 50318:2018 is not claimed.
""".strip()
"""The same text as in docs/validation.md; a test compares them."""
ACCURACY = """
With the default grid and time step σ, maximum and minimum are within 1 % of converged values up to 70 % of
the wave speed (within 1.5, 2.5 and 2.5 % beyond), contact loss within 0.5 points. A contact harder than 100
kN/m, settings coarser than the default, or waves ahead of the train that no default grid carries have larger
errors, and the run has warned of them. The model itself is validated against EN 50318:2002 and an
independent finite-element model.
""".strip()
FILTER = """
Force statistics use the contact force behind EN 50317's low-pass (20 Hz, sixth order); contact losses use
the raw force.
""".strip()
