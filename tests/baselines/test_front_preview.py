"""Preview of a pantograph behind another: it gains by what the one in front told, and by nothing else."""

import pytest

from panto_baselines.policies.front_preview import FrontPreview
from panto_env import InputError, simulate

TRAIN = {
    "catenary": "re330", "pantographs": ["dsa380"] * 2, "distances": [100.0], "controlled": 2,
    "speed_kmh": 250.0,
    "line_condition": "as-built", "actuator": "realistic", "sensors": "realistic",
}  # fmt: skip


def behind(policy, seed):
    return simulate(policy=policy, seed=seed, **TRAIN).train[1].summary()


@pytest.mark.slow
def test_what_the_one_in_front_measured_calms_the_one_behind_on_lines_not_seen():
    for seed in (0, 1):
        passive, alone = behind(None, seed), behind(FrontPreview(base=""), seed)
        assert alone.std < 0.8 * passive.std
        assert alone.mean == pytest.approx(passive.mean, rel=0.015)
        assert behind(FrontPreview(), seed).std < behind("repetitive", seed).std


def test_a_pantograph_without_one_in_front_is_refused():
    with pytest.raises(InputError, match="front"):
        simulate(policy=FrontPreview(base=""), **TRAIN | {"controlled": 1})
