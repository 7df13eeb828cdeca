"""What the pages of environments say of spaces, arguments and versions: made of the code each time."""

import inspect
import re
from pathlib import Path
from typing import Any

import gymnasium
from sphinx.application import Sphinx

from panto_env.control.settings import default, fields
from panto_env.envs import BARE, IDS, PantographEnv
from panto_env.envs.settings import EnvironmentSettings, VectorSettings

DOCS = Path(__file__).parents[1]
NOTEBOOKS = sorted((DOCS.parent / "examples").glob("*.ipynb"))
GENERATED = "generated"
"""Name of the folders, beside the pages that include them, which are not kept."""


def sections() -> dict[str, str]:
    """The text under each heading of the class's docstring."""
    parts = re.split(r"^## (.+)\n", inspect.cleandoc(PantographEnv.__doc__ or ""), flags=re.MULTILINE)
    return dict(zip(parts[1::2], (text.strip() for text in parts[2::2]), strict=True))


def table(headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A table in Markdown."""
    escaped = [[cell.replace("|", "\\|").replace("\n", " ") for cell in row] for row in rows]
    lines = [headings, ["---"] * len(headings), *escaped]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def heads(name: str, env: PantographEnv) -> str:
    """The table at the top of a page, as Gymnasium's pages have it."""
    rows = [
        ("Action space", f"`{env.action_space}`"),
        ("Observation space", f"`{env.observation_space}`"),
        ("Control step", f"{1e3 * env.task.length.control_interval:g} ms"),
        ("Import", f'`gymnasium.make("panto_env:{name}")`'),
        ("Many at once", f'`gymnasium.make_vec("panto_env:{name}", num_envs=64)`'),
    ]
    return table(("", ""), rows)


def entries(env: PantographEnv) -> str:
    """The entries of an observation."""
    layout = env.context.layout
    rows = [
        (str(k), entry.name, f"{entry.centre:g}", f"{entry.scale:g}", entry.unit)
        for k, entry in enumerate(layout.entries)
    ]
    return table(("Entry", "Meaning", "Counted from", "Scale", "Unit"), rows)


def said(value: Any) -> str:
    """A value as code."""
    return f"`{value!r}`"


def arguments(name: str) -> str:
    """All arguments, with what this id has for each."""
    own = IDS[name]
    rows = [
        (f"`{key}`", said(own.get(key, field.get_default())), field.description or "")
        for key, field in fields(EnvironmentSettings).items()
    ]
    return table(("Argument", f"In {name}", "Meaning"), rows)


def vector_arguments() -> str:
    """Those that the vector environment alone has."""
    rows = [
        (f"`{key}`", said(field.get_default()), field.description or "")
        for key, field in fields(VectorSettings).items()
        if key not in fields(EnvironmentSettings) or key == "render_mode"
    ]
    return table(("Argument", "Default", "Meaning"), rows)


def differences(name: str) -> str:
    """What this id sets other than the class's defaults."""
    rows = [(f"`{key}`", said(value), said(default(key))) for key, value in IDS[name].items()]
    return table(("Argument", "Here", "Default of the class"), rows)


def part(name: str) -> str:
    """All that is generated of one id's page."""
    env = gymnasium.make(name).unwrapped
    assert isinstance(env, PantographEnv)
    env.reset(seed=0)
    text = sections()
    observation = (
        f"`{env.observation_space}`: each entry is (value - what it is counted from) / scale, "
        "clipped to ±10.\n\n"
        f"{entries(env)}\n\n"
        "Other arguments of `observation`, and `harmonics`, `history` and `normalise`, add to it or take its "
        "place; `env.unwrapped.context.layout` names the entries of any."
    )
    parts = {
        "What this id sets": differences(name),
        "Action space": text["Action Space"],
        "Observation space": observation,
        "Rewards": text["Rewards"],
        "Starting state": text["Starting State"],
        "Episode end": text["Episode End"],
        "Info": text["Info"],
        "Arguments": f"{arguments(name)}\n\n`reset(options=...)` takes the same for one episode, but those "
        "that change a space.",
        "Arguments of the vector environment": f"Besides these:\n\n{vector_arguments()}",
        "Copies": text["Copies"],
        "Version history": text["Version History"],
    }
    return "\n\n".join((heads(name, env), *(f"## {title}\n\n{body}" for title, body in parts.items()))) + "\n"


def write(app: Sphinx) -> None:
    """Write the parts, where they are not as they should be."""
    bare = [(f"`{name}`", said(value)) for name, value in BARE.items()]
    environments = DOCS / "environments" / GENERATED
    wanted = {environments / f"{name}.md": part(name) for name in IDS} | {
        environments / "bare.md": table(("Argument", "Value"), bare),
        # Sphinx takes no page from elsewhere.
        **{DOCS / path.name: path.read_text(encoding="utf-8") for path in NOTEBOOKS},
    }
    for path, text in wanted.items():
        path.parent.mkdir(exist_ok=True)
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
