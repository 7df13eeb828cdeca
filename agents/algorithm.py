"""Algorithms: their hyperparameters, which can make the learner."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from panto_env.base.errors import InputError
from panto_env.base.settings import NonNegative, Positive, Settings
from panto_env.policies import check_named, find_policy

from .model_file import Actor

if TYPE_CHECKING:
    from .cloning import Demonstrations
    from .policy import TrainedPolicy
    from .settings import Training


MOST_KEPT = 50_000_000
"""Maximum number of environment steps kept in memory: about 10 GB."""
MOST_STEPS = 1_000_000_000
"""Maximum of a training's steps, and of any other count: some days on the fastest machines."""
Count = Annotated[int, Field(gt=0, le=MOST_STEPS, strict=True)]
MOST_UNITS, MOST_LAYERS = 4096, 16
"""Maximum width and depth of a network: larger ones take minutes per step and learn no more here."""
Units = Annotated[int, Field(gt=0, le=MOST_UNITS, strict=True)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Kept = Annotated[int, Field(gt=0, le=MOST_KEPT, strict=True)]


class Cloning(Settings):
    """How an agent is fitted to another policy's actions."""

    steps: Kept = Field(200_000, description="environment steps under the policy, summed over all lanes")
    noise: NonNegative = Field(
        0.1,
        description="rms of the noise added to its actions (-), so that the agent also sees other states",
    )
    epochs: Kept = Field(20, description="passes over these steps")
    batch_size: Kept = Field(1024, description="steps in a minibatch")
    learning_rate: Positive = Field(1e-3, description="initial learning rate; it falls to a tenth")


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

    def make_learner(self, lanes: Any, seed: int) -> Any:
        """Learner for a ``VecEnv``: by default the ``BaseAlgorithm`` of this name of Stable-Baselines3."""
        import stable_baselines3

        kwargs = self.policy_kwargs()
        given = self.model_dump(exclude={"learning_rate", "net_arch", "activation", "log_std_init"})
        given |= {"learning_rate": self.learning_rate_schedule(), "device": "cpu", "policy_kwargs": kwargs}
        return getattr(stable_baselines3, type(self).__name__)("MlpPolicy", lanes, seed=seed, **given)

    @abstractmethod
    def actor(self, model: Any) -> Actor:
        """The learner's deterministic policy."""

    def begin_with(self, model: Any, examples: Demonstrations, cloning: Cloning) -> dict[str, float]:
        """Fit a new learner to a policy's demonstrations; its error, see ``clone``."""
        raise NotImplementedError

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

    def actor_from_layers(self, *modules: Any, **more: Any) -> Actor:
        """Actor made of the linear layers in ``modules`` (torch), in their order; more: of its fields."""
        from torch import nn

        layers = [part for module in modules for part in module.modules() if isinstance(part, nn.Linear)]
        return Actor(
            weights=tuple(layer.weight.detach().cpu().numpy().copy() for layer in layers),
            biases=tuple(layer.bias.detach().cpu().numpy().copy() for layer in layers),
            activation=self.activation,
            **more,
        )


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
        return super().make_learner(lanes, seed)

    def policy_kwargs(self) -> dict[str, Any]:
        """Arguments that shape the networks, named as in Stable-Baselines3."""
        return super().policy_kwargs() | {"log_std_init": self.log_std_init}

    def begin_with(self, model: Any, examples: Demonstrations, cloning: Cloning) -> dict[str, float]:
        """Fit a new learner's actor to a policy's actions, and its critic to the rewards that followed."""
        from .cloning import clone, regress, returns

        policy = model.policy

        def mean(observations: Any) -> Any:
            return policy.get_distribution(observations).distribution.mean

        extractor, values = policy.mlp_extractor, policy.value_net
        parameters = [*extractor.policy_net.parameters(), *policy.action_net.parameters()]
        error = clone(mean, parameters, examples, cloning)
        # An untrained critic would mislead the actor in its first updates.
        sums, known = returns(examples, self.gamma)
        if known.any():
            values.bias.data.fill_(float(sums[known].mean()))
            parameters = [*extractor.value_net.parameters(), *values.parameters()]
            regress(
                policy.predict_values, parameters, examples.observations[known], sums[known][:, None], cloning
            )
        return error

    def actor(self, model: Any) -> Actor:
        """Deterministic policy: the mean of the action, clipped."""
        from .device_ppo import DevicePPO

        if isinstance(model, DevicePPO):
            return self.actor_from_layers(model.network.actor)
        return self.actor_from_layers(model.policy.mlp_extractor.policy_net, model.policy.action_net)


class SAC(Algorithm):
    """Hyperparameters of SAC."""

    activation: Literal["tanh", "relu"] = Field("relu", description="of the hidden layers")
    gamma: Share = Field(0.97, description="discount of a reward one control step later")
    buffer_size: Kept = Field(200_000, description="maximum number of transitions in the replay buffer")
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

    def begin_with(self, model: Any, examples: Demonstrations, cloning: Cloning) -> dict[str, float]:
        """Fit a new learner's actor to a policy's actions, and fill the replay buffer with them.

        They take the place of random actions; the critics learn from the buffer as usual.
        """
        from .cloning import clone

        mode = partial(model.actor, deterministic=True)
        parameters = [*model.actor.latent_pi.parameters(), *model.actor.mu.parameters()]
        error = clone(mode, parameters, examples, cloning)
        for step in range(len(examples.rewards)):
            names = ("observations", "following", "taken", "rewards", "ended")
            cuts = examples.ended[step] & ~examples.terminated[step]
            infos = [{"TimeLimit.truncated": bool(cut)} for cut in cuts]
            model.replay_buffer.add(*(getattr(examples, name)[step] for name in names), infos)
        model.learning_starts = 0
        return error

    def actor(self, model: Any) -> Actor:
        """Deterministic policy: the mode of the action, squashed by tanh."""
        return self.actor_from_layers(model.actor.latent_pi, model.actor.mu, squashed=True)


class InRounds(Algorithm):
    """Hyperparameters of a learner of ours that runs whole passes in rounds, with one network."""

    updates: Count = Field(100, description="steps of the optimiser in a round")
    max_grad_norm: NonNegative = Field(0.5, description="clip of the gradient")
    recurrent_units: Annotated[int, Field(ge=0, le=MOST_UNITS, strict=True)] = Field(
        0, description="width of a gated recurrent unit after the first layer; 0: none"
    )

    def check(self, training: Training) -> None:
        """Raise InputError for parts of a training that passes have no use for."""
        if (training.lines, training.episodes_per_line) != (None, 1):
            raise InputError(
                f"{training.algorithm} draws a line for each pass; leave out lines and episodes_per_line"
            )

    def actor(self, model: Any) -> Actor:
        """Deterministic policy: the network's output, squashed by tanh."""
        network = model.network
        return self.actor_from_layers(network.first, network.rest, squashed=True, cell=network.arrays())


class APG(InRounds):
    """Hyperparameters of the analytic policy gradient.

    Each round measures new passes of the present policy, as many as there are lanes, as exact linear
    models (``linear_pass``), and then descends the mean of the contact force's variance, relative to passive,
    through the passes of the latest rounds. It takes lines, speeds and the observation from the environment,
    not the reward. (Brax calls policy gradients through a simulator so: Freeman et al., NeurIPS 2021.)
    """

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
    response_steps: Count = Field(
        180, description="control steps after which the response to an action is taken to be over"
    )
    pulse_spacing: Count = Field(
        3, description="every how many actions a response is measured; those between are interpolated"
    )
    batch_size: Count = Field(16, description="passes in a step of the optimiser, in groups of eight")

    def make_learner(self, lanes: Any, seed: int) -> Any:
        """Learner that takes its passes from the lanes' environments."""
        from .apg import APGLearner

        return APGLearner(self, lanes, seed)

    def check(self, training: Training) -> None:
        """Raise InputError for parts of a training that passes have no use for."""
        super().check(training)
        if training.start_from is None:
            return
        actor = agent_alone(training.start_from, "apg").actor
        widths = tuple(len(each) for each in actor.biases[:-1])
        if (widths, actor.units, actor.activation) != (self.net_arch, self.recurrent_units, self.activation):
            raise InputError(
                f"the network of '{training.start_from}' has another shape; set net_arch = {list(widths)}, "
                f'recurrent_units = {actor.units} and activation = "{actor.activation}"'
            )

    def begin_as(self, model: Any, agent: str) -> None:
        """Give a new learner the network of an agent, of which ``check`` made sure that it fits."""
        actor = agent_alone(agent, "apg").actor
        pairs = [each for pair in zip(actor.weights, actor.biases, strict=True) for each in pair]
        model.network.take([*pairs[:2], *(actor.cell or ()), *pairs[2:]])


class DAgger(InRounds):
    """Hyperparameters of imitation in rounds (DAgger: Ross, Gordon and Bagnell, AISTATS 2011).

    In the first round the teacher acts, in all others what has been learnt so far; the teacher says what it
    would do in each step. After each round the network is fitted to what the teacher said in all of them, by
    least squares, each pass relative to the teacher's own actions. It takes lines, speeds and observation
    from the environment, not the reward. The agent may see less than the teacher.
    """

    batch_size: Count = Field(32, description="parts of passes in a minibatch, of 64 control steps each")

    teacher: str = Field(description="agent whose actions are learnt: one network, with the same washout")

    def make_learner(self, lanes: Any, seed: int) -> Any:
        """Learner that takes its passes from the lanes' environments."""
        from .dagger import DAggerLearner

        return DAggerLearner(self, lanes, seed)

    def check(self, training: Training) -> None:
        """Raise InputError where the teacher or parts of a training do not fit."""
        super().check(training)
        if given := [name for name in ("start_from", "residual_of") if getattr(training, name)]:
            raise InputError(f"dagger learns from its teacher alone; leave out {given[0]}")
        check_named(self.teacher, "it")
        if agent_alone(self.teacher, "dagger").facts.washout != training.washout:
            raise InputError(
                f"'{self.teacher}' has another washout; set [washout] as in the teacher's training"
            )


def agent_alone(agent: str, algorithm: str) -> TrainedPolicy:
    """An agent. Raises InputError for a policy that is not one network alone."""
    from .policy import TrainedPolicy

    found = find_policy(agent)
    if isinstance(found, TrainedPolicy) and found.facts.residual_of is None and not found.facts.steps_before:
        return found
    or_else = "; or it adds to a policy by residual_of" if algorithm == "apg" else ""
    raise InputError(
        f"{algorithm} starts from the network of an agent that acts alone, which '{agent}' is not{or_else}"
    )
