"""Settings of behaviour cloning, and the error that remains."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from panto_env.base.settings import NonNegative, Positive, Settings

from .ranges import MOST_KEPT

_Count = Annotated[int, Field(gt=0, le=MOST_KEPT, strict=True)]


class Cloning(Settings):
    """How an agent is fitted to another policy's actions."""

    steps: _Count = Field(200_000, description="environment steps under the policy, summed over all lanes")
    noise: NonNegative = Field(
        0.1,
        description="rms of the noise added to its actions (-), so that the agent also sees other states",
    )
    epochs: _Count = Field(20, description="passes over these steps")
    batch_size: _Count = Field(1024, description="steps in a minibatch")
    learning_rate: Positive = Field(1e-3, description="initial learning rate; it falls to a tenth")


class CloningError(Settings):
    """Error of an agent's actions on steps that it was not fitted to."""

    error: float  # rms difference of the actions (-)
    rms: float  # of the policy's actions (-)
