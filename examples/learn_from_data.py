"""Learning from data sets only: a controller from recorded episodes, and sigma from a table of designs.

    panto dataset episodes dataset-known-line --only fitted-fb-ff-noisy
    panto dataset designs
    python examples/learn_from_data.py

printed, after about two minutes on one core,

    clone: rms error 8.6 % of the rms action, on unseen episodes
    250 km/h: sigma -21.7 %, 100 % of its teacher's -21.7 %
    300 km/h: sigma -21.9 %, 95 % of its teacher's -23.0 %
    350 km/h: sigma -33.3 %, 96 % of its teacher's -34.8 %
    sigma of unseen designs by mean: R2 -0.027, median error 22.7 %
    sigma of unseen designs by linear: R2 0.806, median error 8.1 %
    sigma of unseen designs by trees: R2 0.941, median error 5.1 %

The controller is a network that imitates `fitted-fb+ff` (behaviour cloning). Its features come from the
observation of Pantograph-v0, which the data set holds, and from what a controller can remember: the place
within the span as 14 harmonics, three control steps of readings, slow averages of them, and its own last two
commands. It imitates the policy's actions in states that noise on the actions had led to, so that it has
seen how to recover. It is judged like any policy of the benchmark: on lines of other seeds, against a passive
pantograph at the same mean force.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from panto_baselines.benchmark.run import run
from panto_baselines.benchmark.settings import BenchmarkSettings, Line
from panto_env.base.arrays import from_kmh
from panto_env.control import Context
from panto_env.envs import IDS

Array = NDArray[np.float64]
DATASET, TEACHER = "pantograph/known-line/fitted-fb-ff-noisy-v0", "fitted-fb+ff"
HARMONICS, HISTORY, COMMANDS, AVERAGED = 14, 3, 2, 100  # AVERAGED: control steps, a second
READINGS, SINE, COSINE, SPEED = [0, 1, 2, 3, 7], 4, 5, 6  # places in the observation of Pantograph-v0
SPEEDS_KMH = (250.0, 300.0, 350.0)


class Features:
    """Features of a network: from the present observation and from memory of earlier ones."""

    def __init__(self) -> None:
        self._past: list[Array] = []
        self._average: Array | None = None

    def __call__(self, observation: NDArray[np.float32], commands: list[Array]) -> NDArray[np.float32]:
        """Features, (features,), of an observation; commands: the controller's own so far."""
        readings = observation[READINGS].astype(float)
        average = readings if self._average is None else self._average
        self._average = average + (readings - average) / AVERAGED
        self._past = [readings, *self._past, readings, readings][:HISTORY]
        turn = complex(observation[COSINE], observation[SINE]) ** np.arange(1, HARMONICS + 1)
        last = [np.zeros(1), np.zeros(1), *commands][-COMMANDS:]
        parts = (*self._past, self._average, turn.real, turn.imag, observation[[SPEED]], *last)
        return np.concatenate(parts).astype(np.float32)


