"""Proximal policy optimisation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import Field

from panto_env.base.errors import InputError
from panto_env.base.settings import NonNegative, Positive

from .actor import Actor
from .algorithm import Algorithm
from .ranges import MOST_KEPT, Count, Share

if TYPE_CHECKING:
    from .cloning_settings import Cloning, CloningError
    from .demonstrations import Demonstrations
    from .settings import Training


class PPO(Algorithm):
    """Hyperparameters of PPO."""

    gamma: Share = Field(0.97, description="discount of a reward one control step later")
    n_steps: Count = Field(512, description="steps of each lane between two updates")
    n_epochs: Count = Field(10, description="passes over these steps in an update")
    gae_lambda: Share = Field(0.95, description="bias against variance of the advantage")
    clip_range: Positive = Field(0.2, description="maximum relative change of an action's probability")
    ent_coef: NonNegative = Field(0.0, description="weight of the entropy")
    vf_coef: NonNegative = Field(0.5, description="weight of the value's loss")
    max_grad_norm: Positive = Field(0.5, description="clip of the gradient")
    target_kl: Positive | None = Field(None, description="divergence that ends an update early")
    log_std_init: float = Field(-1.0, description="log of the action's initial standard deviation")

    def check(self, training: Training) -> None:
        """Raise InputError if minibatches do not divide the steps of an update, or these are too many."""
        steps = training.lanes * self.n_steps
        if steps > MOST_KEPT:
            raise InputError(
                f"lanes x n_steps = {steps:,} must be at most {MOST_KEPT:,}: these steps are kept in memory"
            )
        if steps % self.batch_size or steps == 1:
            raise InputError(
                f"lanes x n_steps = {steps} must be a multiple of batch_size = {self.batch_size}, and more "
                "than 1"
            )

    def make_learner(self, lanes: Any, seed: int) -> Any:
        """Learner for a ``VecEnv``, or for lanes on a device."""
        from .device_ppo import DeviceLanes, DevicePPO

        if isinstance(lanes, DeviceLanes):
            return DevicePPO(self, lanes, seed)
        import stable_baselines3

        return stable_baselines3.PPO(
            "MlpPolicy",
            lanes,
            learning_rate=self.learning_rate_schedule(),
            n_steps=self.n_steps,
            batch_size=self.batch_size,
            n_epochs=self.n_epochs,
            gamma=self.gamma,
            gae_lambda=self.gae_lambda,
            clip_range=self.clip_range,
            ent_coef=self.ent_coef,
            vf_coef=self.vf_coef,
            max_grad_norm=self.max_grad_norm,
            target_kl=self.target_kl,
            policy_kwargs=self.policy_kwargs() | {"log_std_init": self.log_std_init},
            seed=seed,
            device="cpu",
        )

    def begin_with(self, model: Any, examples: Demonstrations, cloning: Cloning) -> CloningError:
        """Fit a new learner's actor to a policy's actions, and its critic to the rewards that followed."""
        from .cloning import clone, regress
        from .demonstrations import returns

        policy = model.policy

        def mean(observations: Any) -> Any:
            return policy.get_distribution(observations).distribution.mean

        extractor, values = policy.mlp_extractor, policy.value_net
        own = [*extractor.policy_net.parameters(), *policy.action_net.parameters()]
        error = clone(mean, own, examples, cloning)
        # An untrained critic would mislead the actor in its first updates.
        sums, known = returns(examples, self.gamma)
        if known.any():
            values.bias.data.fill_(float(sums[known].mean()))
            own = [*extractor.value_net.parameters(), *values.parameters()]
            regress(policy.predict_values, own, examples.observations[known], sums[known][:, None], cloning)
        return error

    def actor(self, model: Any) -> Actor:
        """Deterministic policy: the mean of the action, clipped."""
        from .device_ppo import DevicePPO

        if isinstance(model, DevicePPO):
            return self.actor_from_layers(model.network.actor)
        return self.actor_from_layers(model.policy.mlp_extractor.policy_net, model.policy.action_net)
