"""Work without an end, or without a sense, is refused with what it would take; nothing is made for it."""

from __future__ import annotations

import time

import gymnasium
import numpy as np
import pytest

from panto_baselines.oracle.stored import OracleSettings
from panto_env import InputError, simulate
from panto_env.base.settings import parse
from panto_env.control import Task
from panto_env.control.length import LONGEST, Cost, gigabytes, in_words
from panto_env.control.settings import run_settings


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"speed_kmh": 0.001}, r"18,878,400,000 time steps .* of memory, and to compute it about \d+ days"),
        ({"speed_kmh": 1e-6}, r"GB, but this machine has .* about [\d,]+ years; take a shorter distance"),
        ({"speed_kmh": 1e-300}, "The speed must lie above 0"),
        ({"spacing": 1e300}, "spacing must be a number from 0.001 to 1,000 m"),
        ({"window": 10**9}, "window must be a whole number from 0 to 1,000"),
        ({"spans": 10**9}, "spans must be a whole number from 3 to 1000"),
        ({"distance": 10**400}, "distance must be a positive number"),
        ({"sensors": {"delay": 1e9}}, "delay' must be a number from 0 to 1 s"),
        ({"speed_kmh": 0.01, "run_in": 20.0}, "to compute it about"),
        ({"control_interval": 1e-300}, "control_interval must be a number from 0.0001"),
    ],
)
def test_a_run_without_an_end_is_refused_with_what_it_would_take(settings, message, monkeypatch):
    monkeypatch.setattr("panto_env.base.machine.memory", lambda: 16e9)
    with pytest.raises(InputError, match=message):
        simulate(**settings)


def test_an_environment_s_episode_may_take_no_longer_either():
    """It keeps no record, so that its memory does not end it."""
    with pytest.raises(
        InputError, match=r"time steps .* would take about \d+ days, but the maximum for a run is about 12"
    ):
        gymnasium.make_vec("panto_env:Pantograph-v0", num_envs=1, speed_kmh=1e-4)


def test_a_run_is_estimated_about_right():
    task = Task(run_settings({"distance": 240.0}))
    task.reset(0, np.random.default_rng(0))
    begun = time.process_time()
    task.run_passively()
    taken = time.process_time() - begun
    assert task.cost.steps == task.end(0)
    assert taken / 10 < task.cost.seconds < 10 * taken


def test_time_is_told_in_words():
    assert in_words(30) == "about 30 seconds"
    assert in_words(LONGEST) == "about 12 hours"
    assert in_words(1e9) == "about 32 years"
    assert in_words(1e300) == "about 3.2e+292 years"
    with pytest.raises(
        InputError, match="it would take about 2 days, but the maximum for a run is about 12 hours"
    ):
        Cost(1e9, 0.0, 2 * 86400.0).check("it")


def test_a_record_may_take_seven_tenths_of_the_memory(monkeypatch):
    monkeypatch.setattr("panto_env.base.machine.memory", lambda: 10e9)
    Cost(1e6, 6.9e9, 0.0).check("it")
    with pytest.raises(InputError, match=r"would take 7\.1 GB, but this machine has 10\.0 GB"):
        Cost(1e6, 7.1e9, 0.0).check("it")
    assert gigabytes(5e21) == "5.0e+12 GB"


def test_an_ended_episode_makes_no_further_step():
    task = Task(run_settings({"distance": 10.0}))
    task.reset(0, np.random.default_rng(0))
    while not task.step(np.zeros((1, 1))):
        pass
    with pytest.raises(InputError, match="lane 0 has ended or not begun; reset the lane first"):
        task.step(np.zeros((1, 1)))


def test_lanes_that_don_t_fit_into_memory_are_refused_before_they_are_made(monkeypatch):
    monkeypatch.setattr("panto_env.base.machine.memory", lambda: 16e9)
    with pytest.raises(InputError, match=r"1,000,000 lanes would take .* GB, but this machine has 16.0 GB"):
        gymnasium.make_vec("panto_env:Pantograph-v0", num_envs=10**6)


@pytest.mark.parametrize("lanes", [10**9, 10**400, 0, -1, "8", 1.5])
def test_a_number_of_lanes_that_is_none_is_refused(lanes):
    with pytest.raises(InputError, match="num_envs must be a whole number from 1 to"):
        gymnasium.make_vec("panto_env:PantographStiffness-v0", num_envs=lanes)


@pytest.mark.parametrize(
    "table",
    [{"hops": 10**6}, {"spans": [1, 10**400]}, {"hops": 10**400}, {"seeds": [-1]}, {"starts": [["zero"]]}],
)
def test_an_oracle_without_an_end_is_refused(table):
    with pytest.raises(InputError):
        parse(OracleSettings, table, "the oracle")


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"hyperparameters": {"net_arch": [1_000_000]}}, "net_arch"),
        ({"hyperparameters": {"net_arch": [8] * 1000}}, "net_arch"),
        ({"hyperparameters": {"n_epochs": 10**400}}, "n_epochs"),
        ({"total_steps": 10**12}, "total_steps"),
        ({"checkpoint_steps": 10**400}, "checkpoint_steps"),
        ({"lanes": 10**9}, "lanes"),
        ({"seed": -1}, "seed"),
        ({"cloning": {"steps": 10**12}}, "steps"),
    ],
)
def test_a_training_of_absurd_size_is_refused(change, key):
    parse_training = pytest.importorskip("panto_agents.settings").parse_training
    table = {"algorithm": "ppo", "total_steps": 1024, "checkpoint_steps": 512}
    table |= {"environment": {"id": "PantographStiffness-v0"}, "evaluation": {"interval_steps": 512}}
    with pytest.raises(InputError, match=key):
        parse_training(table | change, "the training")
