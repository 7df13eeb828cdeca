"""Fixed sentences of a report: limits of the model, accuracy, and meaning of its figures."""

LEFT_OUT = (
    "section insulators, crossings and neutral sections",
    "two contact wires whose droppers alternate: they are one equivalent wire",
    "curves, stagger and the lateral plane",
    "wind on stitch wires, droppers and arms, tunnels; ice and temperature that differ along the line",
    "rigid rails and third rails",
    "roll and pitch of the collector head and its two strips: it is one point",
    "motion of the vehicle and of the track",
    "longitudinal motion of droppers and arms, large rotations: motion is linear about the static shape, but "
    "for slack droppers and the unilateral contact",
    "lines without ends: a line is anchored at both ends, which influences its first and last spans",
    "EN 50318:2018, which is not claimed",
)
"""What no run computes, for all reports; docs/validation.md shows the same, and a test compares them."""
ACCURACY = """
With the default grid and time step σ is within 1 % of its converged value (2 % where no wire has bending
stiffness), maximum and minimum within 1.5 % of the mean force up to 70 % of the wave speed and 2.5 % beyond
(2.5 % without bending stiffness), contact loss within 0.75 points. A contact harder than 100
kN/m, settings coarser than the default, or waves ahead of the train that no default grid carries have larger
errors, and the run has warned of them. The model itself is validated against EN 50318:2002 and an
independent finite-element model.
""".strip()
FILTER = """
Force statistics use the contact force behind EN 50317's low-pass (20 Hz, sixth order); contact losses use
the raw force.
""".strip()
