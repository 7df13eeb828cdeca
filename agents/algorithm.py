"""Base of algorithms: hyperparameters that can make the learner."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from panto_env.base.settings import Positive, Settings

from .actor import Actor
from .ranges import MOST_LAYERS, Count, Units

if TYPE_CHECKING:
    from .cloning_settings import Cloning, CloningError
    from .demonstrations import Demonstrations
    from .settings import Training


class Algorithm(Settings, ABC):
    """Hyperparameters, named as in Stable-Baselines3; a subclass is an algorithm."""

    learning_rate: Positive | tuple[Positive, Positive] = Field(
        3e-4, description="step of the optimiser; two numbers: linearly from the first to the second"
    )
    batch_size: Count = Field(256, description="transitions in a minibatch")
    net_arch: tuple[Units, ...] = Field(
        (64, 64), max_length=MOST_LAYERS, description="widths of the hidden layers"
    )
    activation: Literal["tanh", "relu"] = Field("tanh", description="of the hidden layers")

    @abstractmethod
    def make_learner(self, lanes: Any, seed: int) -> Any:
        """Learner (a Stable-Baselines3 ``BaseAlgorithm``) for a ``VecEnv``."""

    @abstractmethod
    def actor(self, model: Any) -> Actor:
        """The learner's deterministic policy."""

    @abstractmethod
    def begin_with(self, model: Any, examples: Demonstrations, cloning: Cloning) -> CloningError:
        """Fit a new learner to a policy's demonstrations."""

    def check(self, training: Training) -> None:
        """Raise InputError where the hyperparameters do not fit the rest of a training."""

    def learning_rate_schedule(self) -> Any:
        """Learning rate in the form that Stable-Baselines3 expects."""
        from stable_baselines3.common.utils import LinearSchedule

        if isinstance(self.learning_rate, tuple):
            return LinearSchedule(*self.learning_rate, end_fraction=1.0)
        return self.learning_rate

    def policy_kwargs(self) -> dict[str, Any]:
        """Arguments that shape the networks, named as in Stable-Baselines3."""
        from torch import nn

        activation = {"tanh": nn.Tanh, "relu": nn.ReLU}[self.activation]
        return {"net_arch": list(self.net_arch), "activation_fn": activation}

    def actor_from_layers(self, *modules: Any) -> Actor:
        """Actor made of the linear layers in ``modules`` (torch), in their order."""
        from torch import nn

        layers = [part for module in modules for part in module.modules() if isinstance(part, nn.Linear)]
        return Actor(
            weights=tuple(layer.weight.detach().cpu().numpy().copy() for layer in layers),
            biases=tuple(layer.bias.detach().cpu().numpy().copy() for layer in layers),
            activation=self.activation,
        )
