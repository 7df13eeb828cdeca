"""Sections to draw from, and those of the catalogue: spans by curve, masts as built, bridges, gradients."""

import json
import math
import tomllib
from itertools import combinations, pairwise

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.analysis.line_check import check
from panto_env.catalog import load_catenary, load_pantograph, load_section
from panto_env.catalog.loader import file_of, text_of
from panto_env.catalog.section import Bridge, Kinds, Masts, lowered
from panto_env.plant.catenary.flexible.plan import in_still_air, steady_arms
from panto_env.plant.catenary.flexible.static import hang

NAMES = ("main-line", "fast-line", "curved-line")
FIXED = {
    "re250-curves": ("re250", 250.0),
    "beijing-tianjin-viaduct": ("beijing-tianjin", 300.0),
    "sweden-st15-bridge": ("sweden-st15", 200.0),
}
"""Sections of the catalogue, with the line whose wires they have and their highest speed (km/h)."""


def drawn(name, seed):
    return load_section(name).draw(np.random.default_rng(seed))[0]


def own(tmp_path, *changes, name="main-line"):
    text = text_of(name)
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return path


def overlaps_are_described(section, line):
    """Each at its distance from the one before, with wires that go straight on from the parabola."""
    described, supports, behind = section.overlaps, line.alignment().supports, 0.0
    low = line.encumbrance - section.masts.height_error - 1e-3  # under a bridge
    assert line.overlaps
    for overlap in line.overlaps:
        assert overlap.spans == described.spans
        assert described.rise[0] - 1e-3 <= overlap.rises[0] <= described.rise[1] + 1e-3
        span = overlap.first_span - 1 + overlap.spans // 2
        begin, end = supports[span], supports[span + 1]
        # Up to a few hundred metres away from where it is drawn if there is a bridge.
        assert begin - behind - 500.0 < described.distance[1]
        assert end - behind > described.distance[0] / 2
        heights = (line.contact_heights or (0.0,) * len(supports))[
            overlap.first_span - 1 : overlap.first_span + overlap.spans
        ]
        assert set(heights) == {0.0}
        beside = slice(overlap.first_span - 1, overlap.first_span + overlap.spans)
        assert min(line.layout().encumbrances[beside]) >= low
        slopes = np.diff(overlap.rises) / line.alignment().lengths[span + 1 : span + len(overlap.rises)]
        np.testing.assert_allclose(slopes, 4 * overlap.rises[0] / (end - begin), rtol=0.05)
        behind = (begin + end) / 2
    assert supports[-1] - behind < described.distance[1] + 500.0


@pytest.mark.longer
@pytest.mark.plain
@pytest.mark.parametrize("name", NAMES)
def test_drawn_lines_are_what_the_section_describes(name):
    section, with_ramps = load_section(name), 0
    masts, bridges = section.masts, section.bridges
    for seed in range(8):
        line = drawn(name, seed)
        layout = line.layout()
        each, heights, encumbrances = layout.spans, layout.contact_heights, layout.encumbrances
        lengths = np.array([span.span_length for span in each])
        assert section.spans[0] <= len(lengths) <= section.spans[1]
        longest = min(line.span_length, section.curves.straight) + 2 * masts.position_error
        assert (
            0.5 * line.span_length < lengths.min() < 0.95 * line.span_length < lengths.max() <= longest + 1e-3
        )
        assert np.abs(np.diff(lengths)).max() <= masts.difference + 4 * masts.position_error + 2e-3
        planned = [round(length / masts.step) * masts.step for length in lengths]
        assert np.abs(lengths - planned).max() > 0  # as built
        usual = line.encumbrance
        low = [k for k, each in enumerate(encumbrances) if each < usual - masts.height_error - 1e-3]
        assert len(low) <= 2 * bridges.count[1]
        for k in low:
            assert bridges.encumbrance[0] - masts.height_error - 1e-3 <= encumbrances[k]
            assert min(lengths[k - 1], lengths[k]) <= bridges.span_length[1] + 2 * masts.position_error + 1e-3
        assert -bridges.count[1] * bridges.lowering[1] - 1e-3 <= min(heights) <= max(heights) == 0.0
        with_ramps += min(heights) < 0
        shape = hang(line)
        assert shape.dropper_tension.min() > 0
        assert shape.dropper_length.min() >= section.droppers.shortest
        first, spacing = section.droppers.first, section.droppers.spacing
        for span in each:
            x = np.array(span.droppers.positions)
            assert first[0] - 1e-9 <= x[0] <= first[1] + 1e-9
            assert 0.8 * spacing[0] < np.diff(x).min() <= np.diff(x).max() < 1.2 * spacing[1]
        overlaps_are_described(section, line)
    assert with_ramps > 2 or bridges.lowering[1] == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_gradients_are_legal_at_the_highest_speed(name):
    """By the check that `panto line` prints; and lines with ramps come near the limit."""
    steepest, fastest = [], load_section(name).fastest_kmh
    for seed in range(12):
        found = check(drawn(name, seed), 100.0)
        shown = [each for each in found.criteria(fastest) if "gradient" in each.name]
        assert [each.kept for each in shown] == [True, True]
        steepest.append(found.largest_gradient)
    assert max(steepest) > (2.0 if name == "main-line" else -1.0)  # of 3.3 per mille


