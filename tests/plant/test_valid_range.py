"""A run that leaves the plant's valid range ends there, under a policy or none, and says so."""

import json

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.analysis.sweep import sweep
from panto_env.backend import kernel
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.catalog.loader import FOLDERS
from panto_env.plant.catenary import CATENARIES
from panto_env.plant.catenary.flexible.arrays import CONTACT, MESSENGER
from panto_env.plant.catenary.flexible.wires import places
from panto_env.plant.catenary.protocol import ending_by_wire
from panto_env.plant.line_condition import DrawnLine, LineCondition
from panto_env.plant.numerics import Numerics, Runs
from panto_env.plant.state import FREE_UPLIFT, Ending

from ..command import panto


def pressed(force):
    """The reference pantograph under another static force (N)."""
    return load_pantograph("en50318-2002").model_copy(update={"static_force": force})


def with_room(uplift, line="en50318-2002"):
    return load_catenary(line).model_copy(update={"free_uplift": uplift})


def test_a_passive_run_ends_where_one_under_a_policy_does():
    alone, driven = (simulate(pantograph=pressed(600.0), policy=policy) for policy in (None, "passive"))
    assert alone.terminated
    np.testing.assert_array_equal(alone.contact_force, driven.contact_force)
    assert alone.ending == driven.ending
    assert np.abs(alone.head).max() < 0.4
    assert f"at {alone.position[-1] + alone.stride / 2:.1f} m (span 1, " in alone.ending
    assert alone.ending.endswith("left the range of ±300 mm about the contact wire's height at the supports.")


def test_contact_lost_for_long_ends_a_passive_run():
    run = simulate(pantograph=pressed(1e-3))
    assert run.terminated
    assert "contact was lost for 0.5 s" in run.ending
    assert (run.contact_force[-round(0.5 / run.time_step) :] == 0).all()


@pytest.mark.parametrize(
    ("line", "pantograph"), [("en50318-2002", "en50318-2002"), ("ohl-three-span", "own-two-mass")]
)
def test_the_steady_arm_s_stop_ends_a_run(line, pantograph):
    free = simulate(line, pantograph, distance=300.0)
    assert not free.terminated
    room = 0.7 * free.uplift.max()
    run = simulate(with_room(room, line), pantograph, distance=300.0)
    assert "all the room that it has there" in run.ending
    assert f"{1e3 * room:.0f} mm" in run.ending
    beyond = np.flatnonzero((free.uplift > room).any(axis=1))[0]
    assert 0 <= len(run.time) - 1 - beyond <= round(0.01 / run.time_step)


def test_a_line_that_does_not_say_has_the_usual_room():
    assert load_catenary("re250").free_uplift == FREE_UPLIFT == 0.24
    assert simulate(pantograph=pressed(400.0)).terminated


@kernel
def _ask(line, wire, answer):
    answer[0] = ending_by_wire(line, wire, 0)


@pytest.mark.slow
def test_wires_that_touch_at_a_dropper_end_a_run():
    """Mid-span the dropper is 0.741 m long: the messenger may sink by so much, and no more."""
    data = load_catenary("benchmark-2015")
    given = {"numerics": Numerics(window=5), "runs": Runs()}
    model = CATENARIES["flexible"].model(data, lanes=1, collectors=1, spans=10, **given)
    model.settle(0, DrawnLine(LineCondition()), 0.0)
    line, wire, answer = model.line, model.wire, np.zeros(1, dtype=np.int64)
    wire.increment[:] = 0.01  # m in a step: 4 m/s
    middle = places(round(2.5 * data.span_length / line.spacing) + np.arange(-3, 4), line.rows)
    for wires, moved, expected in (
        ([MESSENGER], -0.73, Ending.NONE),
        ([MESSENGER], -0.75, Ending.WIRES),
        ([CONTACT], 0.75, Ending.WIRES),
        ([CONTACT], -0.75, Ending.NONE),
        ([CONTACT, MESSENGER], 0.75, Ending.NONE),  # together
    ):
        wire.displacement[:] = 0.0
        for each in wires:
            wire.displacement[0, each][middle] = moved
        _ask(line, wire, answer)
        assert answer[0] == expected, (wires, moved)
    wire.increment[0, MESSENGER][middle] = -0.7  # from step to step: no wire does so
    wire.displacement[0, MESSENGER][middle] = -0.75
    _ask(line, wire, answer)
    assert answer[0] == Ending.DIVERGED


def test_a_run_that_ended_early_has_no_figures_but_those_of_spans_before():
    """Without the droppers beside support 5 the wire rises there by half as much again."""
    condition = {"broken_droppers": [(5, 8), (5, 9), (6, 1), (6, 2)]}
    lines = "en50318-2002", with_room(0.1)
    whole, run = (simulate(line, line_condition=condition, distance=420.0) for line in lines)
    with pytest.raises(InputError, match=r"ended early at .* \(span [56], .* all the room") as caught:
        run.summary()
    assert "\n" not in str(caught.value)
    assert run.summary((2, 4)) == whole.summary((2, 4))
    with pytest.raises(InputError, match="The run ended early"):
        run.summary((2, 6))


def test_a_sweep_says_where_and_why_a_run_ended():
    good, bad = sweep({"pantograph.static_force": [120.0, 600.0]})
    assert (good["terminated"], good["ending"]) == (False, "")
    assert good["std"] > 0
    assert bad["terminated"]
    assert "head left the range" in bad["ending"]
    assert np.isnan([bad[name] for name in ("mean", "std", "max", "min", "contact_loss")]).all()


def test_the_command_prints_one_sentence_and_no_figures(tmp_path):
    text = (FOLDERS["pantograph"] / "en50318-2002.toml").read_text().replace("value = 120.0", "value = 700.0")
    mine = tmp_path / "heavy.toml"
    mine.write_text(text)
    table, machine = (panto("simulate", "--pantograph", mine, *more) for more in ([], ["--json"]))
    assert (table.returncode, machine.returncode) == (1, 1)
    assert table.stdout.startswith("The run ended early at ")
    assert len(table.stdout.splitlines()) == 1
    told = json.loads(machine.stdout)
    assert told["terminated"]
    assert told["figures"] is None
    assert told["ending"] in table.stdout
