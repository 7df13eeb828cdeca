"""What a training asks of a learner, as Stable-Baselines3's have it, for the learners that are our own."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

import torch
from stable_baselines3.common.logger import Logger

L = TypeVar("L")


class OwnLearner(Generic[L]):
    """A learner with one network and one optimiser."""

    ep_info_buffer = None  # there are no episodes to average
    network: Any
    _optimiser: torch.optim.Optimizer
    logger: Logger

    def __init__(self, lanes: L, seed: int) -> None:
        """lanes: where it learns. seed: of the network, and of all else that is random."""
        self._lanes = lanes
        self.num_timesteps, self._n_updates = 0, 0
        self.set_random_seed(seed)
        torch.manual_seed(seed)

    def get_env(self) -> L:
        """Where it learns."""
        return self._lanes

    def set_logger(self, logger: Logger) -> None:
        """Where figures of the training go."""
        self.logger = logger

    def set_random_seed(self, seed: int) -> None:
        """Seed of what is random but the network."""
        raise NotImplementedError

    def get_parameters(self) -> dict[str, Any]:
        """State of network and optimiser."""
        return {"network": self.network.state_dict(), "optimiser": self._optimiser.state_dict()}

    def set_parameters(self, parameters: dict[str, Any]) -> None:
        """Restore what ``get_parameters`` gave."""
        self.network.load_state_dict(parameters["network"])
        self._optimiser.load_state_dict(parameters["optimiser"])

    def _get_torch_save_params(self) -> tuple[list[str], list[str]]:
        return ["network", "optimiser"], []
