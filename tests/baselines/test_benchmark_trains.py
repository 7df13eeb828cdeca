"""A benchmark of trains: the judged pantograph is the controlled one, the worst where several are."""

from dataclasses import replace

import numpy as np
import pytest

from panto_baselines.benchmark import apart
from panto_baselines.benchmark.run import evaluated_windows
from panto_baselines.benchmark.settings import BenchmarkSettings, Line, Windows
from panto_baselines.benchmark.single_pass import run_pass
from panto_baselines.benchmark.statistics import compare
from panto_env import InputError, simulate
from panto_env.base.settings import parse

TRAIN = {"pantographs": ("dsa380", "en50318-2002"), "distances": (80.0,), "distance": 600.0}
SPANS = (5, 9)
SPEED_KMH = 280.0


class Shaking:
    """Commands that alternate, so that their rate is known: 40 N up, 40 N down."""

    def reset(self, context):
        self.sign = 1.0

    def act(self, observation):
        self.sign = -self.sign
        return np.array([0.4 * self.sign])


def settings(**given):
    return parse(BenchmarkSettings, given, "the benchmark")


@pytest.fixture(autouse=True, scope="module")
def ended():
    yield
    apart.close()


@pytest.mark.longer
def test_figures_are_those_of_the_controlled_pantograph():
    row = a_pass("pd", 2).row
    run = simulate(**TRAIN, controlled=2, speed_kmh=SPEED_KMH, policy="pd", line_condition="smooth")
    own = run.train[1]
    assert row.figures == own.summary(SPANS)
    assert row.nominal_force == own.nominal_force
    assert own.summary(SPANS).std != run.summary(SPANS).std
    means = [each.summary(SPANS).mean for each in run.train]
    pressed = simulate(
        **TRAIN, speed_kmh=SPEED_KMH, line_condition="smooth", mean_force=means, trimmed_over=SPANS
    )
    for each, mean in zip(pressed.train, means, strict=True):
        assert each.summary(SPANS).mean == pytest.approx(mean, abs=0.06)
    assert abs(means[0] - means[1]) > 5
    assert row.pressed_std == pytest.approx(pressed.train[1].summary(SPANS).std)


def a_pass(policy, controlled, **given):
    line = Line(**TRAIN, controlled=controlled)
    return run_pass(settings(), line, Windows(SPANS), policy, SPEED_KMH, seed=0, **given)


def test_its_commands_count_while_it_is_in_the_spans():
    assert a_pass(Shaking(), 2).row.action_rate == pytest.approx(80.0 / 0.01)


@pytest.mark.longer
def test_of_two_the_worst_counts_and_both_play_again():
    done = a_pass("pd", [1, 2])
    run = simulate(**TRAIN, controlled=[1, 2], speed_kmh=SPEED_KMH, policy="pd", line_condition="smooth")
    sigmas = [each.summary(SPANS).std for each in run.train]
    assert done.row.figures.std == max(sigmas) > min(sigmas)
    means = [each.summary(SPANS).mean for each in run.train]
    assert list(done.row.means) == means
    assert [done.row.as_dict()[name] for name in ("mean_1", "mean_2")] == means
    assert done.played.actions.shape[1] == 2
    assert not np.array_equal(*done.played.actions.T)
    assert a_pass("pd", [1, 2], played=done.played).row == done.row


@pytest.mark.longer
def test_the_mean_of_each_is_held_not_only_that_of_the_one_that_is_judged():
    """Passively the second swings more; the policy calms it, and moves the mean of the first."""
    passive = a_pass("passive", [1, 2]).row
    first, second = passive.means
    assert passive.figures.mean == second != first
    for moved in ((1.04 * first, second), (0.96 * first, second), (first, 1.04 * second)):
        row = replace(passive, policy="p", controlled_means=moved)
        cell = next(each for each in compare([passive, row]) if each.policy == "p")
        assert abs(cell.mean_change) == pytest.approx(4.0)
        assert "it moves the mean force by" in cell.disqualified
    kept = replace(passive, policy="p", figures=replace(passive.figures, mean=first))  # that one is judged
    cell = next(each for each in compare([passive, kept]) if each.policy == "p")
    assert cell.mean_change == 0.0
    assert not cell.disqualified


@pytest.mark.longer
def test_one_that_learns_does_not_learn_while_it_waits():
    """The second stands at the line's start for 200 m: what it reads there repeats with nothing."""
    given = {"pantographs": ["dsa380"] * 2, "distances": [200.0], "speed_kmh": 250.0, "policy": "repetitive"}
    given |= {"actuator": "realistic", "sensors": "realistic", "line_condition": "smooth"}
    alone, both = (simulate(**given, controlled=numbers).train[1] for numbers in (2, [1, 2]))
    assert not both.frame_force[: np.searchsorted(both.position, 0.5)].any()
    assert both.summary().effort > 0.5 * alone.summary().effort > 5


def test_spans_are_those_that_the_last_one_covers():
    asked = settings(lines=[TRAIN | {"controlled": 2, "distance": 900.0}])
    lone = settings(lines=[{"pantograph": "dsa380", "distance": 900.0}])
    assert evaluated_windows(asked, asked.lines[0]) == evaluated_windows(lone, lone.lines[0])


def test_what_cannot_be_a_train_is_refused_in_a_sentence():
    with pytest.raises(InputError, match="names pantograph 2, but the train has only 1"):
        evaluated_windows(settings(), Line(controlled=2))
    with pytest.raises(InputError, match=r"controlled.*by their numbers, 1 for the first"):
        settings(lines=[TRAIN | {"controlled": 0}])
    with pytest.raises(InputError, match="one for each of the 2 pantographs, not 3"):
        simulate(**TRAIN, mean_force=[100.0, 100.0, 100.0])
    with pytest.raises(InputError, match="one for each of the 2 controlled pantographs, not 3"):
        simulate(**TRAIN, controlled=[1, 2], policy=["pd"] * 3)
