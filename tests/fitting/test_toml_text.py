"""Values and tables put into the text of a TOML file: nothing else of it changes."""

import tomllib

import pytest

from panto_env.base.errors import InputError
from panto_env.fitting.fitted_line import with_table, with_value

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


def test_sources_may_hold_anything():
    source = 'fitted to "a\\1.csv"; ±2 %\n{'
    found = with_value(TEXT, "damping.beta", 2e-4, source, "a.toml")
    assert "±" in found
    assert tomllib.loads(found)["damping"]["beta"] == {"value": 2e-4, "source": source}


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