class Clone:
    """A policy: the network that ``clone`` wrote, without torch. `panto benchmark` takes it by this file."""

    observation = IDS["Pantograph-v0"]["observation"]

    def __init__(self, model: str) -> None:
        """model: path of its arrays."""
        with np.load(model) as file:
            self._layers = [(file[f"weight{k}"], file[f"bias{k}"]) for k in range(len(file.files) // 2)]

    def reset(self, context: Context) -> None:
        """Begin an episode with nothing to remember."""
        self._features, self._commands = Features(), []

    def act(self, observation: NDArray[np.float32]) -> Array:
        """Action, (1,), for an observation, (entries,)."""
        values = self._features(observation, self._commands)
        for weight, bias in self._layers[:-1]:
            values = np.maximum(weight @ values + bias, 0)
        weight, bias = self._layers[-1]
        action = np.clip((weight @ values + bias).astype(float), -1, 1)
        self._commands = [*self._commands, action][-COMMANDS:]
        return action


def examples(data: Path, dataset: str = DATASET) -> Iterator[tuple[Array, Array]]:
    """Features, (steps, features), and the policy's actions, (steps, 1), of each episode of a data set."""
    os.environ["MINARI_DATASETS_PATH"] = str(data.resolve())
    import minari  # reads the path above

    for episode in minari.load_dataset(dataset):
        features, actions = Features(), episode.infos["policy_action"][1:]
        yield (
            np.array([features(seen, list(actions[max(0, k - COMMANDS) : k]))
                      for k, seen in enumerate(episode.observations[:-1])]),
            actions,
        )  # fmt: skip


def clone(data: Path, model: Path, *, dataset: str = DATASET, epochs: int = 40) -> float:
    """Fit a network to a data set and write it; returns rms error over rms action on unseen episodes."""
    import torch

    torch.manual_seed(0)
    torch.set_num_threads(1)
    episodes = list(examples(data, dataset))
    held_out = max(1, len(episodes) // 10)
    x, y = (np.concatenate(each).astype(np.float32) for each in zip(*episodes[:-held_out], strict=True))
    unseen, actions = (
        np.concatenate(each).astype(np.float32) for each in zip(*episodes[-held_out:], strict=True)
    )
    layers = [torch.nn.Linear(*shape) for shape in ((x.shape[1], 256), (256, 128), (128, y.shape[1]))]
    net = torch.nn.Sequential(layers[0], torch.nn.ReLU(), layers[1], torch.nn.ReLU(), layers[2])
    inputs, outputs, batch = torch.from_numpy(x), torch.from_numpy(y), 512
    steps = epochs * -(-len(x) // batch)
    optimiser = torch.optim.Adam(net.parameters(), lr=1e-3)
    decay = torch.optim.lr_scheduler.OneCycleLR(optimiser, 3e-3, total_steps=steps)
    for _ in range(epochs):
        for places in torch.randperm(len(x)).split(batch):
            loss = torch.nn.functional.mse_loss(net(inputs[places]), outputs[places])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            decay.step()
    with torch.no_grad():
        error = net(torch.from_numpy(unseen)).numpy() - actions
    arrays = {f"weight{k}": layer.weight.detach().numpy() for k, layer in enumerate(layers)}
    np.savez(model, **arrays, **{f"bias{k}": layer.bias.detach().numpy() for k, layer in enumerate(layers)})
    return float(np.sqrt(np.mean(error**2) / np.mean(actions**2)))


def judge(
    model: Path, speeds_kmh: tuple[float, ...] = SPEEDS_KMH, seeds: int = 4, workers: int | None = None
) -> dict[float, tuple[float, float, str]]:
    """By speed (km/h): change of sigma (%) of the clone and its teacher, and why the clone is not ranked."""
    name = f"{Path(__file__).resolve()}:Clone:model={str(model.resolve())!r}"
    realistic = {key: IDS["Pantograph-v0"][key] for key in ("actuator", "sensors", "line_condition")}
    settings = BenchmarkSettings(
        policies=("passive", TEACHER, name),
        lines=(Line(speeds_kmh=speeds_kmh),),
        seeds=seeds,
        pantograph_scatter=IDS["Pantograph-v0"]["pantograph_scatter"],
        **realistic,
    )
    cells = {(cell.speed_kmh, cell.policy): cell for cell in run(settings, workers).cells}
    return {
        speed: (cells[speed, name].change, cells[speed, TEACHER].change, cells[speed, name].disqualified)
        for speed in speeds_kmh
    }


def surrogate(table: Path) -> dict[str, tuple[float, float]]:
    """By model: R2 and median relative error (%) of sigma on the last fifth of the designs, unseen by it.

    "mean" predicts the mean of the other designs and "linear" is a linear model of all parameters: yardsticks
    for "trees", which are gradient-boosted and also see the ratios that engineers use.
    """
    import pyarrow.parquet as pq
    from sklearn.dummy import DummyRegressor
    from sklearn.ensemble import HistGradientBoostingRegressor
    from sklearn.linear_model import LinearRegression

    columns = {name: np.array(values) for name, values in pq.read_table(table).to_pydict().items()}
    sigma = columns["std"].astype(float)
    there = np.isfinite(sigma)  # neither refused nor ended early
    parameters = np.stack([each for name, each in columns.items() if "." in name or name == "speed_kmh"], 1)
    trees = HistGradientBoostingRegressor(max_iter=600, learning_rate=0.06, random_state=0)
    with_ratios = np.hstack([parameters, ratios(columns)])
    models = {
        "mean": (DummyRegressor(), parameters),
        "linear": (LinearRegression(), parameters),
        "trees": (trees, with_ratios),
    }
    first, scores = round(0.8 * there.sum()), {}
    for name, (model, seen) in models.items():
        model.fit(seen[there][:first], np.log(sigma[there][:first]))
        predicted, true = np.exp(model.predict(seen[there][first:])), sigma[there][first:]
        r2 = 1 - np.mean((predicted - true) ** 2) / np.var(true)
        scores[name] = float(r2), float(100 * np.median(np.abs(predicted / true - 1)))
    return scores


def ratios(columns: dict[str, Array]) -> Array:
    """Ratios of designs, (designs, 5): speed over wave speeds, spans per second, wave reflection by droppers.

    The reflection coefficient of a dropper and the Doppler factor are from the usual theory of two strings.
    """
    speed, span = from_kmh(columns["speed_kmh"]), columns["catenary.span_length"]
    (contact, contact_mass), (messenger, messenger_mass) = (
        (columns[f"catenary.{wire}_wire.tension"], columns[f"catenary.{wire}_wire.mass"])
        for wire in ("contact", "messenger")
    )
    wave, both = np.sqrt(contact / contact_mass), (contact + messenger) / (contact_mass + messenger_mass)
    doppler = (wave - speed) / (wave + speed)
    back = 1 / (1 + np.sqrt(contact * contact_mass / (messenger * messenger_mass)))
    return np.stack([speed / wave, speed / np.sqrt(both), speed / span, doppler, back / doppler], axis=1)


def main() -> None:
    """Train both models and print each figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path("data"), help="folder of the data sets")
    parser.add_argument("--model", type=Path, default=Path("clone.npz"), help="file to write the clone to")
    given = parser.parse_args()
    error = 100 * clone(given.data, given.model)
    print(f"clone: rms error {error:.1f} % of the rms action, on unseen episodes")
    for speed, (own, teacher, reason) in judge(given.model).items():
        share = f"{100 * own / teacher:.0f} % of its teacher's {teacher:.1f} %"
        print(f"{speed:g} km/h: sigma {own:+.1f} %, {share}{f'; not ranked: {reason}' if reason else ''}")
    for name, (r2, error) in surrogate(given.data / "designs" / "designs.parquet").items():
        print(f"sigma of unseen designs by {name}: R2 {r2:.3f}, median error {error:.1f} %")


if __name__ == "__main__":
    main()
