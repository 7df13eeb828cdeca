"""The page: its controls, what they show, and the server that gives it to the browser."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import lru_cache, partial
from html import escape
from importlib.resources import files
from typing import Any

from bokeh.document import Document
from bokeh.layouts import column
from bokeh.models import CustomJS, InlineStyleSheet
from bokeh.models.widgets import Button, Div, PreText, Select, Slider, Spinner
from bokeh.server.server import Server
from jinja2 import Environment, StrictUndefined

from ..base.errors import InputError
from ..base.table import number
from ..metrics.compliance import limits_in_words, value_in_words
from ..metrics.figures import LABELS, in_words
from .charts import LEGEND, Charts
from .choice import PASSIVE, TITLES, Choice, Seen, look, offered

HOST = "127.0.0.1"  # only browsers of this machine reach the page
SPEEDS = 80, 450, 5  # lowest and highest speed of the slider, and its step (km/h)
FIGURES = ("mean", "std", "max", "min", "max_uplift", "contact_loss", "effort")  # figures in the page's table
WIDE: dict[str, Any] = {"sizing_mode": "stretch_width"}
EVERY = 0.2  # least time between two messages about the progress of a run (s)
passively = lru_cache(maxsize=2)(look)
"""``look`` for runs without control: when only the policy changes, its run is there at once."""


class SupersededError(Exception):
    """Something else was chosen during the run."""


class Page:
    """The page of one tab of a browser. Runs are made in the worker, one after another, for all tabs."""

    def __init__(self, document: Document, worker: ThreadPoolExecutor) -> None:
        self._document, self._worker = document, worker
        self._wanted: Choice | None = None
        self._told = 0.0
        self._charts = Charts()
        usual: dict[str, Any] = WIDE | {"stylesheets": [InlineStyleSheet(css=_text("style.css"))]}
        self._status, self._tables = (Div(disable_math=True, **usual) for _ in range(2))
        self._say("The first run loads the compiled kernels.")
        self._controls = _controls()
        for control in self._controls.values():
            control.on_change("value", lambda attr, old, new: self._changed())
        self._texts = {name: PreText(css_classes=["text"], **usual) for name in Choice().texts}
        copied = []
        for name, text in self._texts.items():
            button = Button(label=f"Copy the {name}", align="start")
            code = "navigator.clipboard.writeText(text.text)"
            button.js_on_event("button_click", CustomJS(args={"text": text}, code=code))
            copied += [button, text]
        roots = {name: getattr(self._charts, name) for name in ("force", "uplift", "spectrum")}
        roots |= {"controls": column(list(self._controls.values()), **WIDE), "texts": column(copied, **WIDE)}
        roots |= {"status": self._status, "tables": self._tables}
        for name, root in roots.items():
            root.name = name
            document.add_root(root)
        document.title = "panto: one pass"
        document.template = _text("page.html.jinja")  # type: ignore[assignment]  # a text is one, too
        document.template_variables["legend"] = LEGEND
        document.on_session_destroyed(self._close)
        self._changed()

    def _close(self, _: Any) -> None:
        self._wanted = None

    def _changed(self) -> None:
        """Show what is chosen as texts, and have it run."""
        choice = Choice(**{name: control.value for name, control in self._controls.items()})
        self._wanted = choice
        for name, text in choice.texts.items():
            self._texts[name].text = text
        self._worker.submit(self._run, choice)

    def _run(self, choice: Choice) -> None:
        """In the worker: run a choice, without control first, and show each run as soon as it is there."""
        try:
            self._check_wanted(choice)
            passive = passively(choice._replace(policy=PASSIVE))
            if choice.policy == PASSIVE:
                self._later(choice, self._show, passive, passive)
                return
            self._later(choice, self._show, passive, None)
            own = look(choice, partial(self._progress, choice))
            self._later(choice, self._show, passive, own)
        except SupersededError:
            pass
        except Exception as error:  # a fault of the program: the page says so, and goes on
            traceback.print_exc()
            self._later(choice, self._say, f"{type(error).__name__}: {error}; the terminal has more.")

    def _check_wanted(self, choice: Choice) -> None:
        if choice is not self._wanted:
            raise SupersededError

    def _progress(self, choice: Choice, share: float) -> None:
        self._check_wanted(choice)
        if time.monotonic() > self._told + EVERY:
            self._told = time.monotonic()
            self._later(choice, self._say, f"Running {choice.policy}: {100 * share:.0f} %")

    def _later(self, choice: Choice, show: Callable[..., None], *given: Any) -> None:
        """Call a method in the thread of the page, which alone may change it, if the choice still stands."""

        def call() -> None:
            if choice is self._wanted:
                show(*given)

        self._document.add_next_tick_callback(call)

    def _say(self, text: str) -> None:
        self._status.text = f"<p>{escape(text)}</p>"

    def _show(self, passive: Seen, own: Seen | None) -> None:
        """Show a run without control, and the chosen one; None: that is still running."""
        runs = {"passive": passive} | ({"policy": own} if own and own is not passive else {})
        self._charts.show({name: seen.found for name, seen in runs.items() if seen.found is not None})
        self._tables.text = tables(list(runs.values()))
        self._status.text = status(list(runs.values()), own is None)


VERDICTS = ("kept", "broken", "not judged")


def status(runs: list[Seen], running: bool) -> str:
    """Errors, warnings and the verdict on the last run, as HTML; running: whether another one follows."""
    last = runs[-1]
    lines = [("error", sentence) for sentence in dict.fromkeys(seen.error for seen in runs) if sentence]
    warned = dict.fromkeys(words for seen in runs for words in seen.warnings)
    lines += [("warning", words) for words in warned]
    if running:
        lines.append(("", "The policy is running."))
    elif last.requirements:
        kept, *others = (
            [each.name for _, each in last.requirements if each.verdict == verdict] for verdict in VERDICTS
        )
        words = f"{last.choice.title}: {len(kept)} of {len(last.requirements)} requirements kept"
        for verdict, names in zip(VERDICTS[1:], others, strict=True):
            words += f"; {verdict}: {', '.join(names)}" if names else ""
        lines.append(("verdict broken" if others[0] else "verdict", f"{words}."))
    return "".join(f'<p class="{kind}">{escape(text)}</p>' for kind, text in lines)


def tables(runs: list[Seen]) -> str:
    """Requirements and figures of runs, the first without control, as HTML; nothing of those without any."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    words = {"limits": limits_in_words, "value": value_in_words, "in_words": in_words}
    environment.filters |= words | {"number": partial(number, digits=2)}
    labels = {name: LABELS[name] for name in FIGURES}
    judged = [seen for seen in runs if seen.requirements]
    return environment.from_string(_text("tables.html.jinja")).render(runs=judged, labels=labels)


