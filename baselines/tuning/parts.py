"""A tuning stored speed by speed beside its file of gains, so that an interrupted one can continue."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from panto_env.analysis.pool import Progress
from panto_env.base.checksums import read_checked, write_checked
from panto_env.base.files import alone_in
from panto_env.cluster import spread
from panto_env.cluster.parts import identity, open_parts
from panto_env.control.settings import RunSettings

from .tune import PASSES, SEEDS, SPEEDS_KMH, Tuned, tunable, tune_at


def parts_of(gains: Path) -> Path:
    """Hidden folder that holds the tuned speeds until they are stored in the file of gains."""
    return gains.with_name(f".{gains.stem}-parts")


def tune(
    folder: Path,
    policy: str,
    settings: RunSettings,
    speeds_kmh: Sequence[float] = SPEEDS_KMH,
    seeds: int = SEEDS,
    passes: int = PASSES,
    *,
    workers: int | None = None,
    ray: str | None = None,
    progress: Progress | None = None,
) -> list[Tuned]:
    """Tune a policy for the settings' line, pantograph, actuator and sensors, at each speed.

    Each speed is written to the folder once it is done; speeds that are there already are not tuned again.
    seeds, passes: see ``tune_at``. workers, ray: see ``spread``; the gains do not depend on them. Raises
    InputError for a policy without gains, if the folder holds parts of another tuning or a damaged one, and
    if another process is tuning into it.
    """
    tunable(policy)
    made_of = {"policy": policy, "seeds": seeds, "passes": passes} | settings.model_dump(mode="json")
    with alone_in(folder, "tunes into"):
        open_parts(folder, identity("tuning", made_of))
        parts = {speed: folder / f"{speed!r}.json" for speed in speeds_kmh}
        missing = [speed for speed, path in parts.items() if not path.is_file()]
        kept = len(parts) - len(missing)
        if progress is not None:
            progress(kept, len(parts))
        spread(
            [partial(tune_at, policy, settings, speed, seeds, passes) for speed in missing],
            workers=workers,
            ray=ray,
            progress=None if progress is None else lambda done, _: progress(kept + done, len(parts)),
            take=lambda place, tuned: write_checked(parts[missing[place]], asdict(tuned)),
        )
        return [_read(path) for path in parts.values()]


def _read(path: Path) -> Tuned:
    values: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in read_checked(path).items()
    }
    return Tuned(**values)
