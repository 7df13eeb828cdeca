"""The fitted line and pantograph as files: the design's text, what was found, and where it comes from."""

import tomllib

import numpy as np
import pytest

from panto_env import simulate
from panto_env.base.errors import InputError
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.catalog.loader import text_of
from panto_env.catalog.values import values_of
from panto_env.fitting.fit import Fit
from panto_env.fitting.fitted_line import with_table, with_value, write_line, write_pantograph
from panto_env.fitting.misfit import State
from panto_env.fitting.problem import problem
from panto_env.fitting.solve import Solution
from panto_env.fitting.stored import GOES_ON
from panto_env.fitting.tables import remarks, rows_of, summary_table, values_table
from panto_env.plant.line_condition import LineCondition

from .conftest import LINE, PANTOGRAPH

FOUND = {
    "dropper 4 of span 12": 0.003,
    "dropper 1 of span 11": -0.002,
    "dropper 9 of span 12": 0.004,
    "support 12": 0.0025,
    "tension of the contact wire": 0.01,
    "tension of the messenger wire": -0.02,
}
CONDITION = LineCondition(
    miscut_droppers=((11, 1, -0.002), (12, 4, 0.003), (12, 9, 0.004)),
    raised_supports=((12, 0.0025),),
    lost_contact_tension=-0.01,
    lost_messenger_tension=0.02,
)
SHORT = {"distance": 780.0, "spans": 20, "accuracy": "fast", "record_droppers": False}


def made_up(ready, differences, shift=0.0, silent=()):
    """A fit that found differences of values by name, and tells them, but for silent ones."""
    fitting = ready
    start = fitting.start()
    x, deviation = start.x.copy(), fitting.prior.copy()
    for k, value in enumerate(fitting.values.all):
        if value.name in differences:
            x[k] = differences[value.name]
            deviation[k] *= 1.0 if value.name in silent else 0.1
    x[len(fitting.values) :][: len(fitting.parts)] = shift
    state = State(x, start.static_forces, np.ones_like(start.noise), 3)
    residual = np.random.default_rng(0).standard_normal(len(fitting.band))
    nothing = np.zeros((len(residual), len(x)))
    return Fit(ready, Solution(state, np.diag(deviation**2), nothing, residual, True))


@pytest.fixture(scope="module")
def done(ready):
    return made_up(ready, FOUND, silent=["dropper 9 of span 12"])


@pytest.fixture(scope="module")
def written(done, tmp_path_factory):
    path = tmp_path_factory.mktemp("fitted") / "found.toml"
    write_line(done, LINE, path, "run.csv")
    return path


@pytest.mark.longer
def test_the_file_is_the_design_s_with_what_was_found(written, done):
    line = load_catenary(written)
    assert line.as_found == CONDITION  # with the dropper that is hardly told: others were found with it
    plan = done.problem.values.design
    assert line.spans == plan.spans
    assert line.model_copy(update={"as_found": None, "spans": 10, "name": LINE, "sources": {}}) == (
        load_catenary(LINE).model_copy(update={"sources": {}})
    )
    own, text = written.read_text(encoding="utf-8").splitlines(), text_of(LINE).splitlines()
    assert [k for k, line in enumerate(text) if line != own[k]] == [4]  # spans
    assert own[len(text) + 1] == "[as_found]"


@pytest.mark.longer
def test_sources_are_shown(written):
    shown = {each.key: each for each in values_of(load_catenary(written))}
    assert shown["as_found.raised_supports"].value == ((12, 0.0025),)
    assert shown["as_found.raised_supports"].source == (
        "fitted to run.csv; 95 % intervals of ±0.98 to 9.8 mm; 4 of 5 hardly told by the records"
    )
    assert shown["as_found.lost_contact_tension"].source == "fitted to run.csv; 95 % intervals of ±0.33 %"
    assert "mm; 40 of 42 hardly told by the records" in shown["as_found.miscut_droppers"].source
    assert "as_found.ice" not in shown  # only what was found
    assert shown["spans"].source == "as long as run.csv"
    assert not [key for key in {each.key for each in values_of(load_catenary(LINE))} if "as_found" in key]


def test_runs_on_it_are_those_on_the_design_in_that_condition(written):
    found = simulate(str(written), PANTOGRAPH, 250.0, **SHORT)
    same = simulate(LINE, PANTOGRAPH, 250.0, line_condition=CONDITION, **SHORT)
    np.testing.assert_array_equal(found.contact_force, same.contact_force)
    plain = simulate(LINE, PANTOGRAPH, 250.0, **SHORT)
    assert np.abs(found.contact_force - plain.contact_force).max() > 1


