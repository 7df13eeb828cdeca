"""Figures of a trajectory that is made up by hand, worked out one by one."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from panto_env import InputError, Trajectory
from panto_env.metrics import compliance as en50367
from panto_env.plant.alignment import Alignment

STEP, SPEED_KMH, SPAN, NOMINAL = 0.01, 180.0, 5.0, 100.0
STRIDE = 0.5  # m: ten samples in a span
SAMPLES = 40  # four spans


def trajectory():
    """Force and actuators at random, contact lost twice; uplift grows by 1 mm in each step."""
    random = np.random.default_rng(0)
    force = np.maximum(NOMINAL + random.normal(0, 20, SAMPLES), 0)
    force[[14, 27]] = 0.0
    time = (np.arange(SAMPLES) + 0.5) * STEP
    supports = SPAN * np.arange(1, 4)
    steps = 1e-3 * np.arange(SAMPLES)
    zeros = np.zeros(SAMPLES)
    return Trajectory(
        time=time,
        position=time * SPEED_KMH / 3.6,
        contact_force=force,
        head=zeros,
        frame=zeros,
        wire=zeros,
        head_velocity=zeros,
        frame_velocity=zeros,
        frame_force=random.normal(0, 30, SAMPLES),
        head_force=random.normal(0, 10, SAMPLES),
        uplift=np.column_stack([steps + 0.2, steps + 0.1, steps]),
        support_position=supports,
        dropper_force=np.zeros((SAMPLES, 0)),
        dropper_position=np.zeros(0),
        catenary="made up",
        pantograph="made up",
        speed=SPEED_KMH / 3.6,
        alignment=Alignment.equal(SPAN, 4),
        time_step=STEP,
        nominal_force=NOMINAL,
    )


RUN = trajectory()


def filtered():
    """EN 50317: sixth-order Butterworth at 20 Hz, as a transfer function, from a force long at rest."""
    numerator, denominator = butter(6, 20.0, fs=1 / STEP)
    before = np.full(400, RUN.contact_force[0])
    return lfilter(numerator, denominator, np.append(before, RUN.contact_force))[400:]


@pytest.mark.parametrize(
    ("spans", "inside"), [("all", slice(0, 40)), ((1, 4), slice(0, 40)), ((2, 3), slice(10, 30))]
)
def test_statistics_are_those_of_the_filtered_force_in_the_spans(spans, inside):
    """The filter runs from the start of the run: at a span's beginning it is not at rest."""
    figures, force = RUN.summary(spans), filtered()[inside]
    assert figures.mean == pytest.approx(force.sum() / len(force), rel=1e-6)
    sigma = np.sqrt(((force - figures.mean) ** 2).sum() / len(force))
    assert figures.std == pytest.approx(sigma, rel=1e-6)
    assert figures.statistical_max == pytest.approx(figures.mean + 3 * sigma, rel=1e-6)
    assert figures.statistical_min == pytest.approx(figures.mean - 3 * sigma, rel=1e-6)
    assert figures.max == pytest.approx(max(force), rel=1e-6)
    assert figures.min == pytest.approx(min(force), rel=1e-6)


def test_losses_cost_and_actuators_are_those_of_the_raw_samples_in_the_spans():
    figures = RUN.summary((2, 3))
    force, frame, head = RUN.contact_force[10:30], RUN.frame_force[10:30], RUN.head_force[10:30]
    assert figures.contact_loss == 100 * 2 / 20
    deviations = [abs(value - NOMINAL) for value in force]
    trapezoids = [STRIDE * (left + right) / 2 for left, right in pairwise(deviations)]
    assert figures.cost_function == pytest.approx(sum(trapezoids))
    squares = [a**2 + b**2 for a, b in zip(frame, head, strict=True)]
    assert figures.effort == pytest.approx(np.sqrt(sum(squares) / 20))
    rates = [(frame[k + 1] - frame[k]) ** 2 + (head[k + 1] - head[k]) ** 2 for k in range(19)]
    assert figures.effort_rate == pytest.approx(np.sqrt(sum(rates) / 19) / STEP)
    assert figures.distance == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("spans", "uplift"),
    [
        ("all", 0.2 + 0.039),  # all supports, all samples
        ((3, 3), 0.1 + 0.029),  # supports 2 and 3 at its ends, until the train leaves the span
        ((4, 4), 0.039),  # support 3 alone
        ((1, 1), 0.2 + 0.009),
    ],
)
def test_uplift_is_that_of_the_supports_at_both_ends_of_the_spans_and_between(spans, uplift):
    assert RUN.summary(spans).max_uplift == pytest.approx(uplift)


def test_a_support_beyond_the_spans_has_no_part_in_their_uplift():
    rising = replace(RUN, uplift=RUN.uplift[:, ::-1].copy())
    assert rising.summary((1, 1)).max_uplift == pytest.approx(0.009)  # of support 1 alone


def test_a_line_without_supports_has_no_uplift():
    bare = replace(RUN, uplift=np.zeros((SAMPLES, 0)), support_position=np.zeros(0))
    assert np.isnan(bare.summary("all").max_uplift)


def test_a_single_sample_has_no_rate():
    arrays = {
        name: value[:1] for name, value in vars(RUN).items() if getattr(value, "shape", ())[:1] == (40,)
    }
    figures = replace(RUN, **arrays).summary("all")
    assert (figures.effort_rate, figures.cost_function) == (0.0, 0.0)
    assert figures.mean == pytest.approx(RUN.contact_force[0])


def test_spans_up_to_the_last_sample_are_covered_and_no_more():
    RUN.summary((1, 4))
    with pytest.raises(InputError, match=r"end at 25 m, but the run ends at 19\.8 m"):
        RUN.summary((1, 5))
    short = {
        name: value[:-1] for name, value in vars(RUN).items() if getattr(value, "shape", ())[:1] == (40,)
    }
    with pytest.raises(InputError, match="end at 20 m"):
        replace(RUN, **short).summary((1, 4))


def test_limits_are_those_of_the_mean_speed_over_the_spans():
    """A train that speeds up from 40 m/s by 20 m/s in the 0.4 s of the run."""
    speeding = replace(
        RUN, position=40 * RUN.time + 25 * RUN.time**2, settings={"speed_drift": 5.0}, speed=50.0
    )
    assert speeding.identity.drifts
    inside = speeding.inside((1, 1))
    mean = 40 + 50 * speeding.time[inside].mean()
    limits = {each.key: each for each in speeding.compliance((1, 1))}
    assert limits["mean"].highest == pytest.approx(en50367.largest_mean(float(mean), "AC"))
    steady = {each.key: each for each in RUN.compliance((1, 1))}
    assert steady["mean"].highest == pytest.approx(en50367.largest_mean(50.0, "AC"))
    assert steady["mean"].highest - limits["mean"].highest > 1.0
    assert np.ptp(speeding.speeds) == pytest.approx(50 * 0.39)
