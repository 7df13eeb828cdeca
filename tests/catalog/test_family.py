"""A family of lines: what is drawn from it lies in its ranges, hangs, and belongs together.

What holds for every description to draw from is tested of sections, too.
"""

import math

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.analysis.line_check import drawn_line
from panto_env.catalog import load_catenary, load_drawn, load_family, load_lines
from panto_env.catalog.family import LineFamily
from panto_env.catalog.loader import text_of
from panto_env.control.lines import on_drawn_line
from panto_env.control.settings import run_settings
from panto_env.plant.catenary.flexible.as_run import elasticity
from panto_env.plant.catenary.flexible.static import hang

FAMILY = load_family("high-speed")
DRAWN = {
    "family:high-speed": (200, 350),
    "family:conventional": (130, 220),
    "section:main-line": (120, 160),
    "section:fast-line": (250, 300),
}
"""Descriptions to draw from, with speeds (km/h) for their lines."""
drawn = pytest.mark.parametrize("source", DRAWN)


def line_of(seed, family="family:high-speed", speed_kmh=(200, 350)):
    """Line and speeds of the first episode under a seed."""
    settings = run_settings({"catenary": family, "speed_kmh": speed_kmh})
    drawn = on_drawn_line(settings, lambda: np.random.default_rng(seed))
    return drawn.line, drawn.speed_kmh


def values_of(line):
    """All that makes a line another one."""
    return line.model_dump_json(exclude={"sources"})


def file_of(tmp_path, *changes, source="family:high-speed"):
    kind, name = source.split(":")
    text = text_of(name)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return f"{kind}:{path}"


def inside(value, ends):
    return ends[0] <= value <= ends[1]


@pytest.mark.plain
def test_drawn_lines_lie_in_the_ranges_and_hang():
    sags, armed = [], set()
    for seed in range(12):
        line, (low, high) = line_of(seed)
        span, contact, messenger = line.span_length, line.contact_wire, line.messenger_wire
        assert inside(span, FAMILY.span_length)
        assert inside(line.encumbrance / span, FAMILY.encumbrance)
        assert inside(messenger.tension / contact.tension, FAMILY.tension_ratio)
        for wire, ranges in ((contact, FAMILY.contact_wire), (messenger, FAMILY.messenger_wire)):
            section = wire.mass / ranges.density
            assert inside(section, ranges.section)
            assert inside(wire.tension / section, ranges.stress)
            radius = math.sqrt(section / math.pi)
            assert wire.bending_stiffness == pytest.approx(ranges.modulus * math.pi * radius**4 / 4)
        x = np.array(line.droppers.positions)
        np.testing.assert_allclose(x + x[::-1], span)
        assert inside(x[0] / span, FAMILY.droppers.first)
        assert hang(line).dropper_length.min() >= FAMILY.droppers.shortest
        assert (hang(line).dropper_tension > 0).all()
        sags.append(max(line.droppers.sag) / span)
        armed.add((line.steady_arm.mass > 0, line.steady_arm.stiffness > 0))
        wave_speed_kmh = 3.6 * math.sqrt(contact.tension / contact.mass)
        assert max(200, 0.45 * wave_speed_kmh) == pytest.approx(low)
        assert min(350, 0.7 * wave_speed_kmh) == pytest.approx(high)
    assert min(sags) == 0  # a flat wire, or one with a pre-sag
    assert 0.0005 < max(sags) <= 0.001
    assert armed == {(False, False), (True, True)}  # steady arms on some lines, with both or without


@pytest.mark.slow
@pytest.mark.plain
@drawn
def test_a_seed_is_a_line_and_no_two_seeds_or_episodes_share_one(source):
    """Over the borders of the ranges for test, selection and training."""
    seeds = [*range(10), *range(995, 1005), *range(1995, 2005), 999_999]
    lines = [values_of(line_of(seed, source, DRAWN[source])[0]) for seed in seeds]
    assert len(set(lines)) == len(seeds)
    assert lines[7] == values_of(line_of(7, source, DRAWN[source])[0])
    random = np.random.default_rng(7)
    settings = run_settings({"catenary": source, "speed_kmh": DRAWN[source]})
    episodes = [values_of(on_drawn_line(settings, lambda: random).line) for _ in range(5)]
    assert episodes[0] == lines[7]
    assert len({*episodes, *lines}) == len(seeds) + 4


@pytest.mark.plain
@pytest.mark.parametrize(
    ("seed", "span", "tension", "mass", "droppers", "alpha"),
    [(0, 63.573, 21268.96, 0.91099, 8, 0.051311), (999, 41.578, 20018.06, 0.63192, 7, 0.086136)],
)
def test_the_lines_of_the_tests_stay_what_they_are(seed, span, tension, mass, droppers, alpha):
    """Another range, or another order of the draws, changes every result on a family."""
    line, _ = line_of(seed)
    found = line.span_length, line.contact_wire.tension, line.messenger_wire.mass, line.damping.alpha
    assert found == pytest.approx((span, tension, mass, alpha), rel=2e-5)
    assert len(line.droppers.positions) == droppers


@pytest.mark.plain
def test_a_list_is_drawn_from_evenly():
    names = ["re250", "re330", "ln2"]
    counts = dict.fromkeys(names, 0)
    for seed in range(90):
        counts[line_of(seed, names)[0].name] += 1
    assert all(18 < count < 42 for count in counts.values())
    drawn, plain = np.random.default_rng(3), np.random.default_rng(3)
    on_drawn_line(run_settings({"catenary": names}), lambda: drawn)
    assert drawn.random() == plain.random()  # the other values of an episode stay


