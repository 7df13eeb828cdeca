"""Agents that come with the project, each a policy by name; docs/agents.md says where they fail."""

from __future__ import annotations

from pathlib import Path

from panto_env.base.errors import InputError, shown

from .policy import Ensemble, TrainedPolicy, load

FOLDER = Path(__file__).parent / "models"
"""Folder of their model files; further trainings of an agent lie in a folder of its name."""


def _trained(name: str, seed: int) -> TrainedPolicy:
    """The agent of a name, trained under a seed. Raises InputError for one that it was not trained under."""
    if seed == 0:
        return load(FOLDER / f"{name}.safetensors")
    stored = {f"{each}": path for each, path in further_trainings(name).items()}
    if str(seed) not in stored:
        raise InputError(
            f"agent-{name} was trained under the seeds {', '.join(('0', *stored))}, not {shown(seed)}."
        )
    return load(stored[str(seed)])


def further_trainings(name: str) -> dict[int, Path]:
    """Model files of an agent's further trainings, by their seeds."""
    return {
        int(path.stem.removeprefix("seed")): path
        for path in sorted((FOLDER / name).glob("seed*.safetensors"))
    }


def known_line(seed: int = 0) -> TrainedPolicy:
    """Agent for en50318-2002 and its pantograph, 200 to 350 km/h, actuator on the frame.

    It started from ``fitted-fb+ff`` and was trained further by PPO, with realistic actuator and sensors. It
    has learnt this line by heart and is of no use on another one.
    """
    return _trained("known-line", seed)


def head(seed: int = 0) -> TrainedPolicy:
    """Agent for en50318-2002 and its pantograph, 200 to 350 km/h, motors in the head (``head-motor``).

    It started from ``periodic`` for the head and was trained further by PPO, with realistic sensors.
    """
    return _trained("head", seed)


def high_speed(seed: int = 0) -> TrainedPolicy:
    """Agent for identified-2dof on shinkansen-simple, 250 to 400 km/h, for lines as built.

    It was trained by PPO from rewards only, with a realistic actuator on the frame and realistic sensors. Its
    observation is normalised by passive runs at these speeds, which a slower line refuses.
    """
    return _trained("high-speed", seed)


def train(seed: int = 0) -> TrainedPolicy:
    """Agent for both of two dsa380, 200 m apart on en50318-2002, 200 to 300 km/h, as built.

    It adds to ``repetitive``. Both pantographs trained one network by PPO, with realistic actuator and
    sensors; it sees what the pantograph in front measured.
    """
    return _trained("train", seed)


def any_line(seed: int = 0) -> TrainedPolicy:
    """Agent for dsa380 on any line of family:high-speed, 240 to 310 km/h, as built.

    It was trained by the analytic policy gradient on lines drawn from the family, from nothing, with a
    realistic actuator on the frame and realistic sensors. It is told nothing of the line.
    """
    return _trained("any-line", seed)


def any_line_five() -> Ensemble:
    """Mean action of the five trainings of agent-any-line, for the same lines and pantograph."""
    return Ensemble([any_line(seed) for seed in range(5)])


def any_pantograph(seed: int = 0) -> TrainedPolicy:
    """Agent for any line and section, 120 to 350 km/h, under the four pantographs that it was trained with.

    These are dsa380, dsa250, identified-2dof and benchmark-2015. It was trained by the analytic policy
    gradient on lines drawn from family:high-speed, section:fast-line and section:main-line, as built, from
    nothing, with a realistic actuator on the frame and realistic sensors. It is told nothing of the line.
    """
    return _trained("any-pantograph", seed)


def small(seed: int = 0) -> TrainedPolicy:
    """Agent for a small processor, with less than 4 kB of weights, where agent-any-pantograph is for.

    It learnt from that one by imitation in rounds, and sees less.
    """
    return _trained("small", seed)


def robust(seed: int = 0) -> TrainedPolicy:
    """Agent for any line, section and place in a train, with sensors and actuators that fail.

    It is agent-any-pantograph, trained further by the analytic policy gradient on lines for 120 to 350 km/h,
    under five pantographs, alone and in trains, with faults and delays that are drawn; it is told of none.
    """
    return _trained("robust", seed)


def trailing(seed: int = 0) -> TrainedPolicy:
    """Agent for the second of two dsa380, 200 m apart on en50318-2002, 190 to 310 km/h, as built.

    It was trained by the analytic policy gradient, from nothing, with a realistic actuator on the frame and
    realistic sensors. The first pantograph is passive; the agent sees what it measured.
    """
    return _trained("trailing", seed)


def trailing_alone(seed: int = 0) -> TrainedPolicy:
    """The same as agent-trailing without preview: it sees nothing of the pantograph in front."""
    return _trained("trailing-alone", seed)
