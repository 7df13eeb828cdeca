"""Gains and oracles are found by the values of a line and a pantograph: files of one name may hold others."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from panto_baselines.oracle.stored import stored_actions, stored_cells
from panto_baselines.policies.lanes_law import load_gains
from panto_baselines.tuning.command import check_gain_file, make_tuning, store
from panto_baselines.tuning.tune import Tuned
from panto_env import InputError
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.catalog.loader import text_of
from panto_env.control import Task
from panto_env.control.settings import run_settings
from panto_env.policies import find_policy

SHINKANSEN = {"catenary": "shinkansen-simple", "pantograph": "identified-2dof", "speed_kmh": 375.0}
LOADERS = {"catenary": load_catenary, "pantograph": load_pantograph}
REAL = {"actuator": "realistic", "sensors": "realistic"}


@cache
def usual():
    """The context of an episode."""
    task = Task(run_settings(SHINKANSEN | REAL | {"accuracy": "fast"}))
    task.reset(0, np.random.default_rng(0))
    return task.context(0)


def gains_of(policy, **given):
    """Gains of a policy, which may know another line or pantograph."""
    loaded = {key: LOADERS[key](value) for key, value in given.items()}
    law = find_policy(policy)
    law.reset(replace(usual(), **loaded))
    return law.gains


@pytest.fixture
def line(tmp_path):
    """A line of the catalogue in a file of another name."""
    path = tmp_path / "mine.toml"
    path.write_text(text_of("shinkansen-simple"))
    return path


@pytest.fixture
def other(tmp_path):
    """Another line and another pantograph, in files of names of the catalogue."""
    (tmp_path / "shinkansen-simple.toml").write_text(text_of("re330"))
    (tmp_path / "identified-2dof.toml").write_text(text_of("dsa380"))
    return tmp_path


def test_gains_are_of_the_line_and_the_pantograph_not_of_their_names(line, other):
    assert list(gains_of("tuned-pd", catenary=str(line))) == list(gains_of("tuned-pd"))
    for kind in ("catenary", "pantograph"):
        with pytest.raises(InputError, match="only for others of these names with other values"):
            gains_of("tuned-pd", **{kind: str(other / f"{SHINKANSEN[kind]}.toml")})


def test_a_changed_value_is_another_line():
    line = load_catenary("shinkansen-simple")
    wire = line.contact_wire.model_copy(update={"tension": 1.1 * line.contact_wire.tension})  # type: ignore
    with pytest.raises(InputError, match="other values"):
        gains_of("tuned-pd", catenary=line.model_copy(update={"contact_wire": wire}))
    words = {"description": "mine", "name": "mine", "sources": {}}
    assert len(gains_of("tuned-pd", catenary=line.model_copy(update=words)))


def tuned(path, catenary, first):
    settings = run_settings(SHINKANSEN | REAL | {"catenary": catenary})
    found = [Tuned(375.0, (first, 10.0), (1.0, 0.5), 40, -0.1, 0.001)]
    store(path, "skyhook", make_tuning(settings, ["frame", "head"], found, [2000], "panto tune"))


def test_what_is_tuned_for_a_file_is_found_by_its_values(other, line):
    gains, theirs = other / "gains.toml", str(other / "shinkansen-simple.toml")
    tuned(gains, "shinkansen-simple", 1.0)
    tuned(gains, theirs, 2.0)
    first, second = load_gains(gains).tunings  # of one name, and yet two
    assert first.catenary_sha256 is None
    assert second.catenary_sha256 is not None
    policy = f"skyhook:gains='{gains}'"
    assert gains_of(policy)[0] == 1.0
    assert gains_of(policy, catenary=str(line))[0] == 1.0
    assert gains_of(policy, catenary=theirs)[0] == 2.0
    moved = other / "moved.toml"
    moved.write_text(Path(theirs).read_text())
    assert gains_of(policy, catenary=str(moved))[0] == 2.0
    Path(theirs).write_text(text_of("re250"))  # the file is edited: it is another line
    with pytest.raises(InputError, match="other values"):
        gains_of(policy, catenary=theirs)
    tuned(gains, str(moved), 3.0)
    # It takes the place of the one for the same values.
    assert [each.gains[0][0] for each in load_gains(gains).tunings] == [1.0, 3.0]
    for known in ("shinkansen-simple", str(line), str(moved)):
        settings = run_settings(SHINKANSEN | REAL | {"catenary": known})
        with pytest.raises(InputError, match="already holds gains"):
            check_gain_file(gains, "skyhook", settings, force=False)
    check_gain_file(gains, "skyhook", run_settings(SHINKANSEN | REAL | {"catenary": theirs}), force=False)


def test_gains_without_values_of_a_file_that_is_not_there_are_nobody_s(tmp_path, line):
    """As files of gains were written before, by names alone."""
    gains = tmp_path / "gains.toml"
    tuned(gains, str(line), 1.0)
    old = "\n".join(each for each in gains.read_text().splitlines() if "_sha256" not in each)
    gains.write_text(old.replace('"shinkansen-simple"', '"mine"'))
    with pytest.raises(InputError, match="has no gains for"):
        gains_of(f"skyhook:gains='{gains}'", catenary=str(line))


def test_the_tape_of_an_oracle_is_of_the_line_not_of_its_name(tmp_path):
    one = next(each for each in stored_cells() if each["catenary"] == "en50318-2002")
    given = {"speed_kmh": one["speed_kmh"], "actuator": one["actuator"]}
    named = given | {"catenary": one["catenary"], "pantograph": one["pantograph"]}
    actions = stored_actions(named)
    assert actions is not None
    (tmp_path / "mine.toml").write_text(text_of(one["catenary"]))
    np.testing.assert_array_equal(stored_actions(named | {"catenary": str(tmp_path / "mine.toml")}), actions)
    same_name = tmp_path / f"{one['catenary']}.toml"
    same_name.write_text(text_of("re330" if one["catenary"] != "re330" else "re250"))
    assert stored_actions(named | {"catenary": str(same_name)}) is None
    other = load_pantograph("dsa380").model_copy(update={"name": one["pantograph"]})
    assert stored_actions(named | {"pantograph": other}) is None
