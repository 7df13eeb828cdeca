"""What control replaces on a line, the study of three lines, and its page."""

import json
import math
from pathlib import Path

import pytest

from panto_env import simulate
from panto_env.analysis.parameters import change
from panto_env.catalog import load_catenary

pytest.importorskip("optuna")

from panto_env.studies import write
from panto_env.studies.design import Design, check, read_design, study
from panto_env.studies.design.check import AS_BUILT, CONTACT, SPACING, Replaced, Step, replaced
from panto_env.studies.permissible.scan import VERIFIED_FROM

from ..pages import DOCS, check_page, tables_of

PAGE, STORED = "design.md", DOCS / "design" / "numbers.json"
TRAIN = {"pantographs": ["dsa380", "dsa380"], "distances": [200.0], "controlled": [1, 2]}
RUN = {"catenary": "en50318-2002"} | TRAIN


def steps(*each: tuple[float, tuple[str, ...]]) -> Replaced:
    """Steps of made-up σ/F_m and requirements, beside a line of 0.4."""
    made = (Step(20e3 - 1e3 * k, 9, ratio, broken) for k, (ratio, broken) in enumerate(each))
    return Replaced(CONTACT, "pd", 0.4, tuple(made))


def test_what_is_replaced_ends_at_the_first_step_that_is_worse():
    one = steps((0.2, ()), (0.3, ("σ",)), (0.5, ()), (0.3, ()))
    assert one.equal_std == one.steps[1]
    assert one.equal_requirements == one.steps[0]
    nothing = steps((0.5, ("σ",)), (0.2, ()))
    assert nothing.equal_std is nothing.equal_requirements is None
    refused = steps((0.2, ()), (math.nan, ()))
    assert refused.equal_std == refused.equal_requirements == refused.steps[0]


@pytest.mark.slow
def test_what_control_replaces_is_what_passes_say(monkeypatch):
    """At 250 km/h on the reference line: without control, and under it with nine tenths of the tension."""
    monkeypatch.setattr(check, "SHARES", (0.9,))
    design = Design(
        variables={CONTACT: (1e4, 2e4)}, speeds_kmh=(250.0,), check_seeds=1, run=RUN | {"distance": 700.0}
    )
    contact, _, droppers = replaced(design, "repetitive")
    line = load_catenary("en50318-2002")
    given = RUN | AS_BUILT | {"mean_force": "en50367", "distance": 700.0, "seed": VERIFIED_FROM}

    def ratio(line, policy) -> float:
        run = simulate(**given | {"catenary": line}, policy=policy, speed_kmh=250, record_droppers=False)
        return max(each.std / each.mean for each in (own.summary(run.common_spans()) for own in run.train))

    assert contact.limit == pytest.approx(ratio(line, None), rel=1e-12)
    assert [step.value for step in contact.steps] == [20e3, 18e3]
    slack = change(line, CONTACT, 18e3)
    assert contact.steps[1].std_ratio == pytest.approx(ratio(slack, "repetitive"), rel=1e-12)
    assert contact.steps[0].std_ratio < contact.limit  # or the rest of this test says nothing
    counts = [step.droppers for step in droppers.steps]
    assert counts == list(range(9, 9 - len(counts), -1))
    for step in droppers.steps[1:]:
        assert len(change(line, SPACING, step.value).droppers.positions) == step.droppers


def stored() -> dict:
    return json.loads(STORED.read_text(encoding="utf-8"))


def test_the_page_shows_what_is_stored():
    outcome = study.outcome_of(stored())
    printed = {table.title: table for table in outcome.tables}
    assert set(tables_of(PAGE)) <= set(printed)
    assert len(tables_of(PAGE)) >= 3
    check_page(PAGE, printed)
    text = " ".join((DOCS / PAGE).read_text(encoding="utf-8").split())
    assert outcome.verdict in text
    assert sum(any(map(str.isalnum, word)) for word in text.split()) <= 900  # it is short


def test_what_is_stored_is_of_the_files_of_the_study():
    """Whoever changes a search must run it again."""
    numbers = stored()
    assert [case["name"] for case in numbers["cases"]] == list(study.CASES)
    for case in numbers["cases"]:
        design = read_design(study.file_of(case["name"]))
        assert (case["line"], case["policy"]) == (design.settings["catenary"], design.policy)
        assert (tuple(case["speeds_kmh"]), case["designs"]) == (design.speeds_kmh, design.designs)
        assert {name: tuple(own["range"]) for name, own in case["variables"].items()} == design.variables
        for name, own in case["variables"].items():
            assert own["start"] == pytest.approx(study.start_of(design, name))
            assert own["range"][0] <= own["best"] <= own["range"][1]
    design = read_design(study.file_of(study.FRONT))
    assert [each["seed"] for each in numbers["fronts"]] == list(study.FRONT_SEEDS)
    assert {each["designs"] for each in numbers["fronts"]} == {design.designs}


SHORT = """
speeds_kmh = [220, 230, 240, 250, 260]
designs = 12
check_policies = ["agent-any-pantograph"]
check_seeds = 1
[variables]
"catenary.contact_wire.tension" = [18e3, 25e3]
"catenary.droppers.spacing" = [4.5, 9.0]
[run]
catenary = "benchmark-2015"
pantographs = ["dsa380", "dsa380"]
distances = [60]
controlled = [1, 2]
distance = 900
accuracy = "fast"
"""


@pytest.mark.slow
def test_the_study_on_one_line(monkeypatch, tmp_path):
    for name, text in {"one": SHORT, "front": f'objectives = ["std_ratio", "tension"]\n{SHORT}'}.items():
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    for name, value in {"CASES": ("one",), "RETROFITTED": ("one",), "FRONT_SEEDS": (0, 1)}.items():
        monkeypatch.setattr(study, name, value)
    monkeypatch.setattr(study, "file_of", lambda name: Path(tmp_path / f"{name}.toml"))
    monkeypatch.setattr(check, "SHARES", (0.9,))
    outcome = study.run(lambda what, share: None)
    bought, _, values, slackened = outcome.tables
    (row,) = bought.cells
    case = outcome.numbers["cases"][0]
    assert row[:2] == ("one", "agent-any-pantograph")
    (start,) = (each for each in case["checked"] if (each["design"], each["policy"]) == ("start", "passive"))
    assert row[2] == f"{start['held_out']['std_ratio']:.2f}"
    assert [cells[0] for cells in values.cells] == list(case["variables"])
    assert len(slackened.cells) == 3
    written = write(outcome, tmp_path / "out")
    again = study.outcome_of(json.loads(written[0].read_text(encoding="utf-8")))
    assert [table.cells for table in again.tables] == [table.cells for table in outcome.tables]
    assert again.verdict == outcome.verdict
