"""What happens beside the learning: regular acts, the episodes' log, the progress bar."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from stable_baselines3.common.callbacks import BaseCallback

from panto_env.terminal import progress_console

from .evaluation import Pair, in_words

REFRESH = 0.2  # s, of the progress bar


class Regular(BaseCallback):  # type: ignore[misc]
    """Does ``act`` whenever another ``interval`` of training steps is full, and at the end.

    Only between two rollouts, where the learner's state is whole.
    """

    def __init__(self, interval: int, act: Callable[[], None]) -> None:
        super().__init__()
        self._interval, self._act, self._last = interval, act, 0

    def _on_training_start(self) -> None:
        self._last = self.num_timesteps

    def _on_rollout_start(self) -> None:
        if self.num_timesteps // self._interval > self._last // self._interval:
            self._run()

    def _on_training_end(self) -> None:
        if self.num_timesteps > self._last:
            self._run()

    def _run(self) -> None:
        self._last = self.num_timesteps
        self._act()

    def _on_step(self) -> bool:
        return True


class EpisodeLog(BaseCallback):  # type: ignore[misc]
    """Logs figures of the episodes that end."""

    def __init__(self, names: Sequence[str]) -> None:
        super().__init__()
        self._names = names

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "figures" in info:
                for name in self._names:
                    self.logger.record_mean(f"episode/{name}", info["figures"][name])
        return True


class Bar(BaseCallback):  # type: ignore[misc]
    """A progress bar on stderr, and a line for each evaluation."""

    def __init__(self, total: int, evaluation: Callable[[], list[Pair]]) -> None:
        """evaluation: gives the pairs of the last evaluation."""
        super().__init__()
        self._evaluation = evaluation
        self._progress = Progress(
            TextColumn("{task.completed:.0f}/{task.total:.0f} steps"),
            BarColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[note]}"),
            console=progress_console,
        )
        self._task = self._progress.add_task("", total=total, note="")
        self._began, self._first, self._shown = 0.0, 0, 0.0
        self._pairs: list[Pair] = []

    def __enter__(self) -> Bar:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def _on_training_start(self) -> None:
        self._began, self._first = time.monotonic(), self.num_timesteps

    def _on_step(self) -> bool:
        if time.monotonic() - self._shown > REFRESH:
            self._show()
        return True

    def _on_rollout_start(self) -> None:
        if self._evaluation() != self._pairs:
            self._show()

    def _on_training_end(self) -> None:
        self._show()

    def _show(self) -> None:
        self._shown = time.monotonic()
        if self._evaluation() != self._pairs:
            self._pairs = self._evaluation()
            self._progress.console.print(f"step {self.num_timesteps}: {in_words(self._pairs)}")
        rate = (self.num_timesteps - self._first) / max(self._shown - self._began, 1e-9)
        inside = self.model.get_env().unwrapped.seconds / max(self._shown - self._began, 1e-9)
        parts = [f"{rate:.0f} steps/s, {100 * inside:.0f} % in the environment"]
        if self.model.ep_info_buffer:
            rewards = [episode["r"] for episode in self.model.ep_info_buffer]
            parts.append(f"reward {np.mean(rewards):.1f}")
        if self._pairs:
            parts.append(in_words(self._pairs))
        self._progress.update(self._task, completed=self.num_timesteps, note=", ".join(parts))