@pytest.mark.plain
@pytest.mark.parametrize(
    ("name", "seed", "spans", "length", "span_12", "lowest"),
    [("main-line", 0, 47, 2593.684, 60.179, -0.3716), ("fast-line", 999, 47, 2403.941, 51.253, 0.0)],
)
def test_the_lines_of_the_tests_stay_what_they_are(name, seed, spans, length, span_12, lowest):
    """Another range, or another order of the draws, changes every result on a section."""
    line = drawn(name, seed)
    found = (
        line.spans,
        line.alignment().length,
        line.sequence[11]["span_length"],
        min(line.contact_heights or (0.0,)),
    )
    assert found == pytest.approx((spans, length, span_12, lowest), abs=1e-6)


@pytest.mark.plain
def test_spans_get_shorter_in_curves():
    curves = load_section("main-line").curves
    for radius, longest in ((math.inf, 65.0), (2000.0, 57.5), (1000.0, 50.0), (500.0, 40.0)):
        assert curves.longest_span(radius) == pytest.approx(longest)
    straight = curves.model_copy(update={"chance": 0.0})
    tight = curves.model_copy(update={"chance": 1.0, "radius": (500.0, 500.0)})
    random = np.random.default_rng(0)
    assert set(straight.draw(random, 60.0, 30)[0]) == {60.0}  # the line's own
    assert set(straight.draw(random, 80.0, 30)[0]) == {65.0}
    lengths, curvature = tight.draw(random, 60.0, 30)
    assert set(lengths) == {40.0}
    assert curvature == pytest.approx(np.full(30, 1 / 500))
    mixed, curvature = curves.draw(random, 60.0, 4000)
    assert 0.4 < np.mean(curvature > 0) < 0.6
    assert (mixed[curvature == 0] == 60.0).all()
    stretches = np.split(mixed, np.flatnonzero(np.diff(mixed)) + 1)
    assert 0.2 < np.mean(mixed < 60.0) < 0.5  # half of the stretches, of which the widest curves have 60 m
    assert 200.0 < np.median([each.sum() for each in stretches if each[0] < 60.0]) < 600.0


@pytest.mark.plain
def test_planned_spans_are_the_longest_that_the_rules_allow():
    """Compared with a search: none could be a step longer."""
    masts = Masts(step=1.0, difference=6.0, position_error=0.0, height_error=0.0)
    random = np.random.default_rng(1)
    for _ in range(20):
        longest = random.uniform(30.0, 65.0, 12)
        lengths = masts.planned(longest)
        assert (lengths <= longest).all()
        np.testing.assert_allclose(lengths % 1.0, 0.0)
        assert max(abs(a - b) for a, b in pairwise(lengths)) <= 6.0
        rest = np.full(12, 30.0) // 1
        grown = True
        while grown:
            grown = False
            for k in range(12):
                tried = rest.copy()
                tried[k] += 1.0
                if tried[k] <= longest[k] and np.abs(np.diff(tried)).max() <= 6.0:
                    rest, grown = tried, True
        np.testing.assert_array_equal(lengths, rest)


@pytest.mark.plain
def test_ramps_have_as_few_spans_as_the_gradient_allows():
    """2 ‰, and 1 ‰ of change: 50 m spans sink by 50 and 50 mm in two spans, by 50, 100 and 50 mm in three."""
    lengths, limits = np.full(12, 50.0), (2.0, 1.0)
    found = lowered(Bridge(5, 50.0, 0.7, 0.15, 1.0), lengths, limits)
    down = np.array([0.0, -0.0375, -0.1125, -0.15])
    np.testing.assert_allclose(found, [0.0, 0.0, *down, *down[::-1], 0.0, 0.0, 0.0], atol=1e-12)
    assert lowered(Bridge(5, 50.0, 0.7, 0.1, 1.0), lengths, limits)[3] == 0.0  # two spans are enough
    assert lowered(Bridge(5, 50.0, 0.7, 0.101, 1.0), lengths, limits)[3] < 0.0
    assert lowered(Bridge(5, 50.0, 0.7, 0.9, 1.0), lengths, limits) is None  # no room
    assert lowered(Bridge(1, 50.0, 0.7, 0.1, 1.0), lengths, limits) is None
    assert not lowered(Bridge(0, 50.0, 0.7, 0.0, 1.0), lengths, limits).any()


