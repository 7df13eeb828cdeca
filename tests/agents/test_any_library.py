"""A policy that any library has trained takes part by a file of ten lines, which docs/policies.md shows."""

import pickle
from pathlib import Path

import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
from stable_baselines3 import TD3
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from panto_env import simulate
from panto_env.policies import find_policy, wishes

FILE = Path(__file__).parents[1] / "extensions" / "of_td3.py"
NORMALISED = (
    FILE.read_text()
    .replace("from pathlib", "import pickle\nfrom pathlib")
    .replace(
        "        self.model",
        '        self.seen = pickle.load(open(Path(__file__).parent / "seen.pkl", "rb"))\n        self.model',
    )
    .replace("predict(observation", "predict(self.seen.normalize_obs(observation)")
)


def make():
    return gymnasium.make("panto_env:Pantograph-v0", distance=120.0, accuracy="fast", settle=0.0)


@pytest.mark.parametrize("text", [FILE.read_text(), NORMALISED], ids=["td3", "normalised"])
def test_the_file_acts_as_the_model_does(text, tmp_path):
    lanes = VecNormalize(DummyVecEnv([make])) if text is NORMALISED else DummyVecEnv([make])
    model = TD3("MlpPolicy", lanes, learning_starts=20, batch_size=8, seed=0, device="cpu").learn(60)
    model.save(tmp_path / "td3.zip")
    (tmp_path / "policy.py").write_text(text)
    if text is NORMALISED:
        lanes.training = False
        lanes.save(str(tmp_path / "seen.pkl"))
        assert isinstance(pickle.loads((tmp_path / "seen.pkl").read_bytes()), VecNormalize)
    policy = find_policy(f"{tmp_path / 'policy.py'}:Mine")
    assert wishes(policy) == {"observation": "centred", "history": 0, "washout": 1.0}
    lanes.seed(5)
    observation, twin = lanes.reset(), make().unwrapped
    seen, _ = twin.reset(seed=5)
    policy.reset(twin.context)
    for _ in range(10):
        action = model.predict(observation, deterministic=True)[0]
        np.testing.assert_allclose(policy.act(seen), action[0], atol=1e-6)
        observation, *_ = lanes.step(action)
        seen, *_ = twin.step(action[0])
    real = {"actuator": "realistic", "sensors": "realistic"}
    run = simulate(policy=f"{tmp_path / 'policy.py'}:Mine", distance=60.0, accuracy="fast", **real)
    assert np.ptp(run.frame_force) > 0
