"""How an agent is brought to do as another policy does, and how near it comes."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from panto_env.base.settings import NonNegative, Positive, Settings

from .ranges import MOST_KEPT

_Count = Annotated[int, Field(gt=0, le=MOST_KEPT, strict=True)]


class Cloning(Settings):
    """How an agent is brought to do as another policy does."""

    steps: _Count = Field(200_000, description="environment steps under the policy, summed over all lanes")
    noise: NonNegative = Field(
        0.1,
        description="rms of what is added to its actions (-), so that not its own states alone are seen",
    )
    epochs: _Count = Field(20, description="passes over these steps")
    batch_size: _Count = Field(1024, description="steps in a minibatch")
    learning_rate: Positive = Field(1e-3, description="first step of the optimiser; it falls to a tenth")


class CloningError(Settings):
    """How far an agent is from what it was to do, on steps that it was not fitted to."""

    error: float  # rms difference of the actions (-)
    rms: float  # of the policy's actions (-)
