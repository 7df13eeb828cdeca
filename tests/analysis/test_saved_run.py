"""A saved run is made anew bit for bit, or refused: films need more of it than its file holds."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from panto_env import InputError, simulate
from panto_env.analysis.simulation import TOLERANCE, check_made_anew, load_with_settings
from panto_env.catalog.loader import text_of
from panto_env.cli import make_app
from panto_env.plant.alignment import Alignment

STIFFNESS = {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 200.0}
CASES = {
    "flexible": {"policy": "pd", "speed_kmh": (250.0, 300.0), "seed": 4},
    "worn": {"line_condition": "as-built", "speed_drift": 2.0, "seed": 7},
    "own grid": {"time_step": 5e-4, "spacing": 0.25, "window": 0, "spans": 12, "distance": 300.0},
    "fast, trimmed": {"accuracy": "fast", "policy": "pd", "mean_force": 130.0},
    "stiffness": {"policy": "pd", "sensors": "realistic", "pantograph_scatter": 0.1} | STIFFNESS,
    "rig": {"catenary": "rig-flexible", "policy": "pd", "distance": 600.0},
    "motor": {"actuator": "head-motor", "known_pantograph": "dsa380", "estimator": "displacements"},
}


KINDS = ("rig", "motor")
"""Kinds of lines and actuators, which are compiled apart."""


def saved(path, **settings):
    run = simulate(**settings)
    run.save(path)
    return run


@pytest.mark.longer
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in KINDS)) for name in CASES]
)
def test_a_run_is_made_anew_from_its_file_bit_for_bit(name, tmp_path):
    path, given, mine = tmp_path / "run.parquet", dict(CASES[name]), tmp_path / "mine.toml"
    if name == "stiffness":  # on a line of one's own, which the run's file has by value
        mine.write_text(text_of("periodic-stiffness"))
        given["catenary"] = str(mine)
    run = saved(path, **given)
    mine.unlink(missing_ok=True)
    loaded, settings = load_with_settings(path)
    anew = simulate(policy=loaded.policy, seed=loaded.seed, **settings)
    np.testing.assert_array_equal(anew.contact_force, run.contact_force)
    np.testing.assert_array_equal(anew.head, run.head)
    assert anew.settings == run.settings
    assert anew.design == run.design


@pytest.mark.filterwarnings("error")
def test_an_agent_counts_its_readings_from_the_same_passive_runs(tmp_path):
    pytest.importorskip("stable_baselines3", reason="the extra 'agents' is not installed")
    path = tmp_path / "run.parquet"
    run = saved(path, policy="agent-known-line", actuator="realistic", sensors="realistic")
    _, settings = load_with_settings(path)
    anew = simulate(policy="agent-known-line", **settings)
    np.testing.assert_array_equal(anew.contact_force, run.contact_force)


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A run, its settings and its file."""
    path = tmp_path_factory.mktemp("runs") / "run.parquet"
    saved(path, policy="pd", **STIFFNESS)
    return *load_with_settings(path), path


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"policy": "p"}, "with its settings and policy 'p' it comes out differently now"),
        ({"policy": "pd:gain=0.7"}, "differs by"),
        (
            {"policy": "runs/none/model.safetensors"},
            "The model file runs/none/model.safetensors does not exist",
        ),
        ({"policy": "OfMine"}, "Unknown policy 'OfMine'"),
        ({"time": np.zeros(5), "position": np.zeros(5)}, "instead of"),
    ],
)
def test_a_run_that_comes_out_another_is_refused(kept, change, words):
    run, settings, path = kept
    with pytest.raises(InputError) as caught:
        check_made_anew(replace(run, **change), settings, path)
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"The run of {path} cannot be repeated: ")


def test_the_force_may_differ_by_rounding_alone(kept):
    run, settings, path = kept
    check_made_anew(replace(run, contact_force=run.contact_force + 0.5 * TOLERANCE), settings, path)
    with pytest.raises(InputError, match=r"differs by 0\.2 N rms"):
        check_made_anew(replace(run, contact_force=run.contact_force + 2 * TOLERANCE), settings, path)