@pytest.mark.plain
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ((("[120.0, 160.0]", "[200.0, 280.0]"),), "lowering must be 0, as EN 50119 allows no gradient"),
        ((('"sweden-st15"', '"re250-curves"'),), "base must not have a sequence of spans"),
        ((('"sweden-st15"', '"periodic-stiffness"'),), "'base' must be a flexible line or a family"),
        (
            (('"sweden-st15"', '"swedn-st15"'),),
            "key 'base' names no line: Unknown catenary 'swedn-st15', did you mean 'sweden-st15",
        ),
        ((("[1000.0, 4000.0]", "[300.0, 4000.0]"),), "radius begins at 300 m, but longest has no span below"),
        (
            (("[[1000.0, 50.0], [500.0, 40.0]]", "[[500.0, 40.0], [1000.0, 50.0]]"),),
            "must list falling radii",
        ),
        (
            (("[[1000.0, 50.0], [500.0, 40.0]]", "[[1000.0, 50.0], [500.0, 60.0]]"),),
            "longer span in a tighter",
        ),
        ((("[0, 2]", "2"), ("[0.0, 0.4]", "2.0")), "No line of section 'mine' was found in 100 draws"),
        ((("[curves]", "[curve]"),), "curve"),
    ],
)
def test_sections_that_cannot_be_are_refused(changes, message, tmp_path):
    path = own(tmp_path, *changes)
    with pytest.raises(InputError, match=message) as caught:
        load_section(path)
    text = str(caught.value)
    assert text.count("\n") == 0
    assert "mine.toml" in text
    assert text.endswith(".")


@pytest.mark.plain
def test_speeds_are_the_section_s_own():
    section = load_section("main-line")
    assert section.draw(np.random.default_rng(0), (100.0, 140.0))[1] == (120.0, 140.0)
    one, other = (
        section.draw(np.random.default_rng(0), speeds)[0] for speeds in ((120.0, 130.0), (150.0, 200.0))
    )
    assert one == other  # a seed is a line, at whatever speed
    for speed in (100.0, 200.0, math.nan):
        with pytest.raises(InputError, match="its trains run at 120 to 160 km/h; change the speed"):
            section.draw(np.random.default_rng(0), (speed, speed))
    fast, (low, high) = load_section("fast-line").draw(np.random.default_rng(2))
    assert (low, high) == (250.0, min(300.0, 0.7 * 3.6 * fast.contact_wire.wave_speed))


@pytest.mark.plain
def test_a_section_may_have_any_line_of_one_s_own_as_its_base(tmp_path):
    base = tmp_path / "wires.toml"
    text = text_of("re250").replace("value = 65.0, source", "value = 55.0, source")
    base.write_text(text.replace(", 60.0]", "]").replace(", 0.0]", "]"))
    section = load_section(own(tmp_path, ('"sweden-st15"', json.dumps(str(base)))))
    line = section.draw(np.random.default_rng(3))[0]
    assert line.contact_wire == load_catenary("re250").contact_wire
    assert line.name == "section:mine"
    assert 54.0 < line.alignment().lengths.max() <= 55.6
    assert line.sources["contact_wire.tension"] == load_catenary("re250").sources["contact_wire.tension"]
    assert line.sources["sequence.1"] == line.sources["droppers.positions"] == "drawn from section:mine"


def test_without_a_plan_arms_are_as_stiff_as_on_the_base_line(tmp_path):
    base = tmp_path / "wires.toml"
    base.write_text(text_of("re250").replace("[plan]\n", "[plan]\nwind = [2.0, 2.0]\n"))
    section = load_section(own(tmp_path, ('"sweden-st15"', json.dumps(str(base)))))
    line, there = section.draw(np.random.default_rng(3))[0], load_catenary(base)
    expected = steady_arms(in_still_air(there).layout(5))
    assert line.steady_arm.stiffness == expected.stiffness[0] > 100
    assert line.steady_arm.mass == expected.mass[0]
    assert line.plan is None
    assert not line.arms_by_plan
    with_plan = load_section("curved-line").model_copy(update={"base": there})
    assert with_plan.draw(np.random.default_rng(3))[0].plan == there.plan


# --- sections of the catalogue ---------------------------------------------------------------------


