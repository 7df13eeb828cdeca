"""What every algorithm has in common: its hyperparameters, which know how to make the learner."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, Any, Literal

from pydantic import Field

from panto_env.base.settings import Positive, Settings

from .actor import Actor

Count = Annotated[int, Field(gt=0, strict=True)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]


class Algorithm(Settings, ABC):
    """Hyperparameters, named as in Stable-Baselines3; a subclass is an algorithm."""

    learning_rate: Positive | tuple[Positive, Positive] = Field(
        3e-4, description="step of the optimiser; two numbers: from the first to the last, linearly"
    )
    batch_size: Count = Field(256, description="transitions in a minibatch")
    gamma: Share = Field(0.97, description="discount of a reward one control step later")
    net_arch: tuple[Count, ...] = Field((64, 64), description="widths of the hidden layers")
    activation: Literal["tanh", "relu"] = Field("tanh", description="of the hidden layers")

    @abstractmethod
    def make(self, lanes: Any, seed: int) -> Any:
        """Learner (a ``BaseAlgorithm``) for a ``VecEnv``."""

    @abstractmethod
    def actor(self, model: Any) -> Actor:
        """The learner's deterministic policy."""

    def check(self, lanes: int, total_steps: int) -> None:
        """Raise InputError where the hyperparameters don't fit so many lanes and steps."""

    def schedule(self) -> Any:
        """Learning rate as Stable-Baselines3 takes it."""
        from stable_baselines3.common.utils import LinearSchedule

        if isinstance(self.learning_rate, tuple):
            return LinearSchedule(*self.learning_rate, end_fraction=1.0)
        return self.learning_rate

    def network(self) -> dict[str, Any]:
        """``policy_kwargs`` of the networks."""
        from torch import nn

        activation = {"tanh": nn.Tanh, "relu": nn.ReLU}[self.activation]
        return {"net_arch": list(self.net_arch), "activation_fn": activation}

    def layers(self, *modules: Any) -> Actor:
        """Actor of the linear layers in ``modules`` (torch), in their order."""
        from torch import nn

        linear = [part for module in modules for part in module.modules() if isinstance(part, nn.Linear)]
        return Actor(
            weights=tuple(part.weight.detach().cpu().numpy().copy() for part in linear),
            biases=tuple(part.bias.detach().cpu().numpy().copy() for part in linear),
            activation=self.activation,
        )
