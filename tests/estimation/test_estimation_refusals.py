"""What no pantograph does is refused with the likely mistake; what not to believe is said."""

import dataclasses
import re

import numpy as np
import pytest

from panto_env.base.errors import InputError
from panto_env.catalog import load_pantograph
from panto_env.estimation.estimate import estimate
from panto_env.estimation.innovations import Consistency, Whiteness, judge
from panto_env.estimation.model import EstimatorSettings
from panto_env.estimation.motion import check_motion, rezeroed, suspension_offset
from panto_env.estimation.parameters import changed

TRUE = load_pantograph("own-two-mass")


def with_value(motion, name, place, value):
    values = getattr(motion, name).copy()
    values[place] = value
    return dataclasses.replace(motion, **{name: values})


def part(motion, samples):
    names = ("head", "frame", "head_velocity", "frame_velocity", "frame_force", "head_force")
    return dataclasses.replace(motion, **{name: getattr(motion, name)[samples] for name in names})


def with_values(motion, **changes):
    return dataclasses.replace(motion, **changes)


def saturated(motion):
    return with_values(motion, head=np.minimum(motion.head, np.quantile(motion.head, 0.9)))


def upside_down(motion):
    return with_values(motion, head=-motion.head, head_velocity=-motion.head_velocity)


REFUSED = {
    "a gap": (lambda m: with_value(m, "frame", slice(500, 510), np.nan), r"frame holds no number at 0\.50"),
    "mm for m": (
        lambda m: with_values(m, head=1e3 * m.head),
        "holds displacements of .* mm in a column",
    ),
    "as much as from end to end": (
        lambda m: with_values(m, head=m.head.mean() + 1.1 * (m.head - m.head.mean()) / np.ptp(m.head)),
        "holds a motion of 1.1 m, which no pantograph makes",
    ),
    "m for mm": (lambda m: with_values(m, head=1e-4 * m.head), "moves by .* µm only: metres"),
    "a jump": (
        lambda m: with_value(m, "head", slice(9000, None), m.head[9000:] + 0.1),
        "by 100 mm at 9",
    ),
    "dead": (lambda m: with_value(m, "frame", slice(3000, 3200), 0.0651), r"one value from 3\.0.* is dead"),
    "saturated": (saturated, "the sensor is saturated"),
    "a dead velocity": (
        lambda m: with_value(m, "frame_velocity", slice(3000, 3200), 0.0),
        "frame_velocity .* leave out the columns of velocity",
    ),
    "mm/s for m/s": (
        lambda m: with_values(m, head_velocity=1e3 * m.head_velocity),
        r"head_velocity is 1e\+03 times the rate at which its height changes",
    ),
    "a velocity upside down": (
        lambda m: with_values(m, frame_velocity=-m.frame_velocity),
        "frame_velocity is -1 times the rate",
    ),
    "one velocity": (lambda m: with_values(m, head_velocity=None), "Only frame_velocity is measured"),
    "heights down": (upside_down, "another zero than where the springs"),
    "another zero": (lambda m: with_values(m, head=m.head + 0.02), "another zero than where the springs"),
    "a short record": (lambda m: part(m, slice(0, 1500)), r"is 1\.5 s long; give 2 s at least"),
    "less than a span": (
        lambda m: part(with_values(m, speed=20.0), slice(0, 2500)),
        "covers 50 m, less than a span of 60 m",
    ),
    "a clock in ms": (lambda m: with_values(m, time_step=1.0), "has 1 samples a second; 50 to 50,000"),
}


@pytest.mark.parametrize(("change", "message"), REFUSED.values(), ids=REFUSED)
def test_what_no_pantograph_does_is_refused_with_the_likely_mistake(change, message, motion):
    check_motion(motion, TRUE)
    with pytest.raises(InputError, match=message) as caught:
        estimate(change(motion), TRUE)
    assert re.search(r"[.?]$", str(caught.value))


@pytest.mark.longer
def test_pantographs_and_settings_that_do_not_fit(motion):
    single = TRUE.model_copy(update={"masses": (8.0,), "stiffnesses": (50.0,), "dampings": (1.0,)})
    with pytest.raises(InputError, match="one mass only"):
        estimate(motion, single)
    bare = dataclasses.replace(motion, head_velocity=None, frame_velocity=None)
    with pytest.raises(InputError, match="no velocities; take the observation 'displacements'"):
        estimate(bare, TRUE)
    found = estimate(bare, TRUE, EstimatorSettings(observation="displacements"))
    same = estimate(motion, TRUE, EstimatorSettings(observation="displacements"))
    np.testing.assert_array_equal(found.force, same.force)