@pytest.mark.parametrize("what", ["speed", "spans", "control_interval"])
def test_passes_above_each_other_differ_by_rounding_alone(kept, what):
    """By a millionth, a run of 1200 m is 1 mm out of step; a tenth would be two spans."""
    pytest.importorskip("cv2", reason="the extra 'render' is not installed")
    from panto_env.render.film import Filmed, check_together

    run, settings, _ = kept
    first = Filmed("one", run.policy, settings, run.seed, run)

    def beside(factor):
        if what == "control_interval":
            return first._replace(settings=settings | {what: factor * first.control_interval})
        if what == "spans":
            line = Alignment.equal(factor * run.alignment.mean_length, run.alignment.spans)
            return first._replace(run=replace(run, alignment=line))
        return first._replace(run=replace(run, speed=factor * run.speed, position=factor * run.position))

    if what != "spans":  # these are the line's own: there is no rounding
        check_together([first, beside(1 + 1e-12)])
    with pytest.raises(InputError, match=f"must have the same {what.split('_')[0]}"):
        check_together([first, beside(1 + 1e-6)])


@pytest.mark.parametrize(
    "change", [{"design": {}}, {"settings": {"version": "0.1", "control_interval": -1.0}}]
)
def test_a_file_of_another_version_is_refused(kept, tmp_path, change):
    path = tmp_path / "old.parquet"
    replace(kept[0], **change).save(path)
    with pytest.raises(InputError, match="was written by another version"):
        load_with_settings(path)


def film(*arguments):
    result = CliRunner().invoke(make_app(), ["film", *map(str, arguments), "--seconds", "0.2"])
    return str(result.exception) if isinstance(result.exception, InputError) else result.output


@pytest.mark.longer
def test_a_saved_run_is_filmed_beside_a_policy_under_its_settings(kept, tmp_path):
    pytest.importorskip("cv2", reason="the extra 'render' is not installed")
    from panto_env.render.film import check_together, figures_in_words, policy_pass, saved_passes

    output = tmp_path / "film.mp4"
    (first,) = saved_passes([str(kept[2])]).values()
    second = policy_pass("passive", first.settings, first.seed)
    check_together([first, second])
    assert first.title == "pd (run.parquet)"
    change = figures_in_words(second, first)["σ relative to pd (run.parquet)"]
    ratio = second.run.summary().std / first.run.summary().std
    assert float(change.removesuffix(" %")) == pytest.approx(100 * (ratio - 1), abs=0.06)
    told = film(kept[2], "passive", "--output", output, "--size", 320, 320)
    assert "25 frames per second" in told
    assert output.stat().st_size > 1000
    assert "25 frames per second" in film(kept[2], kept[2], "passive", "--output", output)


@pytest.mark.longer
def test_what_cannot_stand_above_each_other_is_refused(kept, tmp_path):
    pytest.importorskip("cv2", reason="the extra 'render' is not installed")
    output, run = tmp_path / "film.mp4", kept[2]
    quick, finer = tmp_path / "quick.parquet", tmp_path / "finer.parquet"
    saved(quick, **STIFFNESS | {"speed_kmh": 250.0})
    saved(finer, **STIFFNESS | {"control_interval": 0.02})
    told = film(run, quick, "--output", output)
    assert (
        "must have the same speed (km/h), but pd (run.parquet) has 200 and passive (quick.parquet) 250"
        in told
    )
    assert "the same control_interval (s)" in film(run, finer, "--output", output)
    told = film(run, "--output", output, "--speed", 250, "--line-spans", 30, "--seed", 1)
    assert f"takes all settings from {run}; leave out --speed, --line-spans, --seed" in told
    assert "nowhere.parquet does not exist" in film(tmp_path / "nowhere.parquet", "--output", output)
    replace(kept[0], policy="p").save(quick)
    assert "cannot be repeated" in film(quick, "--output", output)
    assert not output.exists()
