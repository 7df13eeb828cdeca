"""Training: from validated settings to a model file."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.logger import configure

from panto_baselines.benchmark.settings import SELECTION, check_seeds
from panto_env.base.checksums import commit, write_checked
from panto_env.base.files import alone_in
from panto_env.terminal import progress_console

from .algorithm import APG
from .cloning import demonstrate
from .evaluation import Comparison, Pair, in_words, verdict
from .lanes import PolicyLanes, lane_seeds, make_lanes
from .model_file import Actor, Facts, Needs, read_model, restore, write_model
from .policy import policy_of
from .settings import Training, context_of
from .trainings import RunFolder

REFRESH = 0.2  # s between two updates of the progress bar
LOGGED_FIGURES = ("mean", "std", "contact_loss", "cost_function")


class EveryNSteps(BaseCallback):  # type: ignore[misc]
    """Calls ``function`` every ``interval`` training steps, and at the end.

    It waits until a rollout ends, since the learner's state is complete between two rollouts.
    """

    def __init__(self, interval: int, function: Callable[[], None]) -> None:
        super().__init__()
        self._interval, self._function = interval, function

    def _on_training_start(self) -> None:
        self._last_step = self.num_timesteps

    def _on_rollout_start(self) -> None:
        if self.num_timesteps // self._interval > self._last_step // self._interval:
            self._on_training_end()

    def _on_training_end(self) -> None:
        if self.num_timesteps > self._last_step:
            self._last_step = self.num_timesteps
            self._function()

    def _on_step(self) -> bool:
        return True


class EpisodeLog(BaseCallback):  # type: ignore[misc]
    """Logs figures of each episode when it ends."""

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            for name in LOGGED_FIGURES:
                if name in info.get("figures", {}):  # of an episode that ended early some may be missing
                    self.logger.record_mean(f"episode/{name}", info["figures"][name])
        return True


class ProgressBar(BaseCallback):  # type: ignore[misc]
    """A progress bar on stderr, and a line for each evaluation."""

    def __init__(self, total_steps: int, latest_evaluation: Callable[[], list[Pair]]) -> None:
        """latest_evaluation: returns the pairs of the last evaluation so far."""
        super().__init__()
        self._latest_evaluation = latest_evaluation
        self.progress = Progress(
            TextColumn("{task.completed:.0f}/{task.total:.0f} steps"),
            BarColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[note]}"),
            console=progress_console,
        )
        self._task = self.progress.add_task("", total=total_steps, note="")
        self._time_shown = 0.0
        self._pairs_shown: list[Pair] = []

    def _on_training_start(self) -> None:
        self._start_time, self._start_step = time.monotonic(), self.num_timesteps

    def _on_step(self) -> bool:
        if time.monotonic() - self._time_shown > REFRESH:
            self._show()
        return True

    def _on_rollout_start(self) -> None:
        if self._latest_evaluation() != self._pairs_shown:
            self._show()

    def _on_training_end(self) -> None:
        self._show()

    def _show(self) -> None:
        self._time_shown = time.monotonic()
        if self._latest_evaluation() != self._pairs_shown:
            self._pairs_shown = self._latest_evaluation()
            self.progress.console.print(f"step {self.num_timesteps}: {in_words(self._pairs_shown)}")
        elapsed = max(self._time_shown - self._start_time, 1e-9)
        steps_per_second = (self.num_timesteps - self._start_step) / elapsed
        share_in_environment = self.model.get_env().unwrapped.seconds / elapsed
        notes = [f"{steps_per_second:.0f} steps/s, {100 * share_in_environment:.0f} % in the environment"]
        if self.model.ep_info_buffer:
            rewards = [episode["r"] for episode in self.model.ep_info_buffer]
            notes.append(f"reward {np.mean(rewards):.1f}")
        if self._pairs_shown:
            notes.append(in_words(self._pairs_shown))
        self.progress.update(self._task, completed=self.num_timesteps, note=", ".join(notes))


def train(
    training: Training,
    output: str | Path,
    *,
    resume: bool = False,
    progress: bool = True,
    command: str | None = None,
) -> RunFolder:
    """Train a model into the folder ``output``; returns the folder's paths.

    resume: continue from the newest undamaged checkpoint of the run in ``output`` (from the beginning,
    if there is none), up to ``total_steps``. What was learnt is restored; random numbers and running
    episodes are not, so a resumed run is as good as an uninterrupted one, but not identical to it.
    progress: show a bar on stderr. command: stored in the model files. Raises InputError if the run exists
    already (or, with ``resume``, does not exist), has other settings, or is being trained by another
    process.
    """
    with ExitStack() as stack:
        # More threads do not speed up such small networks, and slow everything down on shared cores.
        stack.callback(torch.set_num_threads, torch.get_num_threads())
        torch.set_num_threads(1)
        lanes = make_lanes(training)
        stack.callback(lanes.close)
        run = Run(training, RunFolder(output), lanes, command)
        run.folder.check(training, resume)
        stack.enter_context(alone_in(run.folder.path, "trains into"))
        run.folder.write_settings(training)
        if resume:
            run.restore()
        run.begin_with_policy()
        run.learn(stack, progress)
    return run.folder


class Run:
    """A learner and its folder, with evaluations and checkpoints between rollouts."""

    def __init__(self, training: Training, folder: RunFolder, lanes: Any, command: str | None = None) -> None:
        """lanes: ``VecEnv`` to learn from. command: stored in the model files."""
        self.training, self.folder, self._command = training, folder, command
        self.model = training.hyperparameters.make_learner(lanes, training.seed)
        self.pairs: list[Pair] = []  # of the last evaluation since the run was begun or resumed
        self._verdict = (math.inf, False)  # of the last evaluation of all
        self._needs = Needs.of(context_of(training.arguments))
        self._best_score = (False, -math.inf)  # whether the best model qualified, and minus its ratio
        chosen_by = range(SELECTION.start, SELECTION.start + training.evaluation.seeds)
        check_seeds(chosen_by, "selection")
        self._comparisons = [
            Comparison(each, training.speeds_in(each), chosen_by) for each in training.environments
        ]
        self._seed_lanes()

    def restore(self) -> None:
        """Load the newest undamaged checkpoint, if there is one."""
        newest = self.folder.newest_checkpoint()
        if newest is not None:
            facts = restore(newest, self.model)
            self._verdict = (math.inf if facts.ratio is None else facts.ratio, facts.qualified)
            # Otherwise lanes and exploration would repeat the random numbers of the first part.
            self.model.set_random_seed(self.training.seed + self.model.num_timesteps)
            self._seed_lanes()
        if self.folder.best.is_file():
            facts, _ = read_model(self.folder.best)
            self._best_score = (facts.qualified, -math.inf if facts.ratio is None else -facts.ratio)
        # Without a checkpoint the run begins anew, with an evaluation of its initial policy.
        self.folder.drop_evaluations_after(-1 if newest is None else self.model.num_timesteps)

    def _seed_lanes(self) -> None:
        """Give the lanes seeds for training: the learner would count from its own seed."""
        self.model.get_env().seed(lane_seeds(self.training, self.model.num_timesteps)[0])

    def begin_with_policy(self) -> None:
        """Give a new learner the network it starts from, or fit it to that policy and store the error."""
        training, name, learner = self.training, self.training.start_from, self.training.hyperparameters
        if name is None or self.model.num_timesteps > 0:
            return
        if isinstance(learner, APG):
            learner.begin_as(self.model, name)
            return
        native, cloning = self.model.get_env().unwrapped.env, training.cloning
        steps = -(-cloning.steps // training.lanes)
        policy = PolicyLanes(name, native)
        examples = demonstrate(native, policy, lane_seeds(training), steps, cloning.noise)
        error = learner.begin_with(self.model, examples, cloning)
        write_checked(self.folder.cloning, {"policy": name} | error)
        self._seed_lanes()

    def learn(self, stack: ExitStack, progress: bool) -> None:
        """Learn the remaining steps, and write the final model."""
        remaining_steps = self.training.total_steps - self.model.num_timesteps
        if remaining_steps <= 0 and self.folder.model.is_file():
            return
        self.model.set_logger(configure(str(self.folder.tensorboard), ["tensorboard"]))
        stack.callback(self.model.logger.close)
        if self.model.num_timesteps == 0 and (self.training.start_from or self.training.residual_of):
            self.evaluate()  # the initial policy may be hard to beat
        # Evaluations come first, so that no checkpoint is newer than the table of evaluations.
        callbacks: list[Any] = [
            EpisodeLog(),
            EveryNSteps(self.training.evaluation.interval_steps, self.evaluate),
            EveryNSteps(self.training.checkpoint_steps, self.checkpoint),
        ]
        if progress:
            callbacks.append(ProgressBar(self.training.total_steps, lambda: self.pairs))
            stack.enter_context(callbacks[-1].progress)
        if remaining_steps > 0:
            together = CallbackList(callbacks)
            self.model.learn(remaining_steps, together, log_interval=1, reset_num_timesteps=False)
        self._save(self.folder.model)

    def evaluate(self) -> None:
        """Compare the policy with the passive pantograph, log the figures, and keep the best model."""
        steps, logger = self.model.num_timesteps, self.model.logger
        policy = policy_of(*self._policy())  # in the form of its model file
        self.pairs = [pair for each in self._comparisons for pair in each.run(policy)]
        self._verdict = ratio, qualified = verdict(self.pairs)
        self.folder.add_evaluation(steps, self.pairs)
        logger.record("evaluation/std_ratio", ratio)
        for pair in self.pairs:
            for name in LOGGED_FIGURES:
                value = pair.policy.as_dict()[name]
                logger.record_mean(f"evaluation/{name}_{pair.speed_kmh:g}_kmh", value)
        logger.dump(steps)
        if (qualified, -ratio) > self._best_score or not self.folder.best.is_file():
            self._best_score = (qualified, -ratio)
            self._save(self.folder.best)

    def checkpoint(self) -> None:
        """Write a checkpoint and remove the oldest one."""
        path = self.folder.checkpoint(self.model.num_timesteps)
        self._save(path, replay=hasattr(self.model, "replay_buffer"))
        self.folder.drop_old_checkpoints()

    def _save(self, path: Path, replay: bool = False) -> None:
        write_model(path, self.model, *self._policy(), replay)

    def _policy(self) -> tuple[Actor, Facts]:
        """Network and facts of the present policy."""
        actor, (ratio, qualified) = self.training.hyperparameters.actor(self.model), self._verdict
        shared = "algorithm", "seed", "environment", "variants", "residual_of", "residual_share", "washout"
        facts = Facts(
            commit=commit(),
            command=self._command,
            steps=self.model.num_timesteps,
            updates=self.model._n_updates,
            needs=self._needs,
            ratio=ratio if math.isfinite(ratio) else None,
            qualified=qualified,
            activation=actor.activation,
            squashed=actor.squashed,
            **{name: getattr(self.training, name) for name in shared},
        )
        return actor, facts
