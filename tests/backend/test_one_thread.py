"""Environments, tasks and plants used by two threads at once, or beyond their end: refused, never a crash."""

import contextlib
import copy
import os
import pickle
import subprocess
import sys
import threading
import time

import gymnasium
import numpy as np
import pytest

from panto_env import InputError
from panto_env.backend import JIT
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.plant.plant import Plant
from panto_env.plant.train import Train


def in_the_way(refusal):
    return refusal.startswith("Another thread")


@pytest.mark.parametrize("lanes", [None, 16])
def test_an_environment_is_one_thread_s_at_a_time(lanes):
    """Four threads step as fast as they can; each goes on until another one was in its way."""
    env = made(lanes)
    env.reset(seed=0)
    action, told, refused, start = env.action_space.sample(), [], [], threading.Barrier(4)
    latest = time.monotonic() + 60.0

    def use():
        start.wait()
        done = 0
        while done < 300 or not (any(map(in_the_way, refused)) or time.monotonic() > latest):
            done += 1
            try:
                told.append(env.step(action)[0])
            except InputError as error:
                refused.append(str(error))
                if "has ended" in str(error):
                    with contextlib.suppress(InputError):  # another thread may be at it
                        env.reset(seed=0)

    threads = [threading.Thread(target=use) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.isfinite(seen).all() for seen in told)
    assert {text.split(";")[0] for text in refused} <= {
        "Another thread is using this environment, or was when this process was forked",
        "The episode has not begun or has ended",
    }
    assert any(map(in_the_way, refused))
    env.reset(seed=0)  # it goes on in order
    assert np.isfinite(env.step(action)[0]).all()


