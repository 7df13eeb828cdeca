"""Lines from tables of masts, and ``panto line``."""

import json
import re
import tomllib
from pathlib import Path

import pytest
from matplotlib.image import imread

from panto_env import InputError
from panto_env.catalog import load_catenary
from panto_env.catalog.loader import parse_catenary, text_of
from panto_env.catalog.masts import line_from_masts
from panto_env.plant.catenary.flexible.static import droppers_at_rest, hang

from ..command import panto

POSITIONS = [0, 65, 130, 190, 245, 290, 345, 410]
CONTACT = [5.3, 5.3, 5.3, 5.3, 5.25, 5.15, 5.25, 5.3]
MESSENGER = [7.1, 7.1, 7.1, 7.1, 6.85, 6.45, 6.85, 7.1]
LOW = "[span_types.low]\nsupport = {stiffness = 1e6}\n[span_types.'v.1']\nsupport = {stiffness = 1e6}\n"
"""Types of spans to add to a line."""


def table(separator=",", decimal="."):
    rows = [["position (m)", "contact height (m)", "messenger height (m)"]]
    rows += [[f"{x:g}" for x in row] for row in zip(POSITIONS, CONTACT, MESSENGER, strict=True)]
    return "\n".join(separator.join(cell.replace(".", decimal) for cell in row) for row in rows)


def made(text, tmp_path, base="re250"):
    path = tmp_path / "masts.csv"
    path.write_text(text)
    toml = line_from_masts(base, path)
    return parse_catenary(tomllib.loads(toml), Path("mine.toml"))


@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", ","), ("\t", ",")])
def test_masts_give_lengths_and_heights(separator, decimal, tmp_path):
    line = made(table(separator, decimal), tmp_path)
    layout = line.layout()
    spans, heights, encumbrances = layout.spans, layout.contact_heights, layout.encumbrances
    assert line.alignment().supports == tuple(map(float, POSITIONS))
    assert heights == (0.0, 0.0, 0.0, 0.0, -0.05, -0.15, -0.05, 0.0)  # over that at the first mast
    assert encumbrances == (1.8, 1.8, 1.8, 1.8, 1.6, 1.3, 1.6, 1.8)
    assert spans[0].droppers == load_catenary("re250").droppers
    assert len(spans[4].droppers.positions) == 5
    assert line.name == "mine"
    assert line.sources["sequence"] == "masts.csv"
    assert line.sources["contact_wire.tension"] == "recalled: medium confidence"


def test_equal_spans_between_masts_are_the_line_itself(tmp_path):
    text = "span (m),type\n60,\n60,\n60,\n60,\n,\n"
    file = tmp_path / "base.toml"
    file.write_text(text_of("en50318-2002"))
    line, base = made(text, tmp_path, file), load_catenary("en50318-2002")
    assert line.model_copy(update={"name": base.name, "sources": base.sources}) == base.model_copy(
        update={"spans": 4}
    )


