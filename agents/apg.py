"""Analytic policy gradient: a network trained through linear models of whole passes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from panto_env.base.errors import InputError
from panto_env.base.settings import NonNegative

from .actor import Actor
from .algorithm import Algorithm
from .ranges import MOST_UNITS, Count
from .recurrent_actor import RecurrentActor

if TYPE_CHECKING:
    from .cloning_settings import Cloning, CloningError
    from .demonstrations import Demonstrations
    from .settings import Training


class APG(Algorithm):
    """Hyperparameters of the analytic policy gradient.

    Each round measures new passes of the present policy, as many as there are lanes, as exact linear
    models (``linear_pass``), and then descends the mean of the contact force's variance, relative to passive,
    through the passes of the latest rounds. It takes lines, speeds and the observation from the environment,
    not the reward. (Brax calls policy gradients through a simulator so: Freeman et al., NeurIPS 2021.)
    """

    updates: Count = Field(100, description="steps of the optimiser in a round")
    rounds_kept: Count = Field(4, description="rounds whose passes are learnt from")
    rate_weight: NonNegative = Field(
        1.0, description="weight of the mean square of a control step's change of the action beyond rate_free"
    )
    rate_free: NonNegative = Field(
        0.25, description="change of the action in a control step that costs nothing: the actuator's limit"
    )
    mean_weight: NonNegative = Field(
        0.1,
        description="weight of the square of the mean force's shift beyond 0.5 %, in halves of a per cent",
    )
    max_grad_norm: NonNegative = Field(0.5, description="clip of the gradient")
    recurrent_units: Annotated[int, Field(ge=0, le=MOST_UNITS, strict=True)] = Field(
        0, description="width of a gated recurrent unit after the first layer; 0: none"
    )
    response_steps: Count = Field(
        180, description="control steps after which the response to an action is taken to be over"
    )
    pulse_spacing: Count = Field(
        3, description="every how many actions a response is measured; those between are interpolated"
    )
    batch_size: Count = Field(16, description="passes in a step of the optimiser, in groups of eight")

    def pulsing(self) -> Any:
        """How responses are measured, as ``linear_pass`` takes it."""
        from .linear_pass import Pulsing

        return Pulsing(self.response_steps, self.pulse_spacing)

    def make_learner(self, lanes: Any, seed: int) -> Any:
        """Learner that takes its passes from the lanes' environments."""
        from .apg_learner import APGLearner

        return APGLearner(self, lanes, seed)

    def check(self, training: Training) -> None:
        """Raise InputError for parts of a training that passes have no use for."""
        if training.start_from:
            raise InputError(
                "apg starts from nothing; leave out start_from, or add to a policy by residual_of"
            )
        if (training.lines, training.episodes_per_line) != (None, 1):
            raise InputError("apg draws a line for each pass; leave out lines and episodes_per_line")

    def begin_with(self, model: Any, examples: Demonstrations, cloning: Cloning) -> CloningError:
        """Never called: ``check`` refuses it."""
        raise NotImplementedError

    def actor(self, model: Any) -> Actor:
        """Deterministic policy: the network's output, squashed by tanh."""
        plain = self.actor_from_layers(model.network.first, model.network.rest).squash()
        cell = model.network.arrays()
        return plain if cell is None else RecurrentActor(**vars(plain), cell=cell)
