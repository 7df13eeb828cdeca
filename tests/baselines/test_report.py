"""The page of a benchmark: what it shows, that it is one file and escapes all, that it sorts in a browser."""

import itertools
import json
import os
import re
import shutil
import subprocess
from functools import cache
from html.parser import HTMLParser

import pytest

from panto_baselines.benchmark.overall import why
from panto_baselines.benchmark.run import parse_result, read_result
from panto_baselines.benchmark.settings import BenchmarkSettings, load_benchmark
from panto_baselines.line import as_toml
from panto_baselines.oracle.stored import stored_changes
from panto_baselines.report import charts
from panto_baselines.report.page import page, report, what_is
from panto_baselines.report.tables import ranking, summary
from panto_configs import names
from panto_env import InputError
from panto_env.base.checksums import read_checked, with_checksum, write_checked

from ..benchmark_tables import HEADLINE, short_ranking
from ..pages import DOCS, tables_of
from .commands import called

HOSTILE = "</title><script>alert('\"1')</script>&amp;"
VOID = {"meta", "input"}
BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
POLICIES = {"passive": (0.0, ""), "p": (-10.0, ""), "pd": (-9.0, ""), HOSTILE: (-20.0, "it cheats")}
SHARE = {"share": 0.75, "interval": [0.5, 0.9]}
HARM = {"passes": 2, "sigma": 1, "loss": 0, "lost": 0, "minimum": 1, "uplift": 0, "worst": 4.5}
HARM |= {"worst_at": "seed 1", "lowest_minimum": 7.0, "most_uplift": -0.001}
CHROMIUM = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run"),
    *("--virtual-time-budget=2000", "--dump-dom"),
]


def result(**changes):
    """What `panto benchmark` writes, of one line at two speeds, by hand."""
    names = list(POLICIES)
    cells, traces, standings = [], [], []
    for speed in (250.0, 300.0):
        for rank, (policy, (change, reason)) in enumerate(POLICIES.items(), 1):
            where = {"policy": policy, "catenary": "ln2", "pantograph": "cx", "speed_kmh": speed, "case": ""}
            figures = {"std": 30 + change, "effort": abs(change), "mean": None}
            cells.append(
                where
                | {"seeds": 2, "nominal_force": 120.0, "figures": figures, "change": change, "interval": None}
                | {"cost_change": change, "mean_change": 0.5, "improved": 1.0, "disqualified": reason}
                | {"moved": 1, "most_moved": 2.0, "oracle": None, "oracle_share": None}
                | {"early": change, "late": None, "harm": HARM, "kilometres": []}
                | {"rank": None if reason else rank, "spread": 1.0}
            )
            along = {"position": [0.0, 50.0, 100.0], "force": [100.0, 120.0 + change, 140.0]}
            traces.append(where | {"seed": 0} | along | {"frequency": [0.0, 20.0], "amplitude": [0.0, 9.0]})
    for rank, (policy, (change, reason)) in enumerate(POLICIES.items(), 1):
        standings.append(
            {"policy": policy, "change": change, "interval": [change - 1, change + 1], "worst": change}
            | {"worst_at": "ln2, 250 km/h", "improved": 1.0, "effort": abs(change), "power": 2.0}
            | {"contact_loss": 0.5, "cost_change": change / 2}
            | {"interval_for_lines": None, "oracle_share": None}
            | {"saturation": 0.25, "worst_quarter": change + 3, "passes": 4, "moved": 2, "most_moved": -1.6}
            | {"early": change, "late": None, "harm": HARM}
            | {"better_than": {other: SHARE for other in names if other != policy}, "trainings": {}}
            | {"disqualified": reason, "rank": None if reason else 4 - rank}
        )
    settings = BenchmarkSettings(title=HOSTILE).model_dump(mode="json")
    whole = {"version": "1", "settings": settings, "windows": [[[3, 5], None]], "standings": standings}
    return whole | {"cells": cells, "rows": [], "traces": traces} | changes


@cache
def usual():
    return page([parse_result(result(), "it")])


def html(*tables):
    return page([parse_result(table, "it") for table in tables]) if tables else usual()