@pytest.mark.longer
def test_a_fit_of_a_fitted_line_begins_with_what_the_first_ended_with_and_adds_to_it(
    written, record, pantograph, done, tmp_path
):
    again = problem([record], load_catenary(written), pantograph)
    fitting, x = done.problem, done.solution.state.x[: len(done.problem.values)]
    (after,) = fitting.sampled(fitting.parts[0], [fitting.values.variant(x, pantograph.static_force)])
    np.testing.assert_allclose(again.as_designed()[0], after, atol=0.2)
    assert again.values.design.condition.miscut_droppers == CONDITION.miscut_droppers
    more = {"dropper 4 of span 12": -0.001, "dropper 2 of span 12": 0.005, "support 13": 0.001}
    write_line(
        made_up(again, more | {"tension of the contact wire": 0.01}), written, tmp_path / "b.toml", "b.csv"
    )
    line = load_catenary(tmp_path / "b.toml")
    assert line.as_found == LineCondition(
        miscut_droppers=((11, 1, -0.002), (12, 2, 0.005), (12, 4, 0.002), (12, 9, 0.004)),
        raised_supports=((12, 0.0025), (13, 0.001)),
        lost_contact_tension=round(1 - 1.01 * 1.01, 6),
        lost_messenger_tension=0.02,
    )
    assert line.sources["as_found.lost_messenger_tension"].startswith("fitted to b.csv")
    assert line.sources["as_found.miscut_droppers"].startswith("fitted to b.csv")
    text = (tmp_path / "b.toml").read_text(encoding="utf-8")
    assert text.count("[as_found]") == 1


def test_damping_and_pantograph(record, design, pantograph, tmp_path):
    ready = problem([record], design, pantograph, free=("damping", "pantograph"))
    found = {"damping beta": 0.2, "masses 2 of the pantograph": 0.05, "masses 3 of the pantograph": -0.1}
    fit = made_up(ready, found | {"damping alpha": 0.5}, silent=["damping alpha"])
    write_line(fit, LINE, tmp_path / "a.toml", "run.csv")
    line = load_catenary(tmp_path / "a.toml")
    assert line.damping.beta == pytest.approx(1.2e-4)
    assert line.damping.alpha == 0.0125
    assert line.sources["damping.beta"].startswith("fitted to run.csv; 95 % intervals of ±9.8 %")
    write_pantograph(fit, PANTOGRAPH, tmp_path / "p.toml", "run.csv")
    riding = load_pantograph(tmp_path / "p.toml")
    assert riding.masses == pytest.approx((7.12, 6.3, 5.22))
    assert riding.stiffnesses == pantograph.stiffnesses
    assert riding.sources["masses"].startswith("number 2, 3 fitted to run.csv")
    assert (tmp_path / "p.toml").read_text(encoding="utf-8").startswith("# DSA 380.\n")
    wrong = made_up(ready, {"masses 2 of the pantograph": -1.2})
    with pytest.raises(InputError, match=r"no pantograph may have, so none is written: .*q\.toml is not"):
        write_pantograph(wrong, PANTOGRAPH, tmp_path / "q.toml", "run.csv")
    assert not (tmp_path / "q.toml").exists()


def test_a_file_that_cannot_be_written_leaves_none(done, tmp_path):
    with pytest.raises(InputError, match=r"\.toml"):
        write_line(done, LINE, tmp_path / "a.csv", "run.csv")
    base = tmp_path / "mine.toml"
    base.write_text(text_of(LINE).replace("spans = ", "'spans' = ", 1), encoding="utf-8")
    with pytest.raises(InputError, match=r"spans of .*mine\.toml cannot be replaced"):
        write_line(done, base, tmp_path / "a.toml", "run.csv")
    assert not (tmp_path / "a.toml").exists()


@pytest.mark.parametrize("wrong", [{"tension of the contact wire": 0.12}, {"dropper 4 of span 12": 0.21}])
def test_values_that_no_line_may_have_are_not_written(ready, tmp_path, wrong):
    """So no file is left that the next command would refuse."""
    with pytest.raises(InputError, match=r"no line may have, so none is written: .*a\.toml is not"):
        write_line(made_up(ready, wrong), LINE, tmp_path / "a.toml", "run.csv")
    assert not (tmp_path / "a.toml").exists()


