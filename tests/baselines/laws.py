"""Contexts and observations by hand, and a law in closed loop with the linear model of the mean line."""

import numpy as np

from panto_baselines.policies.line_model import OUTPUTS, Sampled, line_model, mean_line
from panto_env.control import Task
from panto_env.control.settings import run_settings


def a_context(speed_kmh=250.0, **settings):
    """The context of an episode."""
    task = Task(run_settings({"speed_kmh": speed_kmh, "accuracy": "fast"} | settings), keep_samples=False)
    task.reset(0, np.random.default_rng(0))
    return task.context(0)


CONTEXT = a_context()
MODEL = line_model(CONTEXT, mean_line(CONTEXT))


def seen(context=CONTEXT, angle=0.0, **values):
    """An observation, (1, entries), at an angle of the span, with these values (spaces as underscores)."""
    place = {"sine_of_span_position": np.sin(angle), "cosine_of_span_position": np.cos(angle)}
    observation = np.zeros((1, len(context.layout.entries)), dtype=np.float32)
    for name, value in (place | {"speed": context.speed} | values).items():
        column = context.layout.index(name.replace("_", " "))
        observation[0, column] = value / context.layout.entries[column].scale
    return observation


def repeated(law, spans, sign=1.0, blind=False, speed_error=0.0):
    """Sigma of each span of the model, under a force that repeats with the span, with and without control.

    sign: of the plant's answer. blind: the place is not told. speed_error: share by which the speed is read
    too high.
    """
    rate = CONTEXT.speed / CONTEXT.alignment.mean_length * CONTEXT.control_interval
    sampled = Sampled(MODEL, CONTEXT.control_interval)
    law.begin(CONTEXT, 1)
    state = np.zeros(sampled.size)
    told = {"speed": CONTEXT.speed * (1 + speed_error)}
    told |= {"sine_of_span_position": 0.0, "cosine_of_span_position": 0.0} if blind else {}
    with_control, without = [], []
    for k in range(int(spans / rate)):
        angle = 2 * np.pi * k * rate
        without.append(115 + 20 * np.cos(angle) + 15 * np.sin(2 * angle) - 8 * np.cos(3 * angle))
        outputs = dict(zip((name.replace(" ", "_") for name in OUTPUTS), sampled.c @ state, strict=True))
        outputs["contact_force"] = without[-1] + sign * outputs["contact_force"]
        state = sampled.a @ state + sampled.b * float(law.forces(seen(angle=angle, **outputs | told))[0])
        with_control.append(outputs["contact_force"])
    whole = [slice(int(np.ceil(j / rate)), int((j + 1) / rate)) for j in range(spans - 1)]
    controlled, passive = (
        np.array([np.std(np.array(force)[each]) for each in whole]) for force in (with_control, without)
    )
    return controlled, passive
