"""The benchmark, the oracle and sweeps on lines drawn from a family or a section."""

import numpy as np
import pytest

from panto_baselines.benchmark.run import run
from panto_baselines.benchmark.settings import BenchmarkSettings
from panto_baselines.oracle.problem import Problem
from panto_env import InputError, simulate
from panto_env.analysis.sweep import sweep
from panto_env.metrics.low_pass import low_pass


@pytest.mark.parametrize(
    ("source", "speeds_kmh", "spans"),
    [
        ("family:high-speed", (260.0, 350.0), (10, 19)),
        ("section:main-line", (160.0,), (10, 28)),  # the shortest has 36, and its end is felt in 8 of them
    ],
)
def test_a_family_or_a_section_is_a_line_of_a_benchmark(source, speeds_kmh, spans):
    """Policies meet the same line under a seed, at speeds for it, over spans that all runs cover."""
    line = {"catenary": source, "speeds_kmh": speeds_kmh}
    settings = BenchmarkSettings(lines=(line,), seeds=(3,), policies=("pd",))
    found = run(settings, workers=1)
    assert found.spans == (spans,)
    for row in found.rows:
        policy = None if row.policy == "passive" else row.policy
        alone = simulate(
            source,
            speed_kmh=row.speed_kmh,
            seed=3,
            policy=policy,
            line_condition="smooth",
            record_droppers=False,
        )
        assert row.figures.std == alone.summary(spans).std
        assert row.catenary == source


@pytest.mark.parametrize("source", ["family:high-speed", "section:fast-line"])
def test_an_oracle_is_one_of_the_drawn_line(source):
    given = {"catenary": source, "speed_kmh": 300.0, "distance": 260.0}
    problem = Problem(given, seed=4, spans=(3, 3))
    line = simulate(**given, seed=4, record_droppers=False).design["catenary"]
    assert problem.settings.line.model_dump(mode="json") == line
    rest = np.zeros((1, problem.count, problem.places))
    force = low_pass(problem.passive.contact_force, problem.passive.time_step)[problem.passive.inside((3, 3))]
    np.testing.assert_allclose(problem.forces(rest)[0], force, atol=1e-6)


@pytest.mark.parametrize("source", ["family:high-speed", "section:fast-line"])
def test_a_sweep_wants_one_line(source):
    with pytest.raises(InputError, match="One line is needed here"):
        sweep({"speed_kmh": [250.0, 300.0]}, catenary=source)