def test_tables_say_what_was_found(done):
    rows = {row["name"]: row for row in rows_of(done.found, done.problem.before)}
    dropper = rows["dropper 4 of span 12"]
    assert dropper["difference"] == 3.0
    assert (dropper["low"], dropper["high"]) == pytest.approx((3 - 0.98, 3 + 0.98))
    assert (dropper["unit"], dropper["position"], dropper["tolerance"]) == ("mm", 683.5, 5.0)
    assert dropper["told"] is True
    assert rows["dropper 9 of span 12"]["told"] is False
    assert "dropper 1 of span 1" not in rows  # before what is compared
    told = {row[0]: row for row in summary_table(done.found, done.differing, "the design").rows}
    assert told["lengths of droppers (mm)"][1:4] == ("42", "2", "2")
    names = [row[0] for row in values_table(done.differing, "the design").rows]
    assert names[0] == "tension of the messenger wire"
    assert set(names) == set(FOUND) - {"dropper 9 of span 12"}
    notes = remarks(done)
    assert "Lengths of droppers: the records tell 2 of 42." in notes
    assert not [note for note in notes if "settled" in note]
    assert GOES_ON in notes


TEXT = """\
# A line.
kind = "flexible"
spans = 10 # as surveyed
alpha = 7.0

[damping] # of Rayleigh
  alpha = { value = 0.0125, source = "seen" }
beta = 1e-4  # recalled

[droppers]
alpha = 3.0
positions = [
  5.0,
  10.0,
]
"""
PLACES = [[12, 4, 0.003], [13, 1, -0.002]]


def changed(text, number, line):
    """The text with another line of this number."""
    lines = text.splitlines()
    return "\n".join([*lines[:number], line, *lines[number + 1 :]]) + "\n"


@pytest.mark.parametrize(
    ("key", "value", "number", "line"),
    [
        ("spans", 24, 2, 'spans = { value = 24, source = "why" }'),
        ("alpha", 0.5, 3, 'alpha = { value = 0.5, source = "why" }'),
        ("damping.alpha", 0.02, 6, 'alpha = { value = 0.02, source = "why" }'),
        ("damping.beta", [1.0, 2.5], 7, 'beta = { value = [1.0, 2.5], source = "why" }'),
        ("droppers.alpha", -1.0, 10, 'alpha = { value = -1.0, source = "why" }'),
    ],
)
def test_one_line_is_replaced_in_its_section(key, value, number, line):
    assert with_value(TEXT, key, value, "why", "a.toml") == changed(TEXT, number, line)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (TEXT, "droppers.positions"),  # spans lines
        (TEXT, "droppers.beta"),  # stands in another section only
        (TEXT, "damping.gamma"),
        (TEXT, "beta"),
        (TEXT, "nothing.alpha"),
        ("damping = { alpha = 1.0, beta = 2.0 }\n", "damping.alpha"),
        ("damping.alpha = 1.0\n", "damping.alpha"),
        ('note = """\nspans = 3\n"""\nspans = 3\n', "spans"),  # a line of a text looks like one
    ],
)
def test_a_value_without_a_line_of_its_own_is_refused(text, key):
    last = key.rpartition(".")[2]
    with pytest.raises(
        InputError, match=rf"{key} of a\.toml cannot be replaced: write {last} in a line of its"
    ):
        with_value(text, key, 5.0, "why", "a.toml")


def table(text, **values):
    return with_table(text, "as_found", values, {"miscut_droppers": "±1 mm", "ice": "seen"}, "a.toml")


def test_a_table_comes_to_the_end():
    found = table(TEXT, miscut_droppers=PLACES, ice=0.1)
    assert found.startswith(TEXT)
    assert found[len(TEXT) :] == (
        "\n[as_found]\n"
        'miscut_droppers = { value = [[12, 4, 0.003], [13, 1, -0.002]], source = "±1 mm" }\n'
        'ice = { value = 0.1, source = "seen" }\n'
    )
    assert tomllib.loads(found)["droppers"]["positions"] == [5.0, 10.0]


HEADERS = ["[as_found] # by hand, see [1]", "  [ as_found ]"]
ROWS = "miscut_droppers = [\n  [1, 2, 0.003],\n  [3, 4, 0.001]\n]\n"


@pytest.mark.parametrize("header", HEADERS)
@pytest.mark.parametrize("own", ["ice = 0.2\n", ROWS])
def test_a_table_is_replaced_wherever_and_however_it_stands(header, own):
    begin, end = TEXT.split("[droppers]")
    for text in (f"{begin}{header}\n{own}\n[droppers]{end}", f"{TEXT}\n{header}\n{own}"):
        assert tomllib.loads(table(text, ice=0.1)) == tomllib.loads(TEXT) | {
            "as_found": {"ice": {"value": 0.1, "source": "seen"}}
        }
    assert table(f"{header}\n{own}", ice=0.1).count("[") == 1


@pytest.mark.parametrize("own", ["as_found = { ice = 0.2 }", "as_found.ice = 0.2"])
def test_what_is_no_table_of_its_own_is_refused(own):
    with pytest.raises(InputError, match=r"as_found of a\.toml cannot be replaced: write it as a table"):
        table(f"{own}\n{TEXT}", ice=0.1)
