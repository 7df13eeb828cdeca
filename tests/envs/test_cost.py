"""info["cost"]: shares of a control step beyond limits, by hand from the record of the run."""

import gymnasium
import numpy as np
import pytest

from panto_env import InputError
from panto_env.catalog import load_catenary
from panto_env.control.reward import limits
from panto_env.envs import BARE
from panto_env.metrics.low_pass import low_pass

NAME = "panto_env:Pantograph-v0"
# Half the room is less than the usual uplift, and the actuator lifts the wire further but not to the stop.
LOW = load_catenary("en50318-2002").model_copy(update={"free_uplift": 0.13})
STRONG = BARE | {
    "distance": 250.0,
    "accuracy": "fast",
    "speed_kmh": 320.0,
    "catenary": LOW,
    "actuator": "ideal:force_limit=150",
}


def episode(**changes):
    """Costs of an episode under a swinging force, and its environment."""
    env = gymnasium.make(NAME, **STRONG | changes).unwrapped
    env.reset(seed=1)
    costs, ended, k = [], False, 0
    while not ended:
        action = np.array([np.sin(0.1 * k)], dtype=np.float32)
        *_, terminated, truncated, info = env.step(action)
        costs.append(info["cost"])
        ended, k = terminated or truncated, k + 1
    return np.array(costs), env


def by_hand(env, settled=0):
    """Shares of each control step beyond each limit, (control steps, 3), from the record."""
    run, steps = env.trajectory, env.task.length.control_steps
    beyond = np.stack(
        [
            run.contact_force <= 0,
            (run.uplift > 0.065).any(axis=1),
            low_pass(run.contact_force, run.time_step) > 350,
        ],
        axis=1,
    )
    shares = beyond.reshape(-1, steps, 3).mean(axis=1)
    shares[:settled] = 0
    return shares


def test_each_term_is_the_share_of_the_step_beyond_its_limit():
    costs, env = episode(cost={"contact_loss": 2.0, "uplift": 3.0, "max_force": 5.0})
    shares = by_hand(env)
    assert ((shares.mean(axis=0) > 0) & (shares.mean(axis=0) < 1)).all(), "the run does not show this"
    assert costs == pytest.approx(shares @ [2.0, 3.0, 5.0])


def test_limits_depend_on_power_supply_and_stop():
    """Under DC, 400 N above 200 km/h; with a stop, two thirds of the room instead of half."""
    line = LOW.model_copy(update={"system": "DC 3 kV", "uplift_stop": True})
    speeds = np.array([200.0, 320.0]) / 3.6
    for given, uplift, forces in ((LOW, 0.065, [300, 350]), (line, 0.26 / 3, [300, 400])):
        found = limits(given, speeds)
        assert found[0] == pytest.approx(uplift)
        assert found[1].tolist() == forces


def test_the_cost_is_their_sum_and_is_counted_after_settle():
    costs, env = episode(settle=1.0)
    first = int(env.task.episode.table[0, 7]) // env.task.length.control_steps
    shares = by_hand(env, settled=first)
    assert first > 0
    assert by_hand(env)[:first].any()
    assert costs == pytest.approx(shares.sum(axis=1))


def test_ending_early_costs_as_if_the_rest_were_without_contact():
    env = gymnasium.make(NAME, **STRONG | {"actuator": "ideal:force_limit=2000"}).unwrapped
    env.reset(seed=0)
    total, steps, terminated = 0.0, 0, False
    while not terminated:
        *_, terminated, truncated, info = env.step(np.array([-1.0], dtype=np.float32))
        assert not truncated
        total, steps = total + info["cost"], steps + 1
    left = env.task.length.most_control_steps - steps
    assert info["cost"] == pytest.approx(1 + left, abs=1.0)
    assert total > left


@pytest.mark.parametrize("cost", [{"uplift": -1}, {"upliftt": 1}, "much", {"max_force": float("nan")}])
def test_weights_that_make_no_sense_are_refused(cost):
    with pytest.raises(InputError, match="cost"):
        gymnasium.make(NAME, cost=cost)
