"""How often a film has a frame, and which sources are saved runs; of made-up passes."""

from types import SimpleNamespace

import pytest

pytest.importorskip("cv2", reason="the extra 'render' is not installed")

import numpy as np

from panto_env import InputError, simulate
from panto_env.plant.alignment import Alignment
from panto_env.render.film import FASTEST, excerpt, policy_pass, saved_passes

STIFFNESS = {
    "catenary": "periodic-stiffness",
    "pantograph": "three-mass",
    "speed_kmh": 200.0,
    "distance": 100.0,
}
ALIGNMENT = Alignment.equal(50.0, 4)
RUN = SimpleNamespace(
    alignment=ALIGNMENT,
    time=np.linspace(0.0, 4.0, 401),
    distance=200.0,
    time_at=lambda position: position / 50.0,
)


def passed(interval):
    return SimpleNamespace(run=SimpleNamespace(controlled=RUN), control_interval=interval)


@pytest.mark.parametrize(
    ("interval", "slow_motion", "every"),
    [
        (0.04, 1.0, 1),  # 25 frames per second, exactly
        (0.0399, 1.0, 2),
        (0.02, 1.0, 2),
        (0.0199, 1.0, 3),
        (0.01, 1.0, 4),
        (0.01, 4.0, 1),
        (0.01, 3.9, 2),
        (0.01, 0.5, 8),
        (1.0, 1.0, 1),
    ],
)
def test_a_frame_comes_at_most_25_times_a_second_and_as_often_as_it_may(interval, slow_motion, every):
    assert FASTEST == 25.0
    what = excerpt(passed(interval), 2, 1.5, slow_motion)
    assert what.every == every
    assert what.rate == pytest.approx(1 / (every * interval * slow_motion))
    assert what.rate < 25.0 + 1e-9
    assert (what.begin, what.end) == (1.0, 2.5)


def test_a_film_ends_with_its_run_and_begins_within_it():
    assert excerpt(passed(0.01), 4, 10.0, 1.0).end == 4.0
    assert excerpt(passed(0.01), 1, 10.0, 1.0).begin == 0.0
    with pytest.raises(
        InputError, match=r"^The run ends at 200 m, before span 5; begin in an earlier one\.$"
    ):
        excerpt(passed(0.01), 5, 1.0, 1.0)


def test_each_source_that_is_a_file_is_a_saved_pass(tmp_path):
    files = [tmp_path / "a.parquet", tmp_path / "b.PARQUET"]
    runs = [simulate(**STIFFNESS, policy=policy, seed=3) for policy in ("p", None)]
    runs[0].save(files[0])
    runs[1].save(tmp_path / "b.parquet")
    (tmp_path / "b.parquet").rename(files[1])
    found = saved_passes(["pd", str(files[0]), "agent.safetensors", str(files[1])])
    assert list(found) == [str(files[0]), str(files[1])]
    assert [(each.title, each.policy, each.seed, each.file) for each in found.values()] == [
        ("p (a.parquet)", "p", 3, str(files[0])),
        ("passive (b.PARQUET)", "passive", 3, str(files[1])),
    ]
    for each, run in zip(found.values(), runs, strict=True):
        np.testing.assert_array_equal(each.run.contact_force, run.contact_force)
        assert each.control_interval == 0.01
    assert saved_passes([]) == {}


def test_a_pass_of_a_policy_has_the_run_that_simulate_makes_and_no_file():
    made = policy_pass("pd", STIFFNESS | {"control_interval": 0.02}, 4)
    assert (made.title, made.policy, made.seed, made.file, made.control_interval) == ("pd", "pd", 4, "", 0.02)
    expected = simulate(**STIFFNESS, control_interval=0.02, policy="pd", seed=4)
    np.testing.assert_array_equal(made.run.contact_force, expected.contact_force)
    made.check()  # nothing to repeat
