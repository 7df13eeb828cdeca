"""Lines as sequences of spans: how their TOML is read, and what is refused."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from panto_env.analysis.parameters import change, change_together
from panto_env.base.errors import InputError
from panto_env.catalog import load_catenary
from panto_env.catalog.values import by_value, values_of
from panto_env.plant.catenary.flexible.layout import Layout
from panto_env.plant.catenary.flexible.parts import Span
from panto_env.plant.catenary.flexible.schema import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.static import hang, solve
from panto_env.plant.catenary.rig import RigData
from panto_env.plant.catenary.schema import BY_DEFAULT

from ..finite_element.sections import line_of, of_catalogue, sections
from ..uniform_lines import UNIFORM

FILE = """
kind = "flexible"
description = "of a test"
span_length = 65.0
encumbrance = 1.8
contact_wire = {mass = 1.07, tension = 15e3, bending_stiffness = 137.5}
messenger_wire = {mass = 0.6, tension = 15e3, bending_stiffness = 41.4}
support = {stiffness = 500e3, damping = 1000.0}
steady_arm = {mass = 0.0, stiffness = 0.0}
damping = {alpha = 0.0125, beta = 1e-4}
"""
DROPPERS = "droppers = {spacing = 7.0, first = 5.0, pre_sag = 0.06, stiffness = 100e3}\n"
SPANS = """
sequence = ["long", "short", "short", {type = "bridge", contact_height = -0.05}, "long"]
[span_types.long]
[span_types.short]
span_length = {value = 45.0, source = "drawing 4711"}
[span_types.bridge]
encumbrance = 1.2
support = {stiffness = 2e6}
droppers = {positions = [5.0, 20.0, 32.5, 45.0, 60.0], pre_sag = 0.02, mass = 0.2}
"""


def read(text, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return load_catenary(path)


def spelt_out(name, count=6):
    """A line of the catalogue with its own span written out, once as a table and once by its type."""
    table = of_catalogue(name).model_dump(exclude_none=True)
    own = {key: table[key] for key in Span.model_fields if key in table}
    del table["spans"]
    return table | {"span_types": {"usual": own}, "sequence": ["usual", own, *["usual"] * (count - 2)]}


@pytest.mark.parametrize("name", UNIFORM)
def test_equal_spans_written_out_are_the_uniform_line(name):
    line = of_catalogue(name).model_copy(update={"spans": 6})
    for table in (spelt_out(name), json.loads(json.dumps(spelt_out(name)))):
        written = FlexibleCatenaryData.model_validate(table)
        assert written == line
        assert hash(written) == hash(line)
        assert written.model_dump() == line.model_dump()
        assert solve(written) is solve(line)
    assert FlexibleCatenaryData(**spelt_out(name)) == line


def test_equal_spans_written_out_name_sources_only_of_values_that_the_line_gives(tmp_path):
    own = 'encumbrance = {value = 1.8, source = "drawing 1"}'
    file = FILE.replace("encumbrance = 1.8", own) + DROPPERS
    usual = read(file + 'sequence = ["a", "a", "a"]\n[span_types.a]\n', tmp_path)
    found = {each.key: each.source for each in values_of(usual)}
    assert found["encumbrance"] == "drawing 1"
    assert found["droppers.mass"] == found["system"] == BY_DEFAULT
    assert not found.keys() & {"sequence", "span_types", "sequence.1", "span_types.a"}
    lower = read(file + 'sequence = ["a", "a", "a"]\n[span_types.a]\nencumbrance = 1.2\n', tmp_path)
    assert lower.encumbrance == 1.2
    assert {each.key: each.source for each in values_of(lower)}["encumbrance"] == ""


def test_values_of_a_sequence_have_the_source_of_their_table(tmp_path):
    line = read(FILE + DROPPERS + SPANS, tmp_path)
    assert by_value(line)["sources"]["span_types.short.span_length"] == "drawing 4711"
    sequence = 'sequence = {value = ["a", "a", {type = "a", span_length = 40.0}], source = "masts.csv"}\n'
    line = read(FILE + DROPPERS + sequence + "[span_types.a]\n", tmp_path)
    found = {each.key: each.source for each in values_of(line)}
    assert [found[f"sequence.{number}"] for number in (1, 2, 3)] == 3 * ["masts.csv"]
    assert found["droppers.mass"] == BY_DEFAULT
    assert found["droppers.stiffness"] == ""


def test_what_a_type_leaves_out_is_the_line_s_own(tmp_path):
    line = read(FILE + DROPPERS + SPANS, tmp_path)
    layout = line.layout()
    spans, heights, encumbrances = layout.spans, layout.contact_heights, layout.encumbrances
    assert line.spans == 5
    assert line.alignment().supports == (0.0, 65.0, 110.0, 155.0, 220.0, 285.0)
    assert heights == (0.0, 0.0, 0.0, -0.05, 0.0, 0.0)
    assert encumbrances == (1.8, 1.8, 1.8, 1.2, 1.8, 1.8)
    bridge = spans[3]
    assert bridge.support.stiffness == 2e6
    assert bridge.support.damping == 1000.0
    assert bridge.droppers.stiffness == 100e3
    assert bridge.droppers.mass == 0.2
    assert spans[0].droppers.mass == 0.0
    assert line.sources["span_types.short.span_length"] == "drawing 4711"


def test_droppers_at_a_spacing_stand_evenly_and_the_wire_hangs_in_a_parabola(tmp_path):
    line = read(FILE + DROPPERS + SPANS, tmp_path)
    positions, sag = np.array(line.droppers.positions), np.array(line.droppers.sag)
    assert len(positions) == 9  # 55 m in gaps near 7 m: eight
    np.testing.assert_allclose(positions, 5 + 55 / 8 * np.arange(9))
    np.testing.assert_allclose(sag, 0.06 * (1 - ((positions - 32.5) / 27.5) ** 2), atol=1e-15)
    long, short, _, bridge, _ = line.layout().spans
    assert long.droppers == line.droppers
    # Left out in a shorter span: the same distances, and as much pre-sag per metre of span.
    np.testing.assert_allclose(short.droppers.positions, 5 + 35 / 5 * np.arange(6))
    assert max(short.droppers.sag) == pytest.approx(0.06 * 45 / 65 * (1 - (3.5 / 17.5) ** 2))
    near = 0.02 * (1 - (12.5 / 27.5) ** 2)
    np.testing.assert_allclose(bridge.droppers.sag, [0, near, 0.02, near, 0], atol=1e-15)


def test_a_line_of_unlike_spans_is_the_same_after_a_round_trip(tmp_path):
    line = read(FILE + DROPPERS + SPANS, tmp_path)
    again = FlexibleCatenaryData.model_validate_json(line.model_dump_json())
    assert again == line
    assert again.layout() == line.layout()
    rig = RigData.model_validate({"name": "rig", "description": "of it", "line": line})
    assert rig.alignment() == line.alignment()


def test_a_parameter_changes_every_span_that_leaves_it_out(tmp_path):
    line = change(read(FILE + DROPPERS + SPANS, tmp_path), "catenary.encumbrance", 1.6)
    assert line.layout().encumbrances == (1.6, 1.6, 1.6, 1.2, 1.6, 1.6)
    stiffer = change(line, "catenary.contact_wire.tension", 18e3)
    assert solve(stiffer).dropper_tension.max() != solve(line).dropper_tension.max()


def test_a_parameter_that_every_span_replaces_is_refused(tmp_path):
    spans = ", ".join(f"{{span_length = {length}, encumbrance = 1.7}}" for length in (65.0, 60.0, 50.0, 65.0))
    line = read(FILE + DROPPERS + f"sequence = [{spans}]\n", tmp_path)
    with pytest.raises(InputError, match=r"encumbrance cannot be 1.5: Each span .* so nothing would change"):
        change(line, "catenary.encumbrance", 1.5)
    with pytest.raises(InputError, match=r"do not go together.* place of encumbrance, so nothing"):
        change_together(line, {"catenary.encumbrance": 1.5})
    stiffer = change(line, "catenary.support.stiffness", 1e6)
    assert {span.support.stiffness for span in stiffer.layout().spans} == {1e6}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"short", "short"', '"short", "shrt"', "type 'shrt' of span 3 of the sequence .* mean 'short'"),
        (', "short", {type = "bridge", contact_height = -0.05}, "long"]', "]", "from 3 to 1000 spans, not 2"),
        ("pre_sag = 0.02", "sag = [0.0]", "type 'bridge' in span_types .* 5 positions are given, but 1"),
        ("45.0, 60.0", "45.0, 70.0", "type 'bridge' in span_types .* dropper at 70.0 m lies outside"),
        ("{stiffness = 2e6", "{stifness = 2e6", "'bridge' .* 'support.stifness' is not known: did"),
        ("encumbrance = 1.2", "encumberance = 1.2", "'encumberance' is not known: did you mean 'enc"),
        ("contact_height = -0.05", "contact_height = -50", "span 4 of the sequence .* from -2 to 2 m"),
        ('type = "bridge"', 'kind = "bridge"', "span 4 of the sequence .* 'kind' is not known"),
        ("sequence =", "spans = 7\nsequence =", "has 5 spans, but spans is 7; leave spans out"),
        ('type = "bridge"', 'type = ["bridge"]', "type '\\['bridge'\\]' of span 4 of the sequence is not in"),
        ("[5.0, 20.0, 32.5, 45.0, 60.0]", "[5.0, 'a', 60.0]", "'droppers.positions.\\d' must be a number"),
        ("[5.0, 20.0, 32.5, 45.0, 60.0]", "[60.0, 5.0]", "positions must increase from the support"),
        ("[5.0, 20.0, 32.5, 45.0, 60.0]", "7.0", "'droppers.positions' must be a list"),
        (
            "[span_types.short]\n",
            "[span_types.short]\ndroppers = 3\n",
            "'short' .* 'droppers' must be a table",
        ),
        ('"short", "short"', "3, 4", r"key 'sequence.\d.* must be"),
        ("mass = 0.2", "spacing = 6.0", "either positions or a spacing"),
        ('sequence = ["long"', 'sequenc = ["long"', "'sequenc' is not known: did you mean 'sequence'"),
        ("sequence =", "spans = 5\nother =", "'other' is not known"),
    ],
)
def test_a_sequence_that_cannot_be_is_refused_in_one_sentence(old, new, message, tmp_path):
    text = FILE + DROPPERS + SPANS
    assert old in text
    with pytest.raises(InputError, match=message) as caught:
        read(text.replace(old, new), tmp_path)
    assert str(caught.value).count(". ") == 0
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("droppers", "message"),
    [
        ("{spacing = 0.1, stiffness = 1e5}", "'spacing' must be a number from 1 to 200 m"),
        ("{pre_sag = 0.05, stiffness = 1e5}", "'spacing' is missing: approximate distance between droppers"),
        ("{spacing = 6, first = 40.0, stiffness = 1e5}", "would cross in a span of 65 m"),
        ("{spacing = 6, sag = [0.0], stiffness = 1e5}", "sag needs their positions"),
        ("{positions = [9, 56], sag = [0, 0], pre_sag = 0.1, stiffness = 1e5}", "no pre_sag beside it"),
        ("{positions = [9, 56], spacing = 5, stiffness = 1e5}", "either positions or a spacing"),
        ("{stiffness = 1e5}", "'droppers.positions' is missing"),
    ],
)
def test_droppers_without_table_or_rule_are_refused_in_one_sentence(droppers, message, tmp_path):
    with pytest.raises(InputError, match=message) as caught:
        read(f"{FILE}spans = 8\ndroppers = {droppers}\n", tmp_path)
    assert str(caught.value).count(". ") == 0


def test_types_without_a_sequence_are_refused(tmp_path):
    text = FILE + "spans = 8\n" + DROPPERS + "[span_types.long]\n"
    with pytest.raises(InputError, match="span_types, overlaps or an end_support needs a sequence"):
        read(text, tmp_path)


def test_the_example_of_the_document_hangs(tmp_path):
    """With the droppers that it sets without a table, too."""
    page = (Path(__file__).parents[2] / "docs" / "own-section.md").read_text()
    spans, droppers, *_ = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    own = FILE.replace("span_length = 65.0\n", "") + droppers + spans
    line = read(own, tmp_path)
    assert [span.span_length for span in line.layout().spans] == [65.0, 65.0, 45.0, 40.0, 45.0, 65.0]
    assert line.layout().contact_heights == (0.0, 0.0, 0.0, -0.05, -0.05, 0.0, 0.0)
    assert len(line.droppers.positions) == 9
    assert max(line.droppers.sag) == pytest.approx(0.05)


def test_the_examples_of_stitch_wires_and_overlaps_hang():
    page = (Path(__file__).parents[2] / "docs" / "own-section.md").read_text()
    *_, stitch, overlap = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    own = {"sequence": ["without", *[{}] * 19]} | tomllib.loads(stitch) | tomllib.loads(overlap)
    line = line_of("re330-stitched", own)
    hang(line)
    assert [round(part.end) for part in line.layout().tension_lengths] == [17 * 65, 20 * 65]
    assert line.layout().stitches.support.tolist() == list(range(1, 21))


ALIKE = load_catenary("re330").layout(12)
MIXED, OVERLAPPED = (sections()[name].line.layout() for name in ("mixed", "overlap-2002"))


@pytest.mark.parametrize("layout", [ALIKE, MIXED, OVERLAPPED], ids=["uniform", "mixed", "overlap"])
def test_a_dropper_is_found_by_its_span_and_number(layout: Layout):
    for k, dropper in enumerate(layout.droppers):
        assert layout.index(dropper.span, dropper.number) == k
        begin, end = layout.supports[dropper.span - 1 : dropper.span + 1]
        assert layout.positions[k] == dropper.position == pytest.approx(begin + dropper.place)
        assert begin < dropper.position < end
    spans = [dropper.span for dropper in layout.droppers]
    assert spans == sorted(spans)
    assert set(spans) == set(range(1, len(layout.spans) + 1))


def test_every_dropper_of_a_tension_length_is_one_of_the_line():
    parts = OVERLAPPED.tension_lengths
    assert sorted(np.concatenate([part.droppers for part in parts])) == list(range(len(OVERLAPPED.droppers)))
    for part in parts:
        for k, own in zip(part.droppers.tolist(), part.layout.droppers, strict=True):
            whole = OVERLAPPED.droppers[k]
            assert (whole.span, whole.pair) == (part.first_span + own.span, part.pair)
            assert (whole.place, whole.sag, whole.table) == (own.place, own.sag, own.table)


def test_a_dropper_that_the_line_has_not_is_refused():
    with pytest.raises(InputError, match=r"no dropper 99 in span 12: it has 12 spans of 7 droppers\."):
        ALIKE.index(12, 99)
    with pytest.raises(InputError, match=r"no dropper 1 in span 15: it has 14 spans, and span 14 has \d+ dr"):
        MIXED.index(15, 1)
