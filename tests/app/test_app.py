"""The page of ``panto app``: what it shows is what Python and the command say, and an error ends nothing."""

import contextlib
import html
import importlib.metadata
import io
import json
import re
import shlex
from functools import partial

import pytest

from panto_env import InputError, simulate

pytest.importorskip("bokeh", reason="the extra 'app' is not installed")

from bokeh.document import Document

from panto_env.app import page
from panto_env.app.charts import COLOURS
from panto_env.app.choice import TITLES, Choice, look, offered
from panto_env.base.files import finite

from ..command import panto
from ..documents import Command, check
from ..pages import DOCS

QUICK = Choice("periodic-stiffness", "three-mass", 200)
TOO_FAST = Choice(speed_kmh=450)


@pytest.mark.longer
def test_the_code_and_the_command_are_the_run_that_is_shown():
    choice = QUICK._replace(policy="p", hardware="realistic", line_condition="fair", seed=3)
    seen = look(choice)
    names, printed = {}, io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(choice.texts["Python"], names)
    assert names["run"].summary() == seen.found.figures
    assert len(seen.requirements) == len(printed.getvalue().splitlines()) - 1 > 5
    done = panto(*shlex.split(choice.texts["command"])[1:], "--json")
    assert json.loads(done.stdout)["figures"] == finite(seen.found.figures.as_dict())
    for text in choice.texts.values():
        if text.startswith("panto "):
            check(Command("the page", 0, True, text))


def test_arguments_are_those_without_a_default_value():
    assert QUICK.arguments == {"catenary": "periodic-stiffness", "pantograph": "three-mass", "speed_kmh": 200}
    other = QUICK._replace(policy="pd", hardware="realistic", mean_force="en50367", seed=1)
    more = {
        "policy": "pd",
        "mean_force": "en50367",
        "seed": 1,
        "actuator": "realistic",
        "sensors": "realistic",
    }
    assert other.arguments == QUICK.arguments | more
    assert list(Choice._fields) == list(TITLES)


def test_bad_choices_are_errors_of_one_sentence():
    with pytest.raises(InputError) as refused:
        simulate(**TOO_FAST.arguments)
    assert look(TOO_FAST).error == str(refused.value)
    alone = look(QUICK._replace(policy="front-preview"))
    assert "no controlled one has any in front of it" in alone.error
    assert (alone.found, alone.requirements) == (None, [])
    early = look(Choice(speed_kmh=400))
    assert re.fullmatch(r"The run ended early at .* It has no figures\.", early.error)
    assert early.found.run.terminated


def test_no_code_is_run_that_was_not_offered(tmp_path):
    file = tmp_path / "policy.py"
    file.write_text("raise SystemExit('it ran')")
    assert look(QUICK._replace(policy=f"{file}:Mine")).error.startswith("Policy: known are passive, adaptive")
    groups = offered()["policy"]
    assert sum(len(names) for names in groups.values()) == len(offered()["policy"]["agents"]) + 17
    assert all(name.startswith("agent-") for name in groups["agents"])


def test_warnings_of_a_run_are_told():
    seen = look(Choice("re250-stitched", speed_kmh=200))
    assert [each[:40] for each in seen.warnings] == ["Waves travel far along a line with stitc"]
    assert '<p class="warning">Waves travel far' in page.status([seen], running=False)


class Worker:
    """Runs what is submitted when the test says so, in the test's own thread."""

    def __init__(self):
        self.waiting = []

    def submit(self, call, *given):
        self.waiting.append(partial(call, *given))


class Opened:
    """A page, and what is on it."""

    def __init__(self):
        self.document, self.worker, self.later = Document(), Worker(), []
        self.document.add_next_tick_callback = self.later.append
        self.page = page.Page(self.document, self.worker)
        self.choose(catenary=QUICK.catenary, pantograph=QUICK.pantograph, speed_kmh=QUICK.speed_kmh)

    def choose(self, **values):
        for name, value in values.items():
            self.control(name).value = value

    def control(self, name):
        (found,) = [each for each in self.document.models if name in getattr(each, "css_classes", ())]
        return found

    def text(self, name):
        return self.document.get_model_by_name(name).text

    def curve(self, name):
        chart = self.document.get_model_by_name("force")
        return next(
            each.data_source.data["y"]
            for each in chart.renderers
            if getattr(each.glyph, "line_color", "") == COLOURS[name]
        )

    def see(self):
        for queue in (self.worker.waiting, self.later):
            while queue:
                queue.pop(0)()
        return self.text("status")


