"""Episodes written as a Minari data set, read back like libraries for offline learning do, and replayed.

    python examples/offline_data.py

printed

    pantograph/known-line/tuned-pd-v0: 2 episodes, 1,309 steps, returns -802.5 and -684.8
    replayed from seed and actions: the same rewards to the last bit
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numpy as np

from panto_baselines.dataset.make import make_episodes
from panto_baselines.dataset.settings import chosen, load_episodes


def main() -> tuple[list[float], bool]:
    """Returns of the episodes, and whether the first one, replayed, has the same rewards."""
    settings = chosen(load_episodes("dataset-known-line"), ("tuned-pd",))
    few = settings.sets[0].model_copy(update={"episodes": 2})
    with tempfile.TemporaryDirectory() as folder:
        made = make_episodes(settings.model_copy(update={"sets": (few,)}), Path(folder), workers=1)[0]
        os.environ["MINARI_DATASETS_PATH"] = folder
        import minari  # reads the path above

        data = minari.load_dataset(made.dataset_id)
        returns = [float(episode.rewards.sum()) for episode in data]
        values = " and ".join(f"{each:.1f}" for each in returns)
        print(f"{data.id}: {len(data)} episodes, {data.total_steps:,} steps, returns {values}")
        first, facts = data[0], next(iter(data.storage.get_episode_metadata([0])))
        env = data.recover_environment()
        env.reset(seed=facts["seed"], options=facts.get("options"))
        same = bool(np.array_equal([env.step(action)[1] for action in first.actions], first.rewards))
    print(f"replayed from seed and actions: {'the same rewards to the last bit' if same else 'it differs'}")
    return returns, same


if __name__ == "__main__":
    main()
