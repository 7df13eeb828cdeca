"""Callbacks of a training: regular calls, the log of episodes, the progress bar."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from stable_baselines3.common.callbacks import BaseCallback

from panto_env.terminal import progress_console

from .evaluation import Pair, in_words

REFRESH = 0.2  # s between two updates of the progress bar


class EveryNSteps(BaseCallback):  # type: ignore[misc]
    """Calls ``function`` every ``interval`` training steps, and at the end.

    It waits until a rollout ends, since the learner's state is complete between two rollouts.
    """

    def __init__(self, interval: int, function: Callable[[], None]) -> None:
        super().__init__()
        self._interval, self._function, self._last_step = interval, function, 0

    def _on_training_start(self) -> None:
        self._last_step = self.num_timesteps

    def _on_rollout_start(self) -> None:
        if self.num_timesteps // self._interval > self._last_step // self._interval:
            self._call()

    def _on_training_end(self) -> None:
        if self.num_timesteps > self._last_step:
            self._call()

    def _call(self) -> None:
        self._last_step = self.num_timesteps
        self._function()

    def _on_step(self) -> bool:
        return True


class EpisodeLog(BaseCallback):  # type: ignore[misc]
    """Logs figures of each episode when it ends."""

    def __init__(self, figure_names: Sequence[str]) -> None:
        super().__init__()
        self._figure_names = figure_names

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "figures" in info:
                for name in self._figure_names:
                    if name in info["figures"]:  # of an episode that ended early some may be missing
                        self.logger.record_mean(f"episode/{name}", info["figures"][name])
        return True


class ProgressBar(BaseCallback):  # type: ignore[misc]
    """A progress bar on stderr, and a line for each evaluation."""

    def __init__(self, total_steps: int, latest_evaluation: Callable[[], list[Pair]]) -> None:
        """latest_evaluation: returns the pairs of the last evaluation so far."""
        super().__init__()
        self._latest_evaluation = latest_evaluation
        self._progress = Progress(
            TextColumn("{task.completed:.0f}/{task.total:.0f} steps"),
            BarColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[note]}"),
            console=progress_console,
        )
        self._task = self._progress.add_task("", total=total_steps, note="")
        self._start_time, self._start_step, self._time_shown = 0.0, 0, 0.0
        self._pairs_shown: list[Pair] = []

    def __enter__(self) -> ProgressBar:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

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
            self._progress.console.print(f"step {self.num_timesteps}: {in_words(self._pairs_shown)}")
        elapsed = max(self._time_shown - self._start_time, 1e-9)
        steps_per_second = (self.num_timesteps - self._start_step) / elapsed
        share_in_environment = self.model.get_env().unwrapped.seconds / elapsed
        notes = [f"{steps_per_second:.0f} steps/s, {100 * share_in_environment:.0f} % in the environment"]
        if self.model.ep_info_buffer:
            rewards = [episode["r"] for episode in self.model.ep_info_buffer]
            notes.append(f"reward {np.mean(rewards):.1f}")
        if self._pairs_shown:
            notes.append(in_words(self._pairs_shown))
        self._progress.update(self._task, completed=self.num_timesteps, note=", ".join(notes))