def shown(opened, key):
    """Values of a figure of the table, without control and with."""
    row = re.findall(rf'<tr data-key="{key}">(.*?)</tr>', opened.text("tables"), re.DOTALL)[-1]
    return [float(value) for value in re.findall(r"<td>([-\d.]+)</td>", row)]


@pytest.mark.longer
def test_a_choice_changes_the_figures_and_an_error_ends_nothing():
    opened = Opened()
    assert "200 km/h, passive: " in opened.see()
    figures = look(QUICK).found.figures
    assert shown(opened, "std") == [pytest.approx(figures.std, abs=0.005)]
    opened.choose(speed_kmh=210, policy="p")
    assert "210 km/h, p: " in opened.see()
    found = [look(QUICK._replace(speed_kmh=210, policy=policy)).found for policy in ("passive", "p")]
    assert shown(opened, "std") == pytest.approx([one.figures.std for one in found], abs=0.005)
    assert len(opened.curve("policy")) == found[1].inside.sum()
    for _, each in look(QUICK._replace(speed_kmh=210, policy="p")).requirements:
        assert html.escape(each.heading) in opened.text("tables")
    opened.choose(policy="mpc")
    assert '<p class="error">The policy &#x27;mpc&#x27; ' in opened.see()
    assert len(shown(opened, "std")) == 1
    opened.choose(catenary="re250", policy="passive", speed_kmh=450)
    assert "below the wave speed of the contact wire" in opened.see()
    assert (opened.text("tables").strip(), len(opened.curve("passive"))) == ("", 0)
    opened.choose(catenary=QUICK.catenary, speed_kmh=200)
    assert "200 km/h, passive: " in opened.see()
    assert shown(opened, "std") == [pytest.approx(figures.std, abs=0.005)]


@pytest.mark.longer
def test_a_part_that_is_zoomed_into_stays_in_view_until_another_line_is_chosen():
    opened = Opened()
    opened.see()
    view = opened.document.get_model_by_name("force").x_range
    whole = view.start, view.end
    view.update(start=300.0, end=400.0)
    opened.choose(speed_kmh=210)
    opened.see()
    assert (view.start, view.end) == (300.0, 400.0)
    opened.choose(catenary="re250")
    opened.see()
    longer = view.start, view.end
    assert longer != whole
    assert longer[1] - longer[0] > 500
    opened.choose(catenary=QUICK.catenary)
    opened.see()
    assert (view.start, view.end) == whole


@pytest.mark.longer
def test_only_the_last_of_several_choices_is_run(monkeypatch):
    opened, run = Opened(), []
    opened.see()
    monkeypatch.setattr(page, "passively", lambda choice: run.append(choice) or look(choice))
    for speed in (210, 220, 230):
        opened.choose(speed_kmh=speed)
    assert "230 km/h" in opened.see()
    assert [each.speed_kmh for each in run] == [230]


@pytest.mark.longer
def test_a_run_under_a_policy_stops_when_something_else_is_chosen(monkeypatch):
    opened, shares = Opened(), []

    def look_and_change(choice, progress):
        for share in (0.1, 0.2, 0.3):
            shares.append(share)
            progress(share)
            opened.choose(speed_kmh=240)

    opened.choose(policy="p")
    monkeypatch.setattr(page, "look", look_and_change)
    opened.worker.waiting.pop()()
    assert shares == [0.1, 0.2]
    assert opened.page._wanted.speed_kmh == 240


def test_a_fault_of_the_program_is_shown_and_the_page_goes_on(monkeypatch, capsys):
    opened = Opened()
    with monkeypatch.context() as patch:
        patch.setattr(page, "passively", lambda choice: 1 / 0)
        assert "ZeroDivisionError: division by zero; the terminal has more." in opened.see()
    assert "ZeroDivisionError" in capsys.readouterr().err
    opened.choose(speed_kmh=210)
    assert "210 km/h, passive: " in opened.see()


def test_what_the_command_cannot_do_is_one_sentence(monkeypatch):
    def taken(*_, **__):
        raise OSError(98, "Address already in use")

    monkeypatch.setattr(page, "Server", taken)
    done = panto("app", "--no-browser")
    assert (done.returncode, done.stdout) == (2, "")
    words = "Port 5006 cannot be had (Address already in use); give another one: --port."
    assert done.stderr == f"panto: {words}\n"


def test_the_extra_weighs_what_the_document_says():
    text = (DOCS / "app.md").read_text(encoding="utf-8")
    packages = re.search(r"\((bokeh, .*?)\)", text)[1].split(", ")
    bytes_ = sum(file.size or 0 for name in packages for file in importlib.metadata.files(name))
    assert int(re.search(r"(\d+) MB", text)[1]) == pytest.approx(bytes_ / 1e6, rel=0.1)