def test_a_free_zero_leaves_the_mean_to_the_lift(motion):
    moved = dataclasses.replace(motion, head=motion.head + 0.02)
    back = rezeroed(moved, TRUE)
    assert suspension_offset(back, TRUE) == pytest.approx(0.0, abs=1e-9)
    assert np.abs(back.head - motion.head).max() < 1e-4
    with pytest.raises(InputError, match="No spring holds the head"):
        rezeroed(motion, changed(TRUE, {"stiffnesses.1": 0.0}))


def scaled(motion):
    middle = motion.head.mean()
    return with_values(motion, head=middle + 1.1 * (motion.head - middle))


def noisier(motion):
    noise = 6e-5 * np.random.default_rng(9).standard_normal(len(motion.head))
    return with_values(motion, head=motion.head + noise)


def as_it_is(motion):
    return motion


NEAR = {"masses.1": 8.4, "masses.2": 13.65, "stiffnesses.1": 6650.0, "dampings.2": 105.0}
FAULTS = {
    "healthy": (as_it_is, TRUE, None),
    "parameters 5 % wrong": (as_it_is, changed(TRUE, NEAR), None),
    "scale of the head": (scaled, TRUE, "a sensor's scale, or a wrong pantograph"),
    "noise": (noisier, TRUE, "more noise than said"),
    "a step of a sensor": (
        lambda m: with_value(m, "head", slice(9000, None), m.head[9000:] + 1e-3),
        TRUE,
        r"about [89]\.\d+ s, where it is largest",
    ),
    "a sensor dead for 80 ms": (
        lambda m: with_value(m, "head", slice(8000, 8080), m.head[8000]),
        TRUE,
        r"about [78]\.\d+ s, where it is largest",
    ),
    "a wrong suspension": (
        as_it_is,
        changed(TRUE, {"stiffnesses.1": 9100.0}),
        r"what the lift leaves \(N\): 3\d.*, not -20 to 20",
    ),
    "another pantograph": (as_it_is, load_pantograph("en50318-2002"), r"leaves \(N\): -"),
}


@pytest.mark.parametrize(("change", "pantograph", "reason"), FAULTS.values(), ids=FAULTS)
def test_what_not_to_believe_is_said(change, pantograph, reason, motion):
    found = estimate(change(motion), pantograph)
    assert found.verdict.believe == (reason is None), found.verdict
    assert reason is None or any(re.search(reason, each) for each in found.verdict.reasons), found.verdict


def made_up(nis=1.0, window=1.0, correlation=0.0):
    whiteness = Whiteness(correlation, 0.03, 1.0)
    return Consistency(nis, (0.98, 1.02), np.array([1.0, window]), np.arange(2.0), whiteness)


@pytest.mark.parametrize(
    ("name", "found", "suspension"),
    [
        ("innovations squared", made_up, 0.0),
        ("the same about", lambda value: made_up(window=value), 0.0),
        ("their autocorrelation", lambda value: made_up(correlation=value), 0.0),
        ("force of the head's suspension", None, 1.0),
    ],
)
def test_an_estimate_is_judged_by_the_bounds_that_are_printed(name, found, suspension):
    """A hair within the printed bounds and a hair beyond them, and the value as it is printed."""

    def verdict(value):
        return judge(made_up() if found is None else found(value), suspension * value)

    (bounds,) = [test.bounds for test in verdict(1.0).tests if test.name.startswith(name)]
    *low, high = (float(number) for number in bounds.removeprefix("up to ").split(" to "))
    for bound, beyond in ((high, 1), *((each, -1) for each in low)):
        for step, believed in ((-1e-5, True), (1e-5, False)):
            judged = verdict(bound + beyond * step)
            assert judged.believe is believed
            (test,) = [test for test in judged.tests if test.name.startswith(name)]
            shown = float(test.text)
            assert (shown > high or bool(low and shown < low[0])) is not believed
            assert believed or f"{test.text}, not {bounds}" in judged.reasons[0]


@pytest.mark.longer
def test_a_wrong_head_mass_and_a_wrong_lift_cannot_be_seen(motion):
    """The limits of all tests, which documents and the command's help tell."""
    heavy = estimate(motion, changed(TRUE, {"masses.1": 10.0}))
    assert heavy.verdict.believe
    assert (heavy.force - motion.contact_force)[2000:].std() > 1.05 * (
        (estimate(motion, TRUE).force - motion.contact_force)[2000:].std()
    )
    lifted = estimate(dataclasses.replace(motion, lift=105.0), TRUE)
    assert lifted.verdict.believe
    assert (lifted.force - motion.contact_force)[2000:].mean() == pytest.approx(-15, abs=1)
