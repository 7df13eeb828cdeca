"""A search for a line: optima that are known, what is refused, what is kept, and what is written."""

import math
import os
import re
from collections import Counter

import numpy as np
import pytest
from typer.testing import CliRunner

from panto_env import InputError, simulate
from panto_env.base.errors import AccuracyWarning
from panto_env.catalog import load_catenary
from panto_env.cli import make_app

pytest.importorskip("optuna")

from panto_env.studies.design import Design, read_design, search
from panto_env.studies.design.check import candidates_of, check, text_of, tornado_table
from panto_env.studies.design.search import TRIED, arguments_of, best_of, in_words, tried
from panto_env.studies.design.study import RETROFITTED, file_of

RUN = {"catenary": "benchmark-2015", "pantograph": "dsa380", "distance": 700.0}
TENSION = {"catenary.contact_wire.tension": (18e3, 27e3)}
FOUR = TENSION | {
    "catenary.messenger_wire.tension": (12e3, 20e3),
    "catenary.droppers.spacing": (4.5, 9.0),
    "catenary.droppers.pre_sag": (0.0, 0.05),
}


def design(**given) -> Design:
    return Design.model_validate({"variables": TENSION, "speeds_kmh": [160], "run": RUN} | given)


@pytest.mark.slow
def test_the_least_tension_is_the_lower_end_where_nothing_forbids_it(tmp_path):
    wanted = design(objectives=["tension"], designs=60)
    found = search(wanted, tmp_path)
    (best,) = best_of(wanted, found)
    messenger = load_catenary("benchmark-2015").messenger_wire.tension
    assert best.value == pytest.approx(18e3 + messenger, rel=0.01)
    assert in_words(wanted, found).endswith("all requirements kept")


@pytest.mark.longer
def test_figures_of_a_design_are_those_of_its_passes():
    wanted = design(speeds_kmh=[160, 280], run=RUN | {"line_condition": "as-built"})
    ((objectives, found),) = tried(wanted, [{"catenary.contact_wire.tension": 20e3}])
    line = load_catenary("benchmark-2015")
    line = line.model_copy(update={"contact_wire": line.contact_wire.model_copy(update={"tension": 20e3})})
    given = RUN | {"catenary": line, "mean_force": "en50367", "line_condition": "as-built"}
    runs = [simulate(**given, speed_kmh=v, record_droppers=False).summary() for v in (160, 280)]
    assert objectives == [found.std_ratio]
    assert found.std_ratio == pytest.approx(max(run.std / run.mean for run in runs), rel=1e-12)
    assert found.excess == 0 or found.broken


@pytest.mark.slow
def test_a_search_goes_on_where_it_was_broken_off_and_refuses_another_one(tmp_path):
    first = search(design(designs=12), tmp_path)
    known = [trial.values for trial in first.trials]
    again = search(design(designs=18), tmp_path)
    assert [trial.values for trial in again.trials][:12] == known
    assert len(again.trials) == 18
    with pytest.raises(InputError, match="has a search with other speeds_kmh; choose another folder"):
        search(design(speeds_kmh=[200]), tmp_path)


@pytest.mark.slow
def test_threads_do_not_change_what_is_found(tmp_path):
    one, two = (search(design(designs=24), tmp_path / f"{k}", workers=k) for k in (1, 2))
    assert [trial.values for trial in one.trials] == [trial.values for trial in two.trials]


def random_designs(name: str, count: int, seed: int) -> Counter[str]:
    """Designs of a study's ranges, every other one of twice as wide ones, are run or refused in a line.

    How many, by sentence, numbers left out.
    """
    random, wanted = np.random.default_rng(seed), read_design(file_of(name))
    short = {"speeds_kmh": (sorted(wanted.speeds_kmh)[3],), "run": wanted.run | {"distance": 900.0}}
    wanted, values = wanted.model_copy(update=short), []
    for k in range(count):
        ends = {
            key: (low, high, 0.5 * (k % 2) * (high - low)) for key, (low, high) in wanted.variables.items()
        }
        values.append({key: float(random.uniform(low - w, high + w)) for key, (low, high, w) in ends.items()})
    ways: Counter[str] = Counter()
    for given, (objectives, found) in zip(values, tried(wanted, values), strict=True):
        assert np.isfinite(objectives).all(), given
        if math.isnan(found.std_ratio):
            assert re.fullmatch(r"[^\n]+[^.]\.", found.refused), given
            ways[re.sub(r"\d[\d.,e+-]*\d|\d", "#", found.refused)] += 1
        else:
            assert 0 < found.std_ratio < 2, given
            ways["run"] += 1
    return ways


