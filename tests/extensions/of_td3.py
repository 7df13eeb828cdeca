from pathlib import Path

from stable_baselines3 import TD3


class Mine:
    observation, history, washout = "centred", 0, 1.0  # as in the training; these are Pantograph-v0's

    def __init__(self, model="td3.zip"):
        self.model = TD3.load(Path(__file__).parent / model, device="cpu")

    def reset(self, context):
        """Forget the episode before: here a stack of frames, or a recurrent state, begins anew."""

    def act(self, observation):
        return self.model.predict(observation, deterministic=True)[0]