def test_masts_name_types_of_the_base_line(tmp_path):
    base = tmp_path / "base.toml"
    base.write_text(text_of("re250").replace("[support]", f"{LOW}[support]"))
    text = "span;type;encumbrance\n65;;1,8\n60;low;1,5\n45;v.1;1,4\n50;;1,6\n;;1,8\n"
    layout = made(text, tmp_path, base).layout()
    spans, encumbrances = layout.spans, layout.encumbrances
    assert [span.support.stiffness for span in spans] == [500e3, 1e6, 1e6, 500e3]
    assert [span.span_length for span in spans] == [65.0, 60.0, 45.0, 50.0]
    assert encumbrances == (1.8, 1.5, 1.4, 1.6, 1.8)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("contact_height\n5\n5\n", "either a column position .* or a column span"),
        ("position\n", "has a header and no mast under it"),
        ("span\n65\n60\n60\n60\n", "No span begins at the last mast"),
        ("span,type\n65,\n,\n60,\n60,\n,\n", "Mast 2 of .* has no span"),
        ("position\n0\n60\n50\n170\n", "Mast 3 of .* stands no farther than the one before"),
        ("position\n0\n60\n", "has 1 spans between its masts; a line has from 3 to 1000"),
        ("position\n0\n60\n1200\n1260\n", "Mast 2 of .* begins a span of 1140 m; a span has from 2 to 200"),
        ("position,type\n0,a\n60,\n120,\n170,\n", "Mast 1 of .* type 'a', but 're250' has none"),
        (
            "position,messenger_height\n0,7\n60,7\n120,7\n170,7\n",
            "needs contact_height beside messenger_height",
        ),
        ("position,contact height (ft)\n0,7\n60,7\n120,7\n", "in 'ft'; known units are m, mm"),
        ("position;encumbrance\n0;1,8\n60;a\n120;1,8\n170;1,8\n", "Line 3 of .* encumbrance holds 'a'"),
        ("position;encumbrance\n0;1,8\n60;\n120;1,8\n170;1,8\n", "Line 3 of .* encumbrance is empty"),
    ],
)
def test_a_table_that_gives_no_line_is_refused_in_one_sentence(text, message, tmp_path):
    with pytest.raises(InputError, match=message) as caught:
        made(text, tmp_path)
    assert str(caught.value).count(". ") == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("flexible", "three_span"), "is not a flexible line"),
        (
            lambda text: text.replace("spans = ", 'sequence = ["a"]\nspans = '),
            "has a sequence of spans already",
        ),
        (lambda text: text.replace("spans = ", "[droppers]\nspans = ", 1), "not valid TOML"),
        (
            lambda text: text.replace("spans = { value = 12,", "'spans' = { value = 12,"),
            "cannot be written into",
        ),
    ],
)
def test_a_base_line_that_takes_no_sequence_is_refused(change, message, tmp_path):
    base = tmp_path / "base.toml"
    base.write_text(change(text_of("re250")))
    with pytest.raises(InputError, match=message) as caught:
        made(table(), tmp_path, base)
    assert str(caught.value).count(". ") == 0


@pytest.mark.longer
def test_the_command_makes_shows_draws_and_checks_a_line(tmp_path):
    masts, toml, drawing = (tmp_path / name for name in ("masts.csv", "my-line.toml", "line.png"))
    masts.write_text(table(";", ","))
    assert panto("line", "re250", "--output", "x.toml").returncode == 2
    result = panto("line", "re250", "--masts", masts, "--output", toml, "--plot", drawing, "--speed", 60)
    assert result.returncode == 0, result.stderr
    line = load_catenary(toml)
    for each in droppers_at_rest(line):
        assert f"{each.static_force:.1f}" in result.stdout
        assert f"{each.length:.4f}" in result.stdout
    assert re.search(r"gradient .*\bat\s.*\bmost\s.*\b20\.0 ", result.stdout, re.DOTALL)
    assert imread(drawing).shape[1] > 500
    again = panto("line", toml, "--speed", 250, "--json")
    assert again.returncode == 1  # 2.2 ‰ where 1 ‰ is allowed
    found = json.loads(again.stdout)
    assert len(found["spans"]) == 7
    assert {each["key"] for each in found["criteria"] if each["kept"] is False} == {
        "gradient",
        "gradient_change",
    }
    assert found["droppers"] == [each._asdict() for each in droppers_at_rest(line)]


def test_masts_say_which_supports_have_a_stitch_wire(tmp_path):
    """Empty cells are the line's own; 0 is none, at the last mast too. Cant and radius may be empty, too."""
    header = "position (m),stitch wire (m),cant (mm),r (km)"
    text = f"{header}\n0,,,\n65,,,\n125,0,100,1.5\n180,16,,\n245,,,\n310,0,,\n"
    line = made(text, tmp_path, "re330-stitched")
    found = line.layout().stitches
    assert found.support.tolist() == [0, 1, 3, 4]
    assert (found.end - found.begin).tolist() == [18.0, 18.0, 16.0, 18.0]
    assert len(hang(line).ropes) == 4
    bent = [(mast.cant, mast.radius) for mast in line.masts]
    assert bent == [(None, None)] * 2 + [(0.1, 1500.0)] + [(None, None)] * 3
