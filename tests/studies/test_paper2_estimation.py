"""Ways to estimate the force, noise and parameters; statements and tables are held in ``test_paper2``."""

import numpy as np
import pytest

from panto_env import simulate
from panto_env.analysis.plots import save
from panto_env.estimation.motion import measure
from panto_env.studies.paper2 import estimation
from panto_env.studies.paper2.estimation import METHODS, OBSERVATIONS

BOTH, ONE = OBSERVATIONS


@pytest.fixture(scope="module")
def trajectory():
    """The part of a pass that figures show."""
    given = {"time_step": estimation.TIME_STEP, "record_droppers": False, "distance": 500.0}
    return simulate(estimation.CATENARY, estimation.PANTOGRAPH, 250.0, **given)


@pytest.mark.slow
def test_the_ways_rank_as_told(monkeypatch):
    """Errors at all frequencies, at equal noise: beliefs about the force pay, none at all costs most."""
    monkeypatch.setattr(estimation, "SEEDS", 1)
    at_250 = estimation.cases((250.0,))
    assert all(each.agrees for each in estimation.comparisons(at_250))
    errors = {(case.observation, case.method): case.scores[-1].whole_rms for case in at_250}
    for observation in OBSERVATIONS:
        by_method = {method: errors[observation, method] for method in METHODS}
        assert min(by_method, key=by_method.get) == "smoother, 100 ms"
        assert by_method["filter, shaped"] < by_method["filter, random-walk"]
        assert by_method["filter, periodic"] < by_method["filter, random-walk"]
        assert by_method["filter, random-walk"] < by_method["inertia-corrected"]
    assert errors[BOTH, "unknown input"] < 1.1 * errors[BOTH, "inertia-corrected"]
    assert errors[ONE, "unknown input"] > 2 * errors[ONE, "inertia-corrected"]


@pytest.mark.slow
def test_more_noise_is_a_later_estimate(trajectory, monkeypatch):
    monkeypatch.setattr(estimation, "NOISES", (1e-5, 1e-4))
    scores = estimation.over_noise(trajectory)
    for observation in OBSERVATIONS:
        assert scores[observation, 1e-4].delay > 1.8 * scores[observation, 1e-5].delay


@pytest.mark.slow
def test_a_pass_tells_the_frame_but_not_head_nor_scale():
    told = estimation.parameter_information(estimation.run(250.0))
    true = {"masses.2": 13.0, "stiffnesses.1": 7000.0, "dampings.2": 100.0}
    found = dict(zip(told.found.names, told.found.values, strict=True))
    for name, value in true.items():
        assert found[name] == pytest.approx(value, rel=0.005)
    assert told.bounds["masses.1"] > 5 * told.bounds["masses.2"]
    assert told.scale > 0.5


@pytest.mark.slow
def test_figures_are_drawn(trajectory, tmp_path):
    motion, known = measure(trajectory, seed=0), estimation.known_pantograph(0)
    forces = {each: METHODS["filter, random-walk"](motion, known, each) for each in OBSERVATIONS}
    for number, observation in ((11, BOTH), (12, ONE)):
        figure = estimation.figure_11_12(motion, forces[observation], observation)
        assert f"as Fig. {number} of paper 2" in figure.get_suptitle()
        save(figure, tmp_path / f"{number}.png")
    figure = estimation.delay_plot(motion, forces)
    late = {line.get_label(): np.nanmean(line.get_ydata()) for line in figure.axes[0].lines[:2]}
    assert late[ONE] > late[BOTH] > 0
    save(figure, tmp_path / "delay.png")