FORKED = """
import os, signal, threading, time, warnings
import gymnasium
warnings.simplefilter("ignore")
envs = gymnasium.make_vec("panto_env:Pantograph-v0", num_envs=64, accuracy="fast")
envs.reset(seed=0)
action = envs.action_space.sample()
stop = threading.Event()

def use():
    while not stop.is_set():
        envs.step(action)

thread = threading.Thread(target=use)
thread.start()
for k in range(40):
    time.sleep(0.003 * (k % 7))
    child = os.fork()
    if child == 0:
        signal.alarm(20)
        try:
            for _ in range(3):
                envs.step(action)
            print("stepped", flush=True)
        except BaseException as error:
            print(error, flush=True)
        os._exit(0)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
stop.set()
thread.join()
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
@pytest.mark.skipif(not JIT, reason="plain Python takes too long")
def test_forked_while_another_thread_steps_it_is_refused_or_steps():
    """It had waited for ever for a generator of random numbers that the thread had locked."""
    done = subprocess.run([sys.executable, "-c", FORKED], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    told, ends = done.stdout.splitlines()[::2], done.stdout.splitlines()[1::2]
    assert ends == ["0"] * 40
    refused = [line for line in told if line != "stepped"]
    assert refused
    assert all("or was when this process was forked; give each" in line for line in refused)


COPIES = {"pickle": lambda env: pickle.loads(pickle.dumps(env)), "deepcopy": copy.deepcopy}


def made(lanes):
    settings = {"catenary": "en50318-2002", "sensors": "realistic", "accuracy": "fast", "distance": 600.0}
    name = "panto_env:Pantograph-v0"
    if lanes is None:
        return gymnasium.make(name, disable_env_checker=True, **settings).unwrapped
    return gymnasium.make_vec(name, num_envs=lanes, **settings)


@pytest.mark.parametrize(("lanes", "way"), [(None, "pickle"), (8, "deepcopy")])
def test_a_copy_while_another_thread_steps_is_whole_or_refused(lanes, way):
    """Half of the copies had been made in the middle of a step, and went on as no environment does."""
    env = made(lanes)
    first, _ = env.reset(seed=0)
    action = np.zeros(env.action_space.shape)
    seen, twins, refused, stop = [first], [], [], threading.Event()

    def step():
        while not stop.is_set():
            with contextlib.suppress(InputError):  # a copy is being made
                observation, _, *ends, _ = env.step(action)
                seen.append(observation)
                if np.any(ends):
                    return
            time.sleep(0.003)

    thread = threading.Thread(target=step)
    thread.start()
    while thread.is_alive() and len(twins) < 10:
        try:
            twins.append(COPIES[way](env))
        except InputError as error:
            refused.append(str(error))
            time.sleep(0.001)
    stop.set()
    thread.join()
    assert len(twins) == 10
    assert all(map(in_the_way, refused))
    whole = {each.tobytes(): number for number, each in enumerate(seen)}
    later = [env.step(action)[0] for _ in range(3)]
    following = [*seen, *later]
    for twin in twins:
        answer = [twin.step(action)[0] for _ in range(3)]
        number = whole.get(answer[0].tobytes(), len(seen))
        for one, other in zip(answer, following[number:], strict=False):
            np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("lanes", [None, 2])
def test_nothing_is_read_of_an_environment_in_use(lanes):
    env = made(lanes)
    env.reset(seed=0)
    for read in (env.render, lambda: env.context if lanes is None else env.context(0)):
        assert env._in_use.begin(False)
        with pytest.raises(InputError, match="Another thread is using this environment"):
            read()
        env._in_use.end()
        read()


def test_an_environment_that_holds_itself_is_copied():
    env = made(None)
    env.reset(seed=0)
    env.itself, env.of_it = env, env.step
    for way in COPIES.values():
        twin = way(env)
        assert twin.itself is twin
        assert twin.of_it.__self__ is twin
        twin.step(np.zeros(1))


@pytest.fixture(params=[("en50318-2002", "en50318-2002"), ("periodic-stiffness", "three-mass")])
def task(request):
    line, pantograph = request.param
    return Task(run_settings({"catenary": line, "pantograph": pantograph, "distance": 60.0}), lanes=3)


def test_a_lane_is_not_stepped_before_its_episode_nor_beyond(task):
    action = np.zeros((3, 1))
    with pytest.raises(InputError, match="lane 0 has ended or not begun"):
        task.step(action)
    task.reset(np.arange(3), np.random.default_rng(0))
    task.run_passively()
    changing = task.plant.run.table, task.plant.actuators.table, task.episode.table, task.samples.rows
    before = [table.copy() for table in changing]
    with pytest.raises(InputError, match="lane 0 has ended"):
        task.step(action)
    with pytest.raises(InputError, match="lane 0 has ended"):
        task.coast(np.full(3, 1000), task.results)
    with pytest.raises(InputError, match="lane 1 has ended"):
        task.step(action, np.array([True, False, True]))
    for table, kept in zip(changing, before, strict=True):
        np.testing.assert_array_equal(table, kept)
    task.reset(1, np.random.default_rng(0))
    task.step(action, np.array([True, False, True]))


def test_the_kernel_makes_no_step_beyond_an_episode_s_end(task):
    """Whoever calls it."""
    task.reset(np.arange(3), np.random.default_rng(0))
    task.run_passively()
    kept = task.plant.run.table.copy()
    task._over[:] = False
    task._any_over = False
    for _ in range(10):
        task.step(np.zeros((3, 1)))
    np.testing.assert_array_equal(task.plant.run.table, kept)


def test_a_step_says_exactly_whether_an_episode_has_ended(task):
    task.reset(np.arange(3), np.random.default_rng(0))
    action = np.zeros((3, 1))
    *before, last = [task.step(action) for _ in range(task.length.most_control_steps)]
    assert last
    assert len(before) > 10
    assert not any(before)


def test_a_plant_runs_neither_beyond_its_line_nor_without_rows():
    plant = Plant(load_catenary("en50318-2002"), Train.of(load_pantograph("en50318-2002")), spans=10)
    plant.start(0, 80.0)
    with pytest.raises(InputError, match="rows for 99 steps, not for 100; make more rows"):
        plant.advance_passively(100, plant.samples(100))
    plant.advance_passively(99, plant.samples(100))
    with pytest.raises(InputError, match="beyond the line's end at"):
        plant.advance_passively(10**6, plant.samples(1))
