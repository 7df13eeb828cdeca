"""Preview of a pantograph behind another: it gains by what the one in front told, and by nothing else."""

import numpy as np
import pytest

from panto_baselines.policies.preview import FrontPreview
from panto_env import InputError, simulate

TRAIN = {
    "catenary": "re330", "pantographs": ["dsa380"] * 2, "distances": [100.0], "controlled": 2,
    "speed_kmh": 250.0,
    "line_condition": "as-built", "actuator": "realistic", "sensors": "realistic",
}  # fmt: skip


def behind(policy, seed, **settings):
    return simulate(policy=policy, seed=seed, **TRAIN | settings).train[1].summary()


@pytest.mark.slow
@pytest.mark.parametrize(("line", "better"), [("re330", 3), ("en50318-2002", 6)])
def test_what_the_one_in_front_measured_calms_the_one_behind_on_lines_not_seen(line, better):
    """On top of what repeats from span to span: on each seed, or, where that is nearly all, in their mean."""
    gains = []
    for seed in range(6):
        passive, alone = (behind(each, seed, catenary=line) for each in (None, FrontPreview(base="")))
        assert alone.std < 0.8 * passive.std
        assert alone.mean == pytest.approx(passive.mean, rel=0.015)
        both, learnt = (behind(each, seed, catenary=line) for each in (FrontPreview(), "repetitive"))
        gains.append(1 - both.std / learnt.std)
    assert np.mean(gains) > 0.005
    assert np.sum(np.array(gains) > 0) >= better


def test_a_pantograph_without_one_in_front_is_refused():
    with pytest.raises(InputError, match="front"):
        simulate(policy=FrontPreview(base=""), **TRAIN | {"controlled": 1})
