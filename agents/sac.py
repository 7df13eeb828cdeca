"""Soft actor-critic."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from panto_env.base.errors import InputError
from panto_env.base.settings import NonNegative

from .actor import Actor
from .algorithm import Algorithm
from .ranges import MOST_KEPT, Count, Share

if TYPE_CHECKING:
    from .cloning_settings import Cloning, CloningError
    from .demonstrations import Demonstrations
    from .settings import Training


class SAC(Algorithm):
    """Hyperparameters of SAC."""

    activation: Literal["tanh", "relu"] = Field("relu", description="of the hidden layers")
    gamma: Share = Field(0.97, description="discount of a reward one control step later")
    buffer_size: Annotated[int, Field(gt=0, le=MOST_KEPT, strict=True)] = Field(
        200_000, description="maximum number of transitions in the replay buffer"
    )
    learning_starts: Annotated[int, Field(ge=0, le=MOST_KEPT, strict=True)] = Field(
        2_000, description="steps with random actions before learning starts"
    )
    tau: Share = Field(0.005, description="share of the critic that its target takes over per update")
    train_freq: Count = Field(1, description="steps of each lane between two updates")
    gradient_steps: Count = Field(1, description="minibatches in an update")
    ent_coef: NonNegative | Literal["auto", "auto_0.1", "auto_0.01"] = Field(
        "auto", description="weight of the entropy; auto: adapted, starting at 1 or at the number after it"
    )

    def check(self, training: Training) -> None:
        """Raise InputError if learning would never start."""
        if self.learning_starts >= training.total_steps:
            raise InputError(
                f"learning_starts = {self.learning_starts} must be less than total_steps = "
                f"{training.total_steps}"
            )

    def make_learner(self, lanes: Any, seed: int) -> Any:
        """Learner for a ``VecEnv``."""
        import stable_baselines3

        return stable_baselines3.SAC(
            "MlpPolicy",
            lanes,
            learning_rate=self.learning_rate_schedule(),
            buffer_size=self.buffer_size,
            learning_starts=self.learning_starts,
            batch_size=self.batch_size,
            tau=self.tau,
            gamma=self.gamma,
            train_freq=self.train_freq,
            gradient_steps=self.gradient_steps,
            ent_coef=self.ent_coef,
            policy_kwargs=self.policy_kwargs(),
            seed=seed,
            device="cpu",
        )

    def begin_with(self, model: Any, examples: Demonstrations, cloning: Cloning) -> CloningError:
        """Fit a new learner's actor to a policy's actions, and fill the replay buffer with them.

        They take the place of random actions; the critics learn from the buffer as usual.
        """
        from .cloning import clone

        def mode(observations: Any) -> Any:
            return model.actor(observations, deterministic=True)

        own = [*model.actor.latent_pi.parameters(), *model.actor.mu.parameters()]
        error = clone(mode, own, examples, cloning)
        for step in range(len(examples.rewards)):
            model.replay_buffer.add(
                examples.observations[step],
                examples.following[step],
                examples.taken[step],
                examples.rewards[step],
                examples.ended[step],
                [
                    {"TimeLimit.truncated": bool(cut)}
                    for cut in examples.ended[step] & ~examples.terminated[step]
                ],
            )
        model.learning_starts = 0
        return error

    def actor(self, model: Any) -> Actor:
        """Deterministic policy: the mode of the action, squashed by tanh."""
        return self.actor_from_layers(model.actor.latent_pi, model.actor.mu).squash()
