"""Permissible speeds: what a scan says of passes whose requirements are known, and its command."""

import json
import math
from dataclasses import replace
from itertools import product

import pytest
from typer.testing import CliRunner

from panto_env import InputError, simulate
from panto_env.cli import make_app
from panto_env.cli.sweep import parse_speeds
from panto_env.studies import write
from panto_env.studies.permissible import PASSIVE, Scan, scan, study, verified
from panto_env.studies.permissible.scan import WAVES, Broken, Pass
from panto_env.studies.permissible.study import Case, answers_table

from ..pages import DOCS, tables_of

FORCE, SPEED = (
    Broken("max", "maximum", 2, 360.0, "at most 350 N"),
    Broken(WAVES, "v/c", 1, 0.8, "at most 0.7"),
)
KEPT = Pass(PASSIVE, 200.0, 0, False, "", (), "σ", 20.0, 0.2, 250.0, 40.0, 0.05, 0.0, *[math.nan] * 3)


def made(broken_at: dict[str, dict[float, tuple]], speeds=(200.0, 210.0, 220.0, 230.0)) -> Scan:
    """A scan under two seeds; broken_at: requirements broken under the second one, by policy and speed."""
    passes = []
    for policy, broken in broken_at.items():
        for speed, seed, failing in product(
            speeds, range(2), [False] if policy == PASSIVE else [False, True]
        ):
            own = {"policy": policy, "speed_kmh": speed, "seed": seed, "failing": bool(failing)}
            passes.append(replace(KEPT, **own, broken=broken.get(speed, ()) if seed else ()))
    return Scan(speeds, tuple(broken_at), tuple(passes))


def test_forbidden_speeds_come_in_bands_and_the_first_of_them_counts():
    answer = made({PASSIVE: {210.0: (FORCE,)}}).answer(PASSIVE)
    assert (answer.limit, answer.beyond, answer.bands) == (200.0, 210.0, [(200.0, 200.0), (220.0, 230.0)])
    assert answer.reason == "maximum of pantograph 2: 360, at most 350 N (1 of 2 passes)"


def test_the_rule_of_the_wave_speed_is_told_apart():
    answer = made({PASSIVE: {220.0: (SPEED,), 230.0: (SPEED,)}}).answer(PASSIVE)
    assert (answer.limit, answer.with_waves) == (230.0, 210.0)
    assert math.isnan(answer.beyond)
    assert math.isnan(answer.fallback)


def test_nothing_is_permissible_where_the_lowest_speed_is_forbidden():
    found = made({PASSIVE: {200.0: (FORCE,)}, "pd": {}})
    assert math.isnan(found.answer(PASSIVE).limit)
    assert found.answer("pd").limit == found.answer("pd").fallback == 230.0
    assert [row[1] for row in answers_table(found).cells] == ["none", "230"]
    again = made({PASSIVE: {}, "pd": {220.0: (FORCE,)}})
    assert verified(found, again, "pd") == 210.0
    assert math.isnan(verified(found, again, PASSIVE))


TRAIN = {"pantographs": ["dsa380", "dsa380"], "distances": [200], "controlled": [1, 2]}


@pytest.mark.slow
def test_a_scan_says_what_its_passes_do():
    """At 245 km/h the second pantograph alone breaks a requirement, that of σ."""
    ideal = {"line_condition": "new", "pantograph_scatter": 0.0, "speed_drift": 0.0, "sensors": "ideal"}
    found = scan([150, 245], ["repetitive"], seeds=[3], workers=1, catenary="en50318-2002", **TRAIN, **ideal)
    (passive,) = found.at(PASSIVE, 245.0)
    assert [(each.key, each.pantograph) for each in passive.broken] == [("std", 2)]
    run = simulate("en50318-2002", speed_kmh=245, record_droppers=False, mean_force="en50367", **TRAIN)
    ratios = [own.std / own.mean for own in (each.summary(run.common_spans()) for each in run.train)]
    assert ratios[0] < 0.3 < ratios[1] == pytest.approx(passive.std_ratio, rel=1e-9)
    assert (found.answer(PASSIVE).limit, found.answer(PASSIVE).beyond) == (150.0, 245.0)
    (controlled,), (failed,) = (found.at("repetitive", 245.0, failing) for failing in (False, True))
    assert controlled.std_ratio < failed.std_ratio
    assert 0 < failed.rms < controlled.rms <= controlled.peak <= 100.0
    assert 0 < controlled.watts < 50