@pytest.mark.plain
@pytest.mark.parametrize("name", FIXED)
def test_a_section_of_the_catalogue_has_all_values_of_its_base_line(name):
    """Only its spans and its plan are its own, so that a value that is corrected there is corrected here."""
    mine, base = (tomllib.loads(file_of(each).read_text()) for each in (name, FIXED[name][0]))
    words = {"description", "spans", "sequence", "span_types", "overlaps", "plan", "masts"}
    assert {key: mine[key] for key in mine.keys() - words} == {key: base[key] for key in base.keys() - words}
    line = load_catenary(name)
    assert 2000.0 < line.alignment().length < 4000.0
    lengths = line.alignment().lengths
    assert len(set(lengths)) >= 4
    assert 40.0 <= lengths.min() < lengths.max() <= 65.0
    assert f"{line.alignment().length / 1e3:.1f} km" in line.description
    wires = [part.end - part.begin for part in line.layout().tension_lengths]
    assert 1000.0 < max(wires[:-1]) <= max(wires) <= 1400.0


@pytest.mark.slow
@pytest.mark.parametrize(("name", "speed"), [(name, speed) for name, (_, speed) in FIXED.items()])
def test_a_section_of_the_catalogue_keeps_the_standards(name, speed):
    """A passive run, gradients, and what the droppers carry at rest."""
    line = load_catenary(name)
    at_rest = check(line, 100.0)
    assert all(each.kept is not False for each in at_rest.criteria(speed))
    assert min(each.static_force for each in at_rest.droppers) > 20.0
    pantograph = "dsa380" if speed > 200 else "dsa250"
    run = simulate(name, pantograph, speed, mean_force="en50367", record_droppers=False)
    assert not run.terminated
    figures = run.summary()
    assert all(math.isfinite(value) for value in figures.as_dict().values())
    assert [each.name for each in run.compliance() if each.kept is False] == []
    assert figures.std < 0.3 * figures.mean
    assert figures.contact_loss == 0.0
    assert run.spans() == (10, line.spans - 8)


@pytest.mark.slow
def test_on_the_ramps_of_the_bridge_the_damper_to_the_ground_changes_the_mean_force():
    line = load_catenary("sweden-st15-bridge")
    found = check(line, 100.0)
    assert found.largest_gradient == pytest.approx(1e3 * 0.1 / 55.0)
    assert found.largest_change == pytest.approx(1e3 * 0.05 / 55.0)
    bridge = next(k for k, item in enumerate(line.sequence, start=1) if item == "bridge")
    run = simulate(line, "dsa250", 200, record_droppers=False)
    down, up = run.summary((bridge - 3, bridge - 1)).mean, run.summary((bridge + 1, bridge + 3)).mean
    climbed, damping = 0.25 / 165.0, load_pantograph("dsa250").dampings[-1]
    assert down - up == pytest.approx(2 * damping * run.speed * climbed, abs=2.0)


def test_kinds_that_are_joined_have_spans_and_droppers_of_their_own():
    plain = load_section("main-line")
    kinds = Kinds(spans=(8, 12), share=(0.8, 1.0))
    random = np.random.default_rng(3)
    number, shares = kinds.draw(random, 40)
    lengths = np.bincount(number)
    assert lengths.sum() == 40
    assert lengths[:-1].min() >= 8
    assert lengths.max() <= 12
    assert ((shares >= 0.8) & (shares <= 1.0)).all()
    joined = plain.model_copy(update={"kinds": kinds})
    for seed in range(2):
        line = joined.draw(np.random.default_rng(seed))[0]
        firsts = [span.droppers.positions[0] for span in line.layout().spans]
        assert 3 <= len(set(firsts)) <= 6  # one for each of some 36 to 48 spans' kinds
        assert sum(a != b for a, b in pairwise(firsts)) == len(set(firsts)) - 1
        alone = plain.draw(np.random.default_rng(seed))[0]
        assert len({span.droppers.positions[0] for span in alone.layout().spans}) == 1


@pytest.mark.longer
@pytest.mark.plain
@pytest.mark.parametrize("name", NAMES)
def test_seeds_give_lines_that_differ_widely(name):
    """Not one line with a little noise: in number of spans, in each span's length, in bridges."""
    lines = [drawn(name, seed) for seed in range(20)]
    lengths = [np.array([span.span_length for span in line.layout().spans]) for line in lines]
    assert len({len(each) for each in lengths}) >= 6
    apart, alike = [], []
    for a, b in combinations(lengths, 2):
        n = min(len(a), len(b))
        apart.append(np.abs(a[:n] / a.max() - b[:n] / b.max()).mean())
        alike.append(np.corrcoef(a[:n], b[:n])[0, 1])
    assert min(apart) > 0.04
    assert abs(np.mean(alike)) < 0.1
    lowest = [int(np.argmin([item["encumbrance"] for item in line.sequence])) for line in lines]
    assert len(set(lowest)) > 8
