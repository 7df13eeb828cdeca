"""The vector environment whose actions and results are tensors on a device of PyTorch, a GPU above all."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode

from ..base.arrays import to_kmh
from ..base.errors import InputError, shown
from ..control import Context
from ..control.arguments import takes
from ..control.lines import draws_line
from ..control.on_device import TensorLanes
from ..control.settings import read_settings
from .episodes import check_whole_trains, checked_options, checked_seed, one_at_a_time
from .lanes import REWARD, Answer, final_infos, lane_figures, lane_infos
from .settings import USUAL_STARTS, TensorSettings
from .vector import SharedByLanes


class PantographTensorEnv(SharedByLanes):
    """Many pantographs stepped together on a GPU; actions, observations, rewards and flags are tensors there.

    `gymnasium.make_vec("panto_env:Pantograph-v0", num_envs=65536, device="cuda")`; other arguments as for
    `PantographVectorEnv`, and the same source computes a step, so a lane does what it would do on the
    processor. `device="cpu"` is the same environment without a GPU, to try it.

    Episodes begin from `starts` that the processor draws at `reset`: speed, line, pantograph, run-in. After
    `reset(seed=s)` start i is that of a single environment with seed s + i, and lane i begins from start i,
    or where there are fewer starts from i modulo their number. Each later episode begins from any of them,
    chosen at random; noise of sensors is drawn anew.

    `infos` has the content of `PantographVectorEnv`'s, as tensors; "final_obs" is one tensor of all lanes.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it

    @takes(TensorSettings)
    def __init__(self, given: dict[str, Any]) -> None:
        """See the class. Raises InputError for a value that is not valid, TypeError for an unknown name."""
        settings = read_settings(given, TensorSettings)
        self.device = usable_device(settings.device)
        if draws_line(settings):
            raise InputError(
                "On a device all lanes share one line, and a list, a family or a section gives several; "
                "name one line as catenary, or leave out device."
            )
        starts = settings.starts or max(2, min(settings.trains, USUAL_STARTS))
        try:
            self._lanes = TensorLanes(settings, settings.trains, starts, self.device)
        except torch.OutOfMemoryError as error:
            raise InputError(
                f"{settings.num_envs:,} lanes do not fit into the memory of {self.device}; take fewer."
            ) from error
        self._set_up(settings, self._lanes.task)  # on the processor, whose own lanes are the starts
        self._with_figures, self._agents = settings.figures, self._lanes.agents
        self._random = torch.Generator(self.device)
        self._ended = self._none
        self._steps = torch.zeros(self.num_envs, dtype=torch.int64, device=self.device)

    @one_at_a_time
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[torch.Tensor, dict[str, Any]]:
        """Draw all starts, and begin an episode in each lane; see the class.

        With ``options={"reset_mask": mask}``, a tensor (num_envs,) of bool, episodes begin from the present
        starts, and only in the marked lanes. Raises InputError, and changes nothing, for anything else.
        """
        seed, options = checked_seed(seed), checked_options(options)
        mask = options.pop("reset_mask", None)
        if options:
            raise InputError(
                f"On a device reset takes only the option reset_mask, not {', '.join(options)}; make another "
                "environment for other settings."
            )
        if mask is None:
            self._draw(seed)
            lanes = torch.arange(self._lanes.lanes, device=self.device)
            self._lanes.begin(lanes, lanes % self._lanes.starts)
            self._ended, self._running = self._none, True
            self._steps.zero_()
        else:
            self._begin(self._checked_mask(mask))
        answer = self._answer(~self._none if mask is None else mask)
        return answer.results.observation, lane_infos(answer)

    @one_at_a_time
    def step(
        self, actions: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """Hold ``actions``, (num_envs, actions), for one control interval in every lane.

        Raises InputError, and changes nothing, for actions that are not valid.
        """
        self._check_begun()
        self._check(actions)
        waiting = self._ended
        self._check_none_over(waiting)
        self._lanes.step(actions, waiting[:: self._agents], self._random)
        self._begin(waiting)
        answer = self._answer(~self._none)
        results: Any = answer.results
        terminated, truncated = results.terminated, results.truncated
        if self._limit is not None:
            self._steps += 1
            self._steps[waiting] = 0
            truncated = truncated | (self._steps >= self._limit)
        self._ended = ended = terminated | truncated
        observation, reward = results.observation, results.values[:, REWARD].float()
        infos = lane_infos(answer)
        if bool(ended.any()):
            if self.autoreset_mode == AutoresetMode.SAME_STEP:
                last = lane_infos(self._of(answer, ended)) | self._figures(ended)
                final = final_infos(observation, last, ended)
                self._begin(ended)
                begun = self._answer(~self._none)
                observation, infos = begun.results.observation, lane_infos(begun) | final
            else:
                infos |= self._figures(ended)
        return observation, reward, terminated, truncated, infos

    @one_at_a_time
    def context(self, lane: int) -> Context:
        """Information about a lane's episode that a policy may use."""
        return self._lanes.context(lane)

    @property
    def _none(self) -> torch.Tensor:
        return torch.zeros(self.num_envs, dtype=torch.bool, device=self.device)

    def _draw(self, seed: int | None) -> None:
        if seed is None and self._running:  # go on with the generator
            seed = int(torch.randint(2**62, (1,), generator=self._random, device=self.device))
        first = int(seeding.np_random()[1]) if seed is None else seed
        self._lanes.draw_starts(lambda start: seeding.np_random(first + start * self._agents)[0])
        self._random.manual_seed(first % 2**63)

    def _begin(self, ended: torch.Tensor) -> None:
        """Begin episodes in marked lanes, from starts chosen at random."""
        lanes = ended[:: self._agents].nonzero()[:, 0]
        if len(lanes):
            chosen = torch.randint(
                self._lanes.starts, (len(lanes),), generator=self._random, device=self.device
            )
            self._lanes.begin(lanes, chosen)
            self._ended = self._ended & ~ended
            self._steps[ended] = 0

    def _answer(self, lanes: torch.Tensor) -> Any:
        speed_kmh = to_kmh(self._lanes.speeds()).repeat_interleave(self._agents)
        answer: Any = Answer(self._lanes.results(), speed_kmh, lanes, self._lanes.counts())
        return answer if bool(lanes.all()) else self._of(answer, lanes)

    def _of(self, answer: Any, lanes: Any) -> Any:
        results = answer.results._replace(values=answer.results.values * lanes[:, None])
        return Answer(results, answer.speed_kmh * lanes, lanes, answer.counts & lanes)

    def _figures(self, ended: torch.Tensor) -> dict[str, Any]:
        """Figures of the lanes whose episodes have ended, which the processor works out."""
        if not self._with_figures:
            return {}
        values: dict[str, Any] = {}
        trains, agents = ended[:: self._agents].nonzero()[:, 0], np.arange(self._agents)
        for some in trains.split(self._lanes.starts):
            found, without = self._lanes.figures(some)
            rows = (some.cpu().numpy()[:, None] * self._agents + agents).ravel()
            for name, value in found.items():
                own = values.setdefault(name, np.full(self.num_envs, np.nan))
                own[rows] = np.where(without, np.nan, value)
        return self._on_device(lane_figures(values, ended.cpu().numpy()))

    def _on_device(self, infos: dict[str, Any]) -> dict[str, Any]:
        return {
            name: self._on_device(each) if isinstance(each, dict) else torch.from_numpy(each).to(self.device)
            for name, each in infos.items()
        }

    def _check(self, actions: Any) -> None:
        if not (isinstance(actions, torch.Tensor) and actions.device == self.device):
            raise InputError(
                f"Actions must be a tensor of shape {self._shape} on {self.device}, not {shown(actions)}."
            )
        dense = actions.layout is torch.strided and not actions.is_nested
        if not dense or actions.shape != self._shape or not actions.is_floating_point():
            raise InputError(
                f"Actions must be dense floating-point numbers of shape {self._shape}, not {shown(actions)}."
            )
        if actions.requires_grad:
            raise InputError("No gradients pass through the environment; give it actions.detach().")
        wrong = ~torch.isfinite(actions).all(dim=1)
        if wrong.any():
            lane = int(wrong.nonzero()[0])
            raise InputError(
                f"The action of lane {lane} must be finite, not {actions[lane].tolist()}; check the policy."
            )

    def _checked_mask(self, mask: Any) -> torch.Tensor:
        valid = isinstance(mask, torch.Tensor) and mask.dtype == torch.bool and mask.shape == (self.num_envs,)
        dense = valid and mask.layout is torch.strided
        if not (dense and mask.device == self.device and bool(mask.any())):
            raise InputError(
                f"reset_mask must be {self.num_envs} booleans, a tensor on {self.device} with one true or "
                "more."
            )
        if not self._running:
            raise InputError("The first reset must begin episodes in all lanes; leave out reset_mask.")
        check_whole_trains(mask, self._agents)
        lanes: torch.Tensor = mask
        return lanes


def usable_device(name: str) -> torch.device:
    """The device of PyTorch with this name. Raises InputError where it is none, or cannot be used here."""
    try:
        device = torch.device(name)
    except RuntimeError:
        device = torch.device("meta")
    if device.type not in ("cpu", "cuda"):
        raise InputError(f"device must be 'cuda', 'cuda:0' or 'cpu', not {shown(name)}.")
    if device.type == "cpu":
        return device
    if not torch.cuda.is_available():
        raise InputError(
            f"device='{name}' needs a GPU of NVIDIA and a PyTorch built for it, which this machine has "
            "not; leave device out to run on the processor."
        )
    device = torch.device("cuda", torch.cuda.current_device() if device.index is None else device.index)
    if device.index >= torch.cuda.device_count():
        raise InputError(
            f"device='{name}' is not there: this machine has {torch.cuda.device_count()} GPUs, from cuda:0."
        )
    return device