@pytest.mark.slow
def test_a_policy_that_refuses_a_speed_forbids_it():
    found = scan([200, 300], ["tuned-pd"], seeds=[0], workers=1, catenary="en50318-2002", distance=700)
    assert math.isnan(found.answer("tuned-pd").limit)
    assert "not for 200 km/h" in found.answer("tuned-pd").reason


def test_a_policy_that_is_not_there_is_refused_before_any_pass():
    with pytest.raises(InputError, match="Unknown policy 'nobody'"):
        scan([200], ["nobody"], seeds=[0], workers=1, catenary="en50318-2002")


@pytest.mark.slow
def test_its_command_prints_what_it_writes(tmp_path):
    page, picture = tmp_path / "page.html", tmp_path / "speeds.png"
    given = ["permissible-speed", "re330", "--pantograph", "dsa380", "--speeds", "250:260:10", "--seeds", "1"]
    given += ["--distance", "900", "--workers", "1", "--verify"]
    told = CliRunner().invoke(make_app(), [*given, "--html", str(page), "--plot", str(picture)])
    assert told.exit_code == 0, told.output
    assert picture.stat().st_size > 10_000
    assert "Permissible speeds on re330" in page.read_text(encoding="utf-8")
    data = json.loads(CliRunner().invoke(make_app(), [*given, "--json"]).stdout)
    assert data["speeds_kmh"] == [250, 260]
    assert data["verification"]["speeds_kmh"] == [250, 255, 260]
    limit = data["answers"][PASSIVE]["limit"]
    assert (f"{limit:g}" if limit else "none") in told.output


@pytest.mark.parametrize(
    ("text", "speeds"),
    [("200:220:10", [200, 210, 220]), ("200:205:2.5", [200, 202.5, 205]), ("90:90:5", [90])],
)
def test_speeds_have_a_step(text, speeds):
    assert parse_speeds(text) == speeds


@pytest.mark.parametrize("text", ["200", "200:100:5", "200:300:0", "a:b:c", "0:100:5", "1:300:0.01"])
def test_other_speeds_are_refused(text):
    with pytest.raises(InputError, match=r"--speeds (must read first:last:step|has [\d,]+ speeds)"):
        parse_speeds(text)


@pytest.mark.slow
def test_the_study_of_the_catalogue_tells_gains_bands_and_what_fell(monkeypatch, tmp_path):
    short = Case("en50318-2002", "dsa380", (220.0, 240.0, 260.0, 280.0))
    changed = {"CASES": (short,), "DISTANCES": (200.0,), "SEEDS": 1, "POLICIES": ("repetitive",)}
    for name, value in changed.items():
        monkeypatch.setattr(study, name, value)
    outcome = study.run(lambda what, share: None)
    limits, gains, _ = outcome.tables
    (row,) = limits.cells
    found = outcome.numbers["cases"][0]["policies"]
    assert row[:3] == ("en50318-2002", "dsa380", "307")
    for column, policy in ((3, PASSIVE), (4, "repetitive")):
        both = [found[policy][which]["limit"] for which in ("first", "again")]
        assert row[column].removeprefix("≥ ") == ("none" if any(map(math.isnan, both)) else f"{min(both):g}")
    assert found["repetitive"]["std_reduction"] > 20  # as everywhere on this line
    assert float(gains.cells[0][4]) == pytest.approx(-found["repetitive"]["std_reduction"], abs=0.6)
    assert len(outcome.rows["permissible-speeds"]) == 2 * 4 * 3  # seeds, speeds; passive, acting, failing
    assert {path.suffix for path in write(outcome, tmp_path)} == {".json", ".png", ".csv"}


def test_the_page_shows_what_is_stored():
    """The tables of the whole study, which takes hours, stand in docs/permissible."""
    stored = json.loads((DOCS / "permissible" / "results.json").read_text(encoding="utf-8"))
    shown = tables_of("permissible-speed.md")
    assert len(shown) == 3
    for title, (headings, rows) in shown.items():
        assert headings == stored["tables"][title]["headings"]
        assert rows == stored["tables"][title]["cells"]
    text = " ".join((DOCS / "permissible-speed.md").read_text(encoding="utf-8").split())
    gains = stored["tables"]["Gain over passive, over the lines"]["cells"]
    (median,) = {row[2] for row in gains if row[:2] == ["two pantographs, 200 m", "agent-any-pantograph"]}
    assert f"raises the permissible speed by 0 to 140 km/h, median {float(median):g}.**" in text
    assert "by 0 to 140 km/h, median 100" in stored["verdict"]
