"""Cards of the stored agents, in the form of model hubs: `make cards`, or ``python -m tests.cards``.

What an agent is comes from its model file, what it can from the stored results of the benchmark, and where it
fails from its section of docs/agents.md.
"""

from __future__ import annotations

import re
import sys
import tomllib
from functools import cache

from huggingface_hub import EvalResult, ModelCardData

from panto_agents.policy import load
from panto_agents.stored import FOLDER
from panto_baselines.benchmark.run import read_result
from panto_env.base.files import write_whole

from .documents import ROOT

RESULTS = ROOT / "docs" / "benchmark"
LIBRARY = "panto-env"
ADDRESS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["urls"]["Homepage"]
CHANGE = "change of the contact force's standard deviation against a passive pantograph (%)"


def agents():
    """Names of the stored agents, such as "any-line"."""
    return sorted(path.stem for path in FOLDER.glob("*.safetensors"))


def card(name):
    """The whole card of an agent, as Markdown."""
    policy, facts = f"agent-{name}", load(FOLDER / f"{name}.safetensors").facts
    data = ModelCardData(
        license="mit",
        library_name=LIBRARY,
        pipeline_tag="reinforcement-learning",
        tags=["reinforcement-learning", "gymnasium", "control", "railway", "pantograph", facts.algorithm],
        model_name=policy,
        eval_results=_results(policy) or None,
    )
    environment = "\n".join(f"| `{key}` | `{value}` |" for key, value in facts.environment.items())
    for number, changes in enumerate(facts.variants, start=1):
        values = ", ".join(f"{key}={value!r}" for key, value in changes.items())
        environment += f"\n| variant {number} | `{values}` |"
    return f"""---
{data.to_yaml()}
---

# {policy}

A controller of a train's pantograph, trained in [panto-env]({ADDRESS}), and part of it:

```
pip install '{LIBRARY}[agents]'
panto evaluate {policy}    # beside a passive pantograph, as in its training
```

{_section(policy)}

## How it was trained

`{facts.algorithm}`, {facts.steps:,} environment steps, seed {facts.seed}, at commit `{facts.commit}`
{f"by `{facts.command}`" if facts.command else ""}. Lines, noise and speeds come from seeds for training;
figures above are from others.

| argument of the environment | |
| --- | --- |
{environment}

## Limits

It was trained and judged in simulation alone; nobody has run it on a train. It learnt from no data of others.
Licence: MIT.
"""


def _results(policy):
    """The agent's results in all stored tracks, for the front matter."""
    found = []
    for track, result in _tracks().items():
        for standing in result.standings:
            if standing.policy == policy and not standing.disqualified:
                found.append(
                    EvalResult(
                        task_type="reinforcement-learning",
                        dataset_type=f"panto-benchmark-{track}",
                        dataset_name=f"panto benchmark: {result.title}",
                        metric_type="sigma-change",
                        metric_name=CHANGE,
                        metric_value=round(standing.change, 1),
                    )
                )
    return found


@cache
def _tracks():
    return {path.name.partition(".")[0]: read_result(path) for path in sorted(RESULTS.glob("*.json.gz"))}


def _section(policy):
    """What docs/agents.md says of an agent; links lead into the documents."""
    text = (ROOT / "docs" / "agents.md").read_text(encoding="utf-8")
    section = re.search(rf"### {policy}\n\n(.*?)(?=\n#)", text, re.DOTALL)[1].strip()
    return re.sub(r"\]\((?!http)([^)]*)\)", rf"]({ADDRESS}/docs/\1)", section)


def main():
    """Write all cards."""
    for name in agents():
        with write_whole(FOLDER / f"{name}.md") as temporary:
            temporary.write_text(card(name), encoding="utf-8")
        print(f"agents/models/{name}.md", file=sys.stderr)


if __name__ == "__main__":
    main()
