"""The head of a data set's card, by which a model hub finds the file and says what it is."""

from __future__ import annotations

import json
import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from panto_env.control.observation import Layout
from panto_env.metrics.figures import LABELS

from .designs import FIGURES, DesignsSettings
from .episodes import COLUMNS, STEPS, Episode
from .settings import ENVIRONMENT, EpisodesSettings, Plan, PolicySet

SIZES = ((1e3, "n<1K"), (1e4, "1K<n<10K"), (1e5, "10K<n<100K"), (1e6, "100K<n<1M"), (1e7, "1M<n<10M"))
"""Names of sizes on hubs, by the number of rows that they are below."""


def front_matter(title: str, file: str, rows: int, task: str, tags: Sequence[str]) -> list[str]:
    """Lines of YAML for the head of a card (Hugging Face, dataset card metadata).

    file: the Parquet table beside the card. rows: of it. task: a category that hubs know.
    """
    size = next((name for limit, name in SIZES if rows < limit), "10M<n<100M")
    return [
        "---",
        f"pretty_name: {json.dumps(title)}",
        "license: mit",
        f"task_categories: [{task}]",
        f"size_categories: [{size}]",
        f"tags: [{', '.join((*tags, 'railway', 'pantograph', 'simulation'))}]",
        f"configs: [{{config_name: default, data_files: {file}}}]",
        "---",
        "",
    ]


def made_by(made_of: Mapping[str, Any]) -> list[str]:
    """Lines that say what made the data, by its identity."""
    return [
        f"Made by panto-env {made_of['version']}, commit {made_of['commit'] or 'unknown'}, sources "
        f"{made_of['sources']}. Licence: MIT. `panto dataset verify` checks the files.",
        "",
    ]


TABLE = "designs.parquet"  # name of the table in its folder


class Column(NamedTuple):
    """A column of the table."""

    name: str
    kind: str  # Arrow type
    description: str  # with the unit, and the range of a drawn parameter


def columns(settings: DesignsSettings) -> list[Column]:
    """All columns, in order."""
    figures = [(name, LABELS[name]) for name in FIGURES]
    drawn = [
        Column(name, "float64", f"{settings.label(name)}, drawn from {low:g} to {high:g}")
        for name, (low, high) in settings.ranges.items()
    ]
    return [
        Column("design", "int64", "number of the design, from 0"),
        *drawn,
        Column("refused", "string", "why no line or pantograph has these values; empty if they were run"),
        Column("ending", "string", "where and why the run ended early; empty if it did not"),
        Column("accuracy_warning", "string", "why figures are less accurate; empty if they are not"),
        Column("nominal_force", "float64", "static and aerodynamic uplift force (N)"),
        Column("wave_speed", "float64", "wave speed of the contact wire (m/s)"),
        Column("time_step", "float64", "time step of the computation (s)"),
        Column("spacing", "float64", "spacing of the computation's grid (m)"),
        *(Column(name, "float64", f"{each.name} ({each.si or each.unit})") for name, each in figures),
    ]


def card_of_designs(
    settings: DesignsSettings, shown: Sequence[Column], table: Any, made_of: Mapping[str, Any]
) -> str:
    """Text of the card, as Markdown. shown: columns to describe. table: Arrow table."""
    lines = [
        *front_matter(settings.title, TABLE, table.num_rows, "tabular-regression", ("surrogate-model",)),
        f"# {settings.title}",
        "",
        f"{table.num_rows:,} designs around the pantograph {settings.pantograph} on the line "
        f"{settings.catenary}, each simulated once: a passive pantograph along a new line, as designed, "
        "without irregularity, sensors or control. Figures are those of EN 50317 over the spans after the "
        "start has died out.",
        "",
        f"Drawn by a scrambled Sobol sequence (seed {settings.seed}), evenly over the ranges. If a span "
        "is longer or shorter, droppers keep their positions relative to it. Parameters without a range are "
        "as in the catalogue.",
        "",
        *made_by(made_of),
        "| column | description | minimum | median | maximum |",
        "|---|---|---:|---:|---:|",
        *(f"| `{each.name}` | {each.description} | {_spread(table, each)} |" for each in shown),
        "",
        "No design is left out: one that was refused, or whose run ended early, has a row that says so.",
        "",
        *_endings(table, "refused", "refused"),
        *_endings(table, "ending", "ended early"),
        *_endings(table, "accuracy_warning", "with a warning"),
        "",
        "Caveats: simulated, not measured; grid and time step are chosen so that the standard deviation is "
        "within 1 % of its converged value up to 95 % of the wave speed, where no warning says more; a model "
        "that is fitted to it knows nothing beyond the ranges, nor of other kinds of line (stitched, with "
        "pre-sag), several pantographs, wind, or irregularity.",
        "",
    ]
    return "\n".join(lines)


def _spread(table: Any, column: Column) -> str:
    if column.kind != "float64":
        return "| | "
    values = table[column.name].drop_null().to_numpy()
    if not len(values):
        return "– | – | –"
    return " | ".join(f"{float(f'{each:.4g}'):g}" for each in (values.min(), np.median(values), values.max()))


def _endings(table: Any, column: str, words: str) -> list[str]:
    """Reasons of a column with their counts; texts that differ only in numbers count as one reason."""
    texts = [text for text in table[column].to_pylist() if text]
    kinds = [re.sub(r"[-+]?\d[\d.e+-]*", "#", text) for text in texts]
    first = dict(zip(reversed(kinds), reversed(texts), strict=True))  # text of each kind
    counts = Counter(first[kind] for kind in kinds)
    head = f"- {len(texts):,} of {table.num_rows:,} {words} (`{column}`){':' if texts else '.'}"
    return [head, *(f"  - {each:,} such as: {text}" for text, each in counts.most_common())]


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


def card_of_episodes(
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
        *made_by(made_of),
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
        *(f"| `{name}` | {meaning} |" for name, meaning in COLUMNS.items()),
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
    kinds = defaultdict(list)
    for plan, figures in rows:
        kinds[plan.policy, plan.noise, plan.place].append(figures)
    lines = []
    for (policy, noise, place), own in kinds.items():
        steps, early = (int(sum(each[name] for each in own)) for name in ("steps", "terminated"))
        means = [np.mean([each[name] for each in own]) for name in ("return", "std", "mean")]
        lines.append(
            f"| {policy} | {noise:g} | {settings.places[place].catenary} | {len(own)} | {steps:,} | "
            f"{means[0]:.1f} | {means[1]:.1f} | {means[2]:.1f} | {early} |"
        )
    return lines
