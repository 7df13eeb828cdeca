"""Card of a data set of episodes: where it comes from, what it holds, and how to use it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from panto_env.control.observation import Layout

from .episodes import Episode
from .front_matter import front_matter
from .settings import ENVIRONMENT, EpisodesSettings, Plan, PolicySet
from .steps_table import COLUMNS, STEPS

REWARD = (
    "The reward is that of the environment: minus the sum of the terms in `infos/reward_terms`, each times "
    "its weight, which the environment's argument `reward` gives."
)


def description(settings: EpisodesSettings, policy_set: PolicySet) -> str:
    """One paragraph that describes a data set."""
    places = "; ".join(
        f"{each.pantograph} on {each.catenary}, {each.speed_kmh[0]:g} to {each.speed_kmh[1]:g} km/h"
        for each in settings.places
    )
    plans = list(settings.plans(policy_set))
    own = f" {policy_set.description}" if policy_set.description else ""
    return (
        f"Episodes of {ENVIRONMENT}, simulated: {places}. Policies: {', '.join(policy_set.policies)}; rms of "
        f"the noise on the action: {', '.join(f'{noise:g}' for noise in policy_set.noise)}.{own} {REWARD} "
        f"Seeds {plans[0].seed} to {plans[-1].seed}; no policy was trained, selected or judged on these."
    )


def card(
    settings: EpisodesSettings,
    policy_set: PolicySet,
    rows: Sequence[tuple[Plan, Mapping[str, Any]]],
    layout: Layout,
    made_of: Mapping[str, Any],
) -> str:
    """Text of the card, as Markdown. rows: each episode's plan and its ``summary``."""
    name, steps = settings.dataset_id(policy_set), int(sum(figures["steps"] for _, figures in rows))
    lines = [
        *front_matter(name, STEPS, steps, "reinforcement-learning", ("minari", "offline-rl", "gymnasium")),
        f"# {name}",
        "",
        description(settings, policy_set),
        "",
        f"Made by panto-env {made_of['version']}, commit {made_of['commit'] or 'unknown'}, sources "
        f"{made_of['sources']}. Licence: MIT. `panto dataset verify` checks the files.",
        "",
        "| policy | noise | line | episodes | steps | return | σ (N) | mean force (N) | ended early |",
        "|---|---:|---|---:|---:|---:|---:|---:|---:|",
        *_table(settings, rows),
        "",
        "Means over whole episodes, including their start. Each row has its own seeds, and so its own lines "
        "and speeds: the table describes the data; to rank policies use `panto benchmark`.",
        "",
        f"The folder is a data set of Minari. `{STEPS}` has the same steps in one table, a row for each:",
        "",
        "| column | description |",
        "|---|---|",
        *(f"| `{each.name}` | {each.description} |" for each in COLUMNS),
        "| others | `infos` at the step's end |",
        "",
        "| | observed | value of 0 | value of 1 more |",
        "|---:|---|---:|---:|",
        *(f"| {k} | {e.name} | {e.centre:g} | {e.scale:g} {e.unit} |" for k, e in enumerate(layout.entries)),
        "",
        "`actions`: actions taken, as a share of the actuator's force limit. `infos`: row k + 1 belongs to "
        "step k, row 0 to the start; `policy_action` is the policy's action before noise was added. An "
        "episode's metadata hold policy, noise, line, speed, figures, seed and options: "
        "`env.reset(seed=seed, options=options)` and the actions reproduce it bit for bit.",
        "",
    ]
    return "\n".join(lines)


def summary(episode: Episode) -> dict[str, float]:
    """Figures of an episode that the card averages."""
    return {
        "steps": len(episode.rewards),
        "return": float(np.sum(episode.rewards)),
        "std": episode.figures["std"],
        "mean": episode.figures["mean"],
        "terminated": float(episode.terminations[-1]),
    }


def _table(settings: EpisodesSettings, rows: Sequence[tuple[Plan, Mapping[str, Any]]]) -> list[str]:
    kinds = dict.fromkeys((plan.policy, plan.noise, plan.place) for plan, _ in rows)
    lines = []
    for kind in kinds:
        own = [figures for plan, figures in rows if (plan.policy, plan.noise, plan.place) == kind]
        policy, noise, place = kind
        steps, early = (int(sum(each[name] for each in own)) for name in ("steps", "terminated"))
        means = [np.mean([each[name] for each in own]) for name in ("return", "std", "mean")]
        lines.append(
            f"| {policy} | {noise:g} | {settings.places[place].catenary} | {len(own)} | {steps:,} | "
            f"{means[0]:.1f} | {means[1]:.1f} | {means[2]:.1f} | {early} |"
        )
    return lines