def _controls() -> dict[str, Any]:
    """A control for each field of a choice, in the order of the fields."""
    usual, (low, high, step) = Choice(), SPEEDS
    names: dict[str, Any] = offered()
    found: dict[str, Any] = {}
    for name, title in TITLES.items():
        value = getattr(usual, name)
        if name == "speed_kmh":
            found[name] = Slider(title=title, start=low, end=high, step=step, value=value)
        elif name == "seed":
            found[name] = Spinner(title=title, low=0, high=10**6, mode="int", value=value)
        else:
            found[name] = Select(title=title, options=names[name], value=value)
        found[name].update(css_classes=[name], **WIDE)
    return found


def _text(name: str) -> str:
    return (files("panto_env.app") / "templates" / name).read_text(encoding="utf-8")


def serve(port: int, ready: Callable[[str], None]) -> None:
    """Serve the page to browsers of this machine until an interrupt; ready: called with the page's address.

    Raises InputError where the port is taken.
    """
    worker = ThreadPoolExecutor(1)

    def opened(document: Document) -> None:
        Page(document, worker)

    try:
        # A page of somebody else's in the same browser is refused, since its origin is another one.
        origins = [f"{HOST}:{port}", f"localhost:{port}"]
        server = Server(opened, address=HOST, port=port, allow_websocket_origin=origins)
    except OSError as error:
        reason = f"Port {port} cannot be had ({error.strerror})"
        raise InputError(f"{reason}; give another one: --port.") from error
    worker.submit(passively, Choice())  # the kernels are loaded while the browser starts
    server.start()
    ready(f"http://{HOST}:{port}/")
    with suppress(KeyboardInterrupt):  # how one ends it
        server.io_loop.start()
    server.stop()
    worker.shutdown(cancel_futures=True)
