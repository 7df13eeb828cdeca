"""Agents that come with the project, each a policy by name; docs/agents.md says where they fail."""

from __future__ import annotations

from pathlib import Path

from .policy import TrainedPolicy, load

FOLDER = Path(__file__).parent / "models"
"""Their model files: arrays and JSON."""


def known_line() -> TrainedPolicy:
    """One agent for en50318-2002 and its pantograph, 200 to 350 km/h, actuator on the frame.

    It began as ``fitted-fb+ff`` and learnt on by PPO; realistic actuator and sensors. It knows its line by
    heart and is of no use on another one.
    """
    return load(FOLDER / "known-line.safetensors")


def head() -> TrainedPolicy:
    """One agent for en50318-2002 and its pantograph, 200 to 350 km/h, motors in the head (``head-motor``).

    It began as ``periodic`` of the head and learnt on by PPO; realistic sensors.
    """
    return load(FOLDER / "head.safetensors")


def high_speed() -> TrainedPolicy:
    """One agent for shinkansen-simple under identified-2dof, 250 to 400 km/h, as lines are built.

    It learnt by PPO from nothing but rewards; realistic actuator, on the frame, and sensors.
    """
    return load(FOLDER / "high-speed.safetensors")