@pytest.mark.plain
def test_speeds_choose_the_line():
    """A speed that only fast wires allow is given to these."""
    for seed in range(10):
        line, speeds = line_of(seed, speed_kmh=350)
        assert speeds == (350, 350)
        assert 0.7 * 3.6 * math.sqrt(line.contact_wire.tension / line.contact_wire.mass) >= 350
    for speed in (500, 100, math.nan):
        with pytest.raises(InputError, match="its trains run at 45 to 70 % of the wave speed"):
            line_of(0, speed_kmh=speed)


@pytest.mark.plain
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ((("value = [40.0, 65.0]", "value = [65.0, 40.0]"),), "key 'span_length' must not fall"),
        ((("value = [40.0, 65.0]", "value = 55.0"),), None),
        ((("value = [40.0, 65.0]", "value = [40.0, 900.0]"),), "key 'span_length.*from 2 to 200 m"),
        ((("value = 0.25, source", "value = 3.0, source"),), "No line of family 'mine' was found in 30"),
        ((("[pre_sag]", "[presag]"),), "presag"),
    ],
)
def test_families_of_one_s_own_are_read_and_checked(tmp_path, changes, message, monkeypatch):
    monkeypatch.setattr(LineFamily, "most_draws", 30)
    own = file_of(tmp_path, *changes)
    if message is None:
        assert line_of(1, own)[0].span_length == 55.0
        assert line_of(1, own)[0].name == "family:mine"
        return
    with pytest.raises(InputError, match=message) as caught:
        load_lines(own)
    assert "mine.toml" in str(caught.value)


@pytest.mark.plain
def test_where_one_line_is_needed_a_family_or_a_list_is_refused(tmp_path):
    for source in DRAWN:
        with pytest.raises(InputError, match="One line is needed here, not a list, a family or a section"):
            _ = run_settings({"catenary": source}).line
        with pytest.raises(InputError, match=f"One line is needed here, not the .* '{source}' to draw from"):
            load_catenary(source)
    with pytest.raises(InputError, match="A list of lines must have one line"):
        run_settings({"catenary": []})
    for source in DRAWN:
        kind, path = file_of(tmp_path, source=source).split(":")
        for other in ("", "family:" if kind == "section" else "section:"):
            with pytest.raises(InputError, match=f"so give it with '{kind}:' before its path"):
                run_settings({"catenary": f"{other}{path}"})
    with pytest.raises(InputError, match="Unknown family 'hihg-speed', did you mean 'high-speed'"):
        run_settings({"catenary": "family:hihg-speed"})
    with pytest.raises(InputError, match="Unknown section 'manline', did you mean 'main-line'"):
        run_settings({"catenary": "section:manline"})


@pytest.mark.parametrize("source", ["family:high-speed", "section:main-line"])
def test_a_saved_run_holds_its_line_and_can_be_repeated(source, tmp_path):
    given = {"seed": 5, "speed_kmh": DRAWN[source][1], "distance": 120.0, "line_condition": "fair"}
    run = simulate(source, **given)
    line, _ = line_of(5, source, DRAWN[source][1])
    assert run.catenary == line.name == source
    assert run.design["catenary"] == line.model_dump(mode="json")
    again = simulate(line, **given)
    np.testing.assert_array_equal(again.contact_force, run.contact_force)
    run.save(tmp_path / "run.parquet")
    assert type(run).load(tmp_path / "run.parquet").design["catenary"] == run.design["catenary"]


def test_a_required_mean_is_met_on_the_drawn_line():
    """The passes that trim the static force draw the same line and irregularity."""
    given = {"speed_kmh": 160, "line_condition": "fair", "accuracy": "fast"}
    run = simulate("family:conventional", seed=5, mean_force=130.0, **given)
    assert run.summary().mean == pytest.approx(130.0, abs=0.06)


def check_seeds_are_plausible(lines, seeds):
    """Each line hangs, runs, and lies in the stated bands."""
    found = [drawn_line(lines, seed) for seed in seeds]
    assert [(one.seed, one.outside(lines), one.ending) for one in found if one.outside(lines)] == []
    return found


@pytest.mark.slow
@drawn
def test_drawn_lines_are_plausible(source):
    """A sample; `make studies` tries a thousand."""
    for one in check_seeds_are_plausible(
        load_drawn(source), range(8 if source == "family:high-speed" else 3)
    ):
        line, (_, fastest) = line_of(one.seed, source, DRAWN[source])
        assert one.speed_kmh == fastest
        # The middle of a span of two strings that act together yields L / 4 (T1 + T2); droppers add to it.
        both = line.contact_wire.tension + line.messenger_wire.tension
        assert 1.0 < one.elasticity / (one.longest_span / (4 * both)) < 1.4
        assert one.elasticity == pytest.approx(elasticity(line, 120.0)[1].max(), rel=0.1)


@pytest.mark.study
def test_a_thousand_drawn_lines_are_plausible_and_drawn_in_milliseconds():
    found = check_seeds_are_plausible(FAMILY, range(1000))
    assert np.median([one.milliseconds for one in found]) < 20
    assert np.mean([one.draws for one in found]) < 3