class Reader(HTMLParser):
    """Tables as lists of rows of texts; tags that are opened and not closed raise."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.tables, self.open = [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_startendtag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and {"td", "th"} & set(self.open):
            self.tables[-1][-1][-1] += data.strip()


def test_leaderboard_shows_the_ranked_first_and_why_others_are_not():
    headings, *rows = Reader(html()).tables[0]
    assert headings[:3] == ["rank", "policy", "Δσ (%)"]
    assert [row[0] for row in rows] == ["1", "2", "3", "–"]
    assert [row[1] for row in rows] == ["pd", "p", "passive", f"{HOSTILE}disqualified: it cheats"]
    assert rows[1][2:] == [
        *("-10.0-11.0 to -9.0", "0.50", "-5", "-7.0", "-10.0at ln2, 250 km/h", "100 %"),
        *("+4.5seed 1", "1", "0", "0", "1", "7", "0", "0.0", "75 %50 to 90"),
        *("10.0", "2.0", "25 %", "2 of 4", "-1.6"),
    ]
    assert rows[2][headings.index("better than the next in")] == "–"  # the last of the ranked


def test_the_share_of_an_oracle_is_shown_where_there_was_one():
    table = result()
    table["standings"][1]["oracle_share"] = 0.42
    headings, *rows = Reader(html(table)).tables[0]
    assert headings[3] == "of the oracle's gain"
    assert [row[3] for row in rows] == ["–", "42 %", "–", "–"]
    assert "oracle&#39;s gain" not in html()


def test_heat_map_and_pairs_are_tables():
    reader = Reader(html())
    heat, pairs = (table for table in reader.tables if table[0][0] in ("", "better than"))
    assert heat[0] == ["", "cx on ln2"]
    assert heat[1] == ["policy", "250 km/h", "300 km/h"]
    assert heat[3] == ["p", "-10.0", "-10.0"]
    assert heat[5] == [HOSTILE, "(-20.0)", "(-20.0)"]
    assert pairs[2] == ["p", *("75 %50 to 90", "", "75 %50 to 90", "75 %50 to 90")]


def with_trainings():
    """The result with p and pd as trainings of one method."""
    table = result()
    trainings = {one["policy"]: one for one in table["standings"] if one["policy"] in ("p", "pd")}
    for one in trainings.values():
        one |= {"rank": None, "better_than": {}}
    changes = {name: one["change"] for name, one in trainings.items()}
    method = trainings["p"] | {"policy": "<ppo>", "change": -9.5, "rank": 1, "trainings": changes}
    table["standings"].append(method)
    return table


def test_a_method_stands_before_its_trainings_and_each_has_its_point():
    reader = Reader(html(with_trainings()))
    rows = reader.tables[0][1:]
    assert [row[:2] for row in rows[:3]] == [
        *(["1", "<ppo>"], ["–", "pa training of <ppo>"], ["–", "pda training of <ppo>"])
    ]
    pairs = next(table for table in reader.tables if table[0][0] == "better than")
    assert pairs[0] == ["better than", "passive", HOSTILE, "<ppo>"]
    radii = [attributes["r"] for tag, attributes in reader.tags if tag == "circle" and "cx" in attributes]
    assert radii.count("2.5") == 2
    boxes = [attributes for tag, attributes in reader.tags if tag == "input"]
    assert len(boxes) == len(POLICIES)  # those that ran
    assert "A training of &lt;ppo&gt;, which is ranked in its place." in html(with_trainings())
    rows = summary(parse_result(with_trainings(), "it")).cells
    assert [row[0] for row in rows[:3]] == ["<ppo>", "· p", "· pd"]
    assert rows[0][1] == "-9.5"
    table = with_trainings()
    table["standings"] = [one for one in table["standings"] if one["policy"] != "p"]
    with pytest.raises(InputError, match="do not fit together"):
        parse_result(table, "it")


def test_a_track_on_which_a_tape_is_nearly_as_good_says_so_in_its_heading():
    table = json.loads(json.dumps(result()).replace('"p"', '"tape of pd"'))
    words = "needs no feedback: tape of pd -10.0 %, pd -9.0 %"
    assert f"; {words}</h2>" in html(table)
    assert ranking(parse_result(table, "it")).title.endswith(f"Δσ (%), 2 seeds; {words}")
    assert "needs no feedback" not in html()


def test_charts_draw_every_policy_in_its_place():
    reader = Reader(html())
    lines = [attributes for tag, attributes in reader.tags if tag == "polyline"]
    assert len(lines) == 2 * 2 * len(POLICIES)  # force and spectrum at two speeds
    assert [line["data-policy"] for line in lines[:4]] == ["0", "1", "2", "3"]
    x, y = zip(*(map(float, point.split(",")) for point in lines[0]["points"].split()), strict=True)
    assert (x[0], x[-1]) == (charts.LEFT, charts.WIDTH - charts.RIGHT)
    assert x[1] == pytest.approx((x[0] + x[2]) / 2, abs=0.1)
    assert y[0] - y[1] == pytest.approx(y[1] - y[2], abs=0.11)  # 100, 120 and 140 N: upwards
    assert y[0] > y[2]
    boxes = [attributes for tag, attributes in reader.tags if tag == "input"]
    assert [box["data-policy"] for box in boxes] == ["0", "1", "2", "3"]


def test_a_result_without_traces_says_so():
    table = result()
    table["traces"] = []
    assert "every pass of the first seed ended early" in html(table)
    assert "polyline class" not in html(table)


def test_nothing_of_a_result_becomes_markup():
    reader = Reader(html(result(version="<b>1</b>")))
    assert sum(tag == "script" for tag, _ in reader.tags) == 1
    assert "b" not in {tag for tag, _ in reader.tags}
    assert HOSTILE not in html()


def test_a_browser_is_to_fetch_nothing_for_the_page():
    """The policy stands before whatever it is to bind, and allows what stands in the page alone."""
    tags = Reader(html()).tags
    policy = {"http-equiv": "Content-Security-Policy"}
    place = next(k for k, (tag, its) in enumerate(tags) if tag == "meta" and policy.items() <= its.items())
    rules = dict(each.split(maxsplit=1) for each in tags[place][1]["content"].split("; "))
    inline = "'unsafe-inline'"
    assert rules == {"default-src": "'none'", "style-src": inline, "script-src": inline}
    assert {tag for tag, _ in tags[:place]} <= {"html", "head", "meta"}
    assert not re.search(r"https?:|\bsrc=|<link|@import|url\(", html())
    assert html() == html(result())


@pytest.mark.slow
@pytest.mark.parametrize("name", names("benchmark"))
def test_the_settings_shown_run_the_same_benchmark(tmp_path, name):
    settings = load_benchmark(name)
    settings = settings.model_copy(update={"title": 'a "title"\\ \x7f\n'})
    path = tmp_path / "settings.toml"
    path.write_text(as_toml(settings.model_dump(mode="json")))
    assert load_benchmark(path) == settings


def test_policies_are_described_and_none_of_a_users_own_is_run(tmp_path):
    assert what_is("p:gain=0.3") == "Force proportional to the nominal force minus the contact force."
    assert what_is("blind of pd").startswith("A control: pd, given its first observation")
    mine = tmp_path / "mine.py"
    mine.write_text("raise SystemExit('it ran')")
    assert "Python file" in what_is(f"{mine}:Mine")
    assert what_is("unheard-of") == "It is not installed where this page was made."


def test_labels_of_points_lie_apart_and_inside():
    points = [charts.Point(f"p{k}", k % 15 + k // 15 / 9, 1.0 + k % 3, False) for k in range(20)]
    chart = charts.dots("", ("", ""), points)
    spans = []
    for dot in chart.dots:
        if dot.label:
            width = charts.LETTER * len(dot.label)
            begin = dot.x - charts.GAP - width if dot.before else dot.x + charts.GAP
            assert charts.LEFT <= begin <= begin + width <= charts.WIDTH
            spans.append((dot.y, begin, begin + width))
    assert 5 < len(spans) < 20
    spans.sort()
    assert all(a[0] != b[0] or a[2] <= b[1] for a, b in itertools.pairwise(spans))


@pytest.mark.longer
def test_command_writes_the_page_beside_the_first_file(tmp_path):
    first, second = tmp_path / "a.json", tmp_path / "b.json"
    for path in (first, second):
        write_checked(path, result())
    done = called(report, first, second)
    assert done.exit_code == 0, done.output
    assert done.stdout == f"The page is {tmp_path / 'a.html'}.\n"
    assert (tmp_path / "a.html").read_text(encoding="utf-8") == html(result(), result())
    (tmp_path / "a.html").unlink()
    told = called(report, first, "--markdown")
    assert "| policy | Δσ (%) | 95 % | CL (%) | ΔCF (%) |" in told.output
    assert set(tmp_path.iterdir()) == {first, second}


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("run.parquet", "", "run.parquet is not a whole trajectory file"),
        ("out.json", None, "there is no such file"),
        ("out.json", '{"rows": []}', "its checksum does not fit"),
        ("out.json", with_checksum({"rows": []}), "RESULT.json`: 'version' is missing or wrong"),
        ("out.json", with_checksum(result(cells=[])), "do not fit together"),
        ("out.json", with_checksum(result(traces=[{"policy": 1}])), "'traces.1.policy' is missing or wrong"),
        ("out.json", with_checksum(result(windows=[])), "do not fit together"),
    ],
)
def test_what_is_no_result_is_refused_in_one_sentence(tmp_path, name, text, words):
    if text is not None:
        (tmp_path / name).write_text(text if isinstance(text, str) else json.dumps(text))
    done = called(report, tmp_path / name, "--output", tmp_path / "page.html")
    assert isinstance(done.exception, InputError)
    assert words in str(done.exception)
    assert "\n" not in str(done.exception)
    assert not (tmp_path / "page.html").exists()


def opened(tmp_path, script):
    """The page after a script of the test has run in it, as a browser has it."""
    path = tmp_path / "page.html"
    path.write_text(html().replace("</body>", f"<script>{script}</script></body>"), encoding="utf-8")
    command = [BROWSER, *CHROMIUM, f"--user-data-dir={tmp_path / 'profile'}", path.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout


@pytest.mark.longer
@pytest.mark.skipif(
    BROWSER is None and "CI" not in os.environ, reason="no browser; the Debian package chromium is one"
)
def test_a_browser_sorts_by_a_click_and_hides_by_a_tick(tmp_path):
    text = opened(
        tmp_path,
        """
        const buttons = [...document.querySelectorAll("th button")];
        const effort = buttons.find((each) => each.innerText === "effort (N)");
        effort.click();
        document.title = effort.closest("table").tBodies[0].rows[1].cells[1].innerText.trim();
        effort.click();
        document.querySelector("input[data-policy='1']").click();
        """,
    )
    reader = Reader(text)
    headings, *rows = reader.tables[0]
    assert [row[1].removesuffix("disqualified: it cheats") for row in rows] == [HOSTILE, "p", "pd", "passive"]
    assert re.search("<title>pd</title>", text)  # the second from below, when it rose
    column = headings.index("effort (N)")
    assert [row[column] for row in rows] == ["20.0", "10.0", "9.0", "0.0"]
    sorts = [a.get("aria-sort") for tag, a in reader.tags if tag == "th"][: len(headings)]
    assert sorts == [None] * column + ["descending"] + [None] * (len(headings) - column - 1)
    off = {a["data-policy"] for _, a in reader.tags if "data-policy" in a and "off" in a.get("class", "")}
    assert off == {"1", "3"}  # the unticked one, and the disqualified one, which is not shown at first


def test_a_document_s_table_holds_every_policy_place_and_oracle():
    table = result()
    table["cells"][1] |= {"oracle": -20.0, "oracle_share": 0.5}
    table["standings"][2]["interval_for_lines"] = [-20.0, 2.0]
    table["cells"][2] |= {"disqualified": "it moves the mean force", "mean_change": 3.2}  # pd at 250 km/h
    made = summary(parse_result(table, "it"))
    overall = ("all", "95 %", "CL (%)", "ΔCF (%)", "worst quarter", "better than next", "mean moved in")
    assert made.headings == ("policy", "250 km/h", "300 km/h", *overall)
    between = "-10.0 to -8.0 (other lines -20.0 to 2.0)"
    over_all = ("-9.0", between, "0.50", "-4", "-6.0", "75 % (50 to 90)", "2 of 4")
    assert made.cells[0] == ("pd", "(-9.0; mean +3.2)", "-9.0", *over_all)  # by the standings' ranks
    over_all = ("-10.0", "-11.0 to -9.0", "0.50", "-5", "-7.0", "75 % (50 to 90)", "2 of 4")
    assert ("p", "-10.0", "-10.0", *over_all) in made.cells
    assert made.cells[-2][0] == HOSTILE  # not ranked
    assert made.cells[-2][-7:] == ("–", "–", "0.50", "-10", "–", "–", "2 of 4")
    assert made.cells[-1] == ("*oracle*", "-20.0", *["–"] * 8)
    passive = next(row for row in made.cells if row[0] == "passive")
    assert passive[1] == "0.0 *"  # the first in the cells of this result by hand


def test_a_document_s_ranking_says_who_is_out_and_why():
    table = result()
    made = ranking(parse_result(table, "it"))
    assert made.headings[:3] == ("policy", "Δσ (%)", "95 %")
    assert "other lines" not in made.headings
    assert "100 spans on" not in made.headings
    rows = {row[0]: row for row in made.cells}
    assert rows["p"][1:3] == ("-10.0", "-11.0 to -9.0")
    assert rows["p"][-2:] == ("75 % (50 to 90)", "")
    assert rows[HOSTILE][1].startswith("(")
    assert rows[HOSTILE][-1] == "cheats"
    table["standings"][2]["interval_for_lines"] = [-20.0, 2.0]
    made = ranking(parse_result(table, "it"))
    assert made.cells[0][made.headings.index("other lines")] == "-20.0 to 2.0"


def test_a_reason_is_shown_without_the_rule():
    told = "ln2 at 260 km/h: it changes σ by +12.8 % in one pass (seed 5), more than 10 %"
    assert why(told) == "changes σ by +12.8 % in one pass (seed 5): ln2 at 260 km/h"
    assert why("it cheats, more than twice") == "cheats"


TRACKS = [name for name in names("benchmark") if name.startswith("benchmark/") and name != "benchmark/ideal"]
"""All but that for the curious, which `make benchmark` leaves out."""


@pytest.mark.longer
def test_the_page_has_a_ranking_of_each_headline_track_and_no_other_table_of_results():
    printed = [short_ranking(read_result(DOCS / "benchmark" / f"{track}.json.gz")) for track in HEADLINE]
    assert tables_of("benchmark.md") == {
        table.title: (list(table.headings), [list(row) for row in table.cells]) for table in printed
    }


@pytest.mark.slow
@pytest.mark.parametrize("track", TRACKS)
def test_stored_results_are_of_the_tracks_as_they_are(track):
    # Values that came later have in older results the default with which these were made. Installed policies
    # play the same pass apart and beside the plant: see test_apart.py.
    made = BenchmarkSettings.model_validate(read_checked(DOCS / f"{track}.json.gz")["settings"])
    mine, own = (each.model_dump(mode="json", exclude={"trusted"}) for each in (made, load_benchmark(track)))
    assert mine == own


def test_the_makefile_runs_the_same_tracks():
    lines = (DOCS.parent / "Makefile").read_text(encoding="utf-8").splitlines()
    told = next(line for line in lines if line.startswith("TRACKS := ")).split()[2:]
    assert {f"benchmark/{name}" for name in told} == set(TRACKS)


def test_an_oracle_is_stored_for_every_cell_of_the_known_line():
    for cell in read_result(DOCS / "benchmark" / "known-line.json.gz").cells:
        if cell.policy == "fitted-fb+ff":
            assert cell.oracle_share is not None
            given = {"catenary": cell.catenary, "pantograph": cell.pantograph, "speed_kmh": cell.speed_kmh}
            realistic = given | {"actuator": "realistic", "line_condition": "smooth"}
            assert cell.oracle == pytest.approx(stored_changes(realistic, (10, 19))[0])
