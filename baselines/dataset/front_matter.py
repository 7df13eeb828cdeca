"""The head of a data set's card, by which a model hub finds the file and says what it is."""

from __future__ import annotations

import json
from collections.abc import Sequence

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