def test_random_designs_are_run_or_refused():
    assert random_designs("re250", 4, 1)["run"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", RETROFITTED)
def test_many_random_designs_are_run_or_refused(name):
    """As many as a third of DESIGNS; `make nonsense` runs thousands."""
    count = int(os.environ.get("DESIGNS", "100")) // len(RETROFITTED)
    ways = random_designs(name, count, 2)
    print(*(f"{number:6} {way}" for way, number in ways.most_common()), sep="\n")
    assert 0.4 * count < ways["run"]


def test_a_line_is_written_as_it_was_run(tmp_path):
    wanted = design(variables=FOUR)
    values = {name: 0.4 * low + 0.6 * high for name, (low, high) in FOUR.items()}
    line = arguments_of(wanted, values, "passive")["catenary"]
    path = tmp_path / "line.toml"
    path.write_text(text_of(line), encoding="utf-8")
    again = load_catenary(path)
    left_out = {"name", "sources"}
    assert again.model_dump(exclude=left_out) == line.model_dump(exclude=left_out)


@pytest.mark.slow
def test_control_and_other_speeds_are_checked(tmp_path):
    wanted = design(speeds_kmh=[240, 280], policy="passive", check_policies=["repetitive"], designs=12)
    found = search(wanted, tmp_path)
    checked = check(wanted, candidates_of(wanted, found))
    assert [(one.design, one.policy) for one in checked] == [
        (name, policy) for name in ("start", "best") for policy in ("passive", "repetitive")
    ]
    for one in checked:
        assert list(one.by_speed) == [240, 260, 280]
        assert one.searched.std_ratio == max(one.by_speed[v] for v in (240, 280))
        assert one.held_out.std_ratio == one.by_speed[260]
    best = checked[2]
    assert best.searched.std_ratio == pytest.approx(
        best_of(wanted, found)[0].user_attrs["std_ratio"], rel=1e-12
    )
    assert checked[1].searched.std_ratio < checked[0].searched.std_ratio


STUDY = """
speeds_kmh = [200, 220, 240, 260, 280]
objectives = ["std_ratio", "tension"]
designs = 12
[variables]
"catenary.contact_wire.tension" = [18e3, 27e3]
[run]
catenary = "benchmark-2015"
pantograph = "dsa380"
distance = 600
"""


@pytest.mark.slow
def test_a_variable_that_moves_into_what_is_refused_comes_first(monkeypatch):
    monkeypatch.setattr(
        f"{tornado_table.__module__}.tornado", lambda *_: [("a", 0.2, 0.3), ("b", math.nan, 0.2)]
    )
    rows = tornado_table(None, {}).rows
    assert [*rows] == [("b", "–", "0.200"), ("a", "0.200", "0.300")]


@pytest.mark.slow
def test_the_command_writes_what_it_found(tmp_path):
    file, folder = tmp_path / "study.toml", tmp_path / "out"
    file.write_text(STUDY, encoding="utf-8")
    told = CliRunner().invoke(make_app(), ["design", str(file), "--output", str(folder)])
    assert told.exit_code == 0, told.output
    assert "front 1" in told.output
    assert (folder / TRIED).is_file()
    assert (folder / "design.png").stat().st_size > 10_000
    assert load_catenary(folder / "front-1-catenary.toml").contact_wire.tension < 27e3


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[18e3, 27e3]", "[27e3, 18e3]", "must have a range, the smaller value first"),
        ("wire.tension", "wire.tensions", "Unknown parameter 'catenary.contact_wire.tensions'"),
        ('"std_ratio", "tension"', '"cost"', "objectives.1"),
        ("distance = 600", "speed_kmh = 200", "run must not have speed_kmh"),
        ("distance = 600", "length = 600", "'length' of run is no setting of a run"),
        ("designs = 12", 'policy = "nobody"', "Unknown policy 'nobody'"),
        ("200, 220, ", "", "with 3 speeds a design fits these"),  # a warning
    ],
)
@pytest.mark.filterwarnings("error")
def test_a_wrong_study_is_refused(old, new, message, tmp_path):
    file = tmp_path / "study.toml"
    assert old in STUDY
    file.write_text(STUDY.replace(old, new), encoding="utf-8")
    with pytest.raises((InputError, AccuracyWarning), match=r"study\.toml: ") as caught:
        read_design(file)
    assert message in str(caught.value)
