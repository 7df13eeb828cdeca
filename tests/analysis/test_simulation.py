"""What `simulate` tells while it runs, what it refuses, and how its pictures are saved."""

import inspect

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from panto_env import InputError, simulate
from panto_env.analysis import options as requirements
from panto_env.analysis.options import print_criteria
from panto_env.analysis.plots import save
from panto_env.control.settings import fields
from panto_env.metrics.compliance import Criterion

SHORT = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "distance": 40.0}


class Still:
    """Never acts."""

    def reset(self, context):
        self.actions = context.actions

    def act(self, observation):
        observation[:] = np.nan  # it is the policy's own
        return np.zeros(self.actions)


class Named(Still):
    name = "one of mine"


def test_a_seed_that_is_none_and_a_choice_that_is_neither():
    for seed in (-1, 1.5, 2.0, "1", None, (1,), np.float64(3)):
        with pytest.raises(InputError, match=r"^seed must be a whole number from 0 up, not "):
            simulate(**SHORT, seed=seed)
    for value in (1, 0, "yes", None):
        with pytest.raises(InputError, match=r"^record_droppers must be True or False, not "):
            simulate(**SHORT, record_droppers=value)


def test_shares_rise_to_one_and_the_task_is_watched_after_every_step():
    shares, times = [], []
    run = simulate(
        **SHORT, policy=Still(), progress=shares.append, watch=lambda task: times.append(task.plant)
    )
    assert len(shares) == len(times) == round(run.time[-1] / 0.01)
    np.testing.assert_allclose(shares, np.arange(1, len(shares) + 1) / len(shares))
    assert {id(each) for each in times} == {id(times[0])}
    watched = []
    simulate(**SHORT, watch=watched.append)
    assert len(watched) >= 1


def test_a_run_has_the_name_and_the_seed_it_was_given():
    for policy, name in ((None, "passive"), ("pd", "pd"), (Still(), "Still"), (Named(), "one of mine")):
        assert simulate(**SHORT, policy=policy, seed=np.int64(3)).policy == name
    for policy in (None, "pd"):
        assert simulate(**SHORT, policy=policy, seed=7).seed == 7
        assert simulate(**SHORT, policy=policy).seed == 0
    flexible = {"distance": 70.0, "accuracy": "fast"}
    assert simulate(**flexible).dropper_position.size > 0
    assert simulate(**flexible, record_droppers=False).dropper_position.size == 0


def test_the_signature_has_every_setting_once():
    names = list(inspect.signature(simulate).parameters)
    assert names[:4] == ["catenary", "pantograph", "speed_kmh", "policy"]
    assert set(fields()) <= set(names)
    assert len(names) == len(set(names))
    assert {"seed", "progress", "watch", "record_droppers", "trimmed_over"} <= set(names)
    assert "settings" not in names


def test_a_picture_is_saved_at_120_dots_per_inch(tmp_path):
    path = tmp_path / "picture.PNG"
    save(Figure(figsize=(3, 2)), path)
    with Image.open(path) as picture:
        assert picture.size == (360, 240)


@pytest.mark.parametrize(
    ("text", "formula"),
    [("$a_1$", True), ("a_1", True), ("5 $ and more", False), ("$\\bad$", False), ("fine\n$\\bad$", False)],
)
def test_names_that_are_no_formula_are_drawn_as_they_are(tmp_path, text, formula):
    figure = Figure()
    axes = figure.subplots()
    axes.set_title(text)
    save(figure, tmp_path / "picture.svg")
    assert axes.title.get_parse_math() == formula
    with pytest.raises(InputError, match="must end in one of"):
        save(figure, tmp_path / "picture.doc")


def test_requirements_are_printed_with_their_remarks_on_one_line_each(capsys, monkeypatch):
    monkeypatch.setattr(requirements.console, "width", 40, raising=False)
    long = "a note that is longer than a narrow terminal is wide, and stays on its line"
    print_criteria(
        [Criterion("a", "one", "N", 2.0, None, 3.0, "it", note=long), Criterion("b", "two", "m", 0.25)], "All"
    )
    printed = capsys.readouterr().out.splitlines()
    assert printed[-2:] == [f"one: {long}.", "two (m): 0.250"]
    assert "All" in "".join(printed)
    print_criteria([Criterion("b", "two", "m", 0.25)], "None")
    assert capsys.readouterr().out == "two (m): 0.250\n"


def test_a_policy_that_does_not_act_changes_nothing():
    passive, still = simulate(**SHORT), simulate(**SHORT, policy=Still())
    np.testing.assert_array_equal(passive.contact_force, still.contact_force)
