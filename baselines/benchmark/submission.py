"""A submission: a folder with a policy, what it requires, and a card that says what it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field, field_validator

from panto_env.analysis.pool import Progress
from panto_env.base.errors import InputError
from panto_env.base.files import read_toml
from panto_env.base.settings import Settings, parse

from .controls import TAPE
from .overall import Standing
from .run import Benchmark, run
from .settings import REFERENCE, BenchmarkSettings

CARD, REQUIREMENTS = "card.toml", "requirements.txt"
"""Files of a submission: its card, which it must have, and packages that its policy requires."""


class Card(Settings):
    """What a submission is, in the words of those who enter it."""

    name: str = Field(min_length=1, max_length=60)
    policy: str = Field(
        description="its file in the folder: a model file, or a Python file and its class (policy.py:Mine)"
    )
    authors: tuple[str, ...] = Field(min_length=1)
    description: str = Field(min_length=1, description="how it controls, and with which observation")
    licence: str = Field(min_length=1, description="of policy and card, as an SPDX identifier")
    learnt_from: str = Field(
        min_length=1,
        description="lines, speeds and seeds that it was trained, tuned or selected on; 'nothing' if none",
    )
    link: str | None = Field(None, description="to an article or to the code that made it")

    @field_validator("policy")
    @classmethod
    def _inside(cls, policy: str) -> str:
        file = Path(policy.partition(":")[0])
        if file.is_absolute() or ".." in file.parts:
            raise ValueError("must be a file in the folder of the card")
        return policy


@dataclass(frozen=True)
class Checked:
    """A submission as a benchmark sees it."""

    card: Card
    policy: str  # as the benchmark calls it
    requirements: tuple[str, ...]
    outcome: Benchmark

    @property
    def standing(self) -> Standing:
        """Its result over all lines, speeds and seeds."""
        return self.standing_of(self.policy)

    @property
    def tape(self) -> Standing:
        """Result of its own actions, played on other lines: what it reaches without feedback."""
        return self.standing_of(f"{TAPE}{self.policy}")

    def standing_of(self, policy: str) -> Standing:
        """Result of a policy over all lines, speeds and seeds."""
        return next(each for each in self.outcome.standings if each.policy == policy)


def read_submission(folder: str | Path) -> tuple[Card, str, tuple[str, ...]]:
    """Card, policy and requirements of a submission; nothing of it has run.

    Raises InputError, naming file and key, where it is not whole, has characters that control a terminal, or
    a link that leaves the folder.
    """
    path, required = Path(folder) / CARD, Path(folder) / REQUIREMENTS
    card = parse(Card, read_toml(path), str(path))
    file, *rest = card.policy.split(":", 1)
    source = Path(folder) / file
    if not source.is_file():
        raise InputError(f"{path} names the policy '{card.policy}', but there is no file {source}.")
    for each in (path, source, required):
        if not each.resolve().is_relative_to(Path(folder).resolve()):
            raise InputError(f"{each} is a link that leaves the folder; put the file itself there.")
    try:
        requirements = tuple(required.read_text("utf-8").split()) if required.exists() else ()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{required} could not be read: write it as text in UTF-8.") from error
    words = " ".join((*requirements, *card.authors, *(str(value) for key, value in card if key != "authors")))
    if not all(each.isprintable() or each in "\n\t" for each in words):
        raise InputError(f"{folder}: card and requirements may hold printable characters only.")
    return card, ":".join((str(source), *rest)), requirements


def check(
    folder: str | Path,
    settings: BenchmarkSettings,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Checked:
    """Run a submission as a benchmark would, beside the passive pantograph and the submission's own tape.

    settings: of the track, whose policies don't run. Raises InputError for a submission that is not whole,
    and for a policy that fails.
    """
    card, policy, requirements = read_submission(folder)
    lines = tuple(line.model_copy(update={"policies": ()}) for line in settings.lines)
    policies = (REFERENCE, policy, f"{TAPE}{policy}")
    changes = {"policies": policies, "lines": lines, "trainings": {}, "trusted": False}
    judged = settings.model_copy(update=changes)
    return Checked(card, policy, requirements, run(judged, workers, progress))


def place_among(change: float, others: Sequence[float]) -> int:
    """Rank, from 1, of a change of sigma (%) among those of other policies that are ranked."""
    return 1 + sum(other < change for other in others)
