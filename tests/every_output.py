"""Every output of a run in a travelling window beside the whole line: ``python -m tests.every_output``."""

import warnings

import numpy as np

from panto_env import simulate
from panto_env.catalog import load_catenary
from panto_env.metrics.low_pass import low_pass
from panto_env.plant.catenary.flexible import FlexibleCatenaryData

from .finite_element.sections import MIXED, SOME_STITCHED, STITCHED_330, line_of

EVALUATED = 26
"""Last span that is compared; the first is 10."""
EAC = {
    "kind": "flexible",
    "name": "eac-350",
    "description": "Adif's line for 350 km/h with stitch wires",
    "span_length": 64.0,
    "spans": 60,
    "system": "AC 25 kV",
    "encumbrance": 1.4,
    "free_uplift": 0.24,
    "contact_wire": {"mass": 1.334, "tension": 31.5e3, "bending_stiffness": 215.0},
    "messenger_wire": {"mass": 0.86, "tension": 15.75e3, "bending_stiffness": 60.0},
    "droppers": {
        "positions": [2.5, 7.0, 13.5, 19.5, 25.7, 32.0, 38.3, 44.5, 50.5, 57.0, 61.5],
        "sag": [0.0] * 11,
        "stiffness": 100e3,
        "mass": 0.15,
        "contact_clamp_mass": 0.165,
        "messenger_clamp_mass": 0.195,
    },
    "support": {"stiffness": 500e3, "damping": 1000.0},
    "steady_arm": {"mass": 0.8, "stiffness": 160.0},
    "stitch_wire": {"length": 18.0, "tension": 3500.0, "mass": 0.31},
    "damping": {"alpha": 0.0125, "beta": 1e-4},
}
OVERLAPS = {
    "sequence": [{}] * 56,
    "overlaps": [{"first_span": first, "rises": (0.15, 0.5)} for first in (9, 24, 38)],
}


def _long(changes):
    return changes | {"sequence": changes["sequence"] * 4}


def cases():
    """By name: line, pantograph, speed (km/h), number of spans for a uniform line."""
    beside = {"droppers": {"spacing": 5.0, "first": 2.5}}
    return {
        "uniform, `en50318-2002`": (load_catenary("en50318-2002"), "en50318-2002", 300.0, 55),
        "uniform, `re330`": (load_catenary("re330"), "dsa380", 300.0, 55),
        "uneven": (line_of("re250", _long(MIXED)), "dsa380", 250.0, None),
        "stitched, `re330-stitched`": (load_catenary("re330-stitched"), "dsa380", 300.0, 55),
        "stitched, EAC-350": (FlexibleCatenaryData.model_validate(EAC), "cx", 350.0, 80),
        "stitched and uneven": (line_of("re330", _long(SOME_STITCHED)), "dsa380", 300.0, None),
        "overlaps": (line_of("en50318-2002", OVERLAPS), "en50318-2002", 300.0, None),
        "overlaps, stitched": (line_of("re330", OVERLAPS | STITCHED_330 | beside), "dsa380", 300.0, None),
    }


def largest(difference):
    return float(np.abs(difference).max()) if difference.size else 0.0


def differences(line, pantograph, speed_kmh, spans, last=EVALUATED, **settings):
    """Largest difference of each output from that of the whole line, by its name with the unit."""
    given = ({} if spans is None else {"spans": spans}) | {
        "distance": (last + 1) * line.alignment().mean_length
    }
    with warnings.catch_warnings(action="ignore"):
        run, whole = (
            simulate(line, pantograph, speed_kmh, **given, **each) for each in (settings, {"window": 0})
        )
    spans = (10, last)
    inside, ours, theirs = whole.inside(spans), run.summary(spans), whole.summary(spans)
    of_droppers = [each.dropper_force[inside] for each in (run, whole)]
    at_rest = whole.dropper_force[0]
    computed = of_droppers[0] != at_rest  # a dropper that the window has not reached, or left, is at rest
    spans_ahead = whole.alignment.span_of(whole.dropper_position) - whole.alignment.span_of(
        whole.position[inside]
    ).reshape(-1, 1)
    ahead = [float(np.where(spans_ahead >= 2, force - at_rest, 0.0).max()) for force in of_droppers]
    evaluated = whole.alignment.within(whole.dropper_position, spans)
    uplifts = run.uplift[inside], whole.uplift[inside]
    train = whole.alignment.in_spans(whole.position[inside]).reshape(-1, 1)
    near = np.abs(whole.alignment.in_spans(whole.support_position) - train) < 2
    by = np.abs(whole.alignment.in_spans(whole.dropper_position) - train) < 2
    force = low_pass(run.contact_force - whole.contact_force, whole.time_step)[inside]
    return {
        "window (spans)": run.settings["window"],
        "σ (%)": 100 * (ours.std / theirs.std - 1),
        "max (% of F_m)": 100 * (ours.max - theirs.max) / theirs.mean,
        "min (% of F_m)": 100 * (ours.min - theirs.min) / theirs.mean,
        "force, 20 Hz (N)": largest(force),
        "wire (mm)": 1e3 * largest((run.wire - whole.wire)[inside]),
        "head (mm)": 1e3 * largest((run.head - whole.head)[inside]),
        "frame (mm)": 1e3 * largest((run.frame - whole.frame)[inside]),
        "head (mm/s)": 1e3 * largest((run.head_velocity - whole.head_velocity)[inside]),
        "frame (mm/s)": 1e3 * largest((run.frame_velocity - whole.frame_velocity)[inside]),
        "largest uplift (mm)": 1e3 * (ours.max_uplift - theirs.max_uplift),
        "uplift, any support, any time (mm)": 1e3 * largest((uplifts[0] - uplifts[1])[uplifts[0] != 0]),
        "the same within two spans of the train (mm)": 1e3 * largest((uplifts[0] - uplifts[1])[near]),
        "force of any dropper, any time (N)": largest((of_droppers[0] - of_droppers[1])[computed]),
        "the same within two spans of the train (N)": largest((of_droppers[0] - of_droppers[1])[by]),
        "largest dropper force (N)": float(
            of_droppers[0][:, evaluated].max() - of_droppers[1][:, evaluated].max()
        ),
        "dropper ahead of the train (N over rest)": ahead[0],
        "the same on the whole line": ahead[1],
    }


def main():
    table = {name: differences(*case) for name, case in cases().items()}
    print(f"| output | {' | '.join(table)} |")
    print(f"|---|{'---:|' * len(table)}")
    for key in next(iter(table.values())):
        print(f"| {key} | {' | '.join(f'{each[key]:.3g}' for each in table.values())} |")


if __name__ == "__main__":
    main()
