"""What a run is held against: each limit, its margin and verdict, and where it comes from."""

import json
import math
import re

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.catalog import available, load_catenary
from panto_env.catalog.loader import FOLDERS
from panto_env.metrics import compliance as en50367
from panto_env.metrics.compliance import (
    Criterion,
    LineFacts,
    compliance,
    criteria_table,
    limits_in_words,
    margin_in_words,
    of_train,
    remarks,
    value_in_words,
    worst,
)
from panto_env.metrics.figures import Figures, arcing, contact_loss

from ..command import panto
from ..pages import DOCS
from .test_summary import replace


def by_key(criteria):
    return {criterion.key: criterion for criterion in criteria}


def figures(**given):
    zeros = dict.fromkeys(Figures.none().as_dict(), 0.0)
    return Figures(**zeros | given)


def of_force(figures, nq, speed_kmh, system="AC"):
    return by_key(en50367.criteria(figures, nq, speed_kmh / 3.6, system, "drawing 1"))


@pytest.mark.parametrize(
    ("system", "speed", "largest", "smallest"),
    [
        ("AC", 100, 94.7, 64.7),
        ("AC", 200, 108.8, 78.8),
        ("AC", 201, 0.00097 * 201**2 + 70, 0.00047 * 201**2 + 60),
        ("AC", 300, 157.3, 102.3),
        ("AC 25 kV", 300, 157.3, 102.3),
        ("DC 1.5 kV", 150, 141.3, 95.2),
        ("DC 1.5 kV", 200, 181.2, 114.8),
        ("DC 1.5 kV", 250, 200.625, 140.0),
        ("DC 3 kV", 100, 119.7, 69.6),
        ("DC 3 kV", 250, 170.625, 120.0),
    ],
)
def test_mean_force_is_limited_by_speed_and_system(system, speed, largest, smallest):
    assert en50367.largest_mean(speed / 3.6, system) == pytest.approx(largest)
    assert en50367.smallest_mean(speed / 3.6, system) == pytest.approx(smallest)
    for mean, kept in ((largest - 0.01, True), (largest + 0.49, True), (largest + 0.51, False)):
        criterion = of_force(figures(mean=mean), 0.0, speed, system)["mean"]
        assert criterion.kept is kept
        assert "± 0.5" in limits_in_words(criterion)
        assert criterion.margin == pytest.approx(largest - mean, abs=1e-9)
        assert ("--mean-force en50367" in criterion.note) != kept
    too_low = of_force(figures(mean=smallest - 1), 0.0, speed, system)["mean"]
    assert (too_low.kept, too_low.margin) == (False, pytest.approx(-1.0))


@pytest.mark.parametrize("system", ["DC 600 V", "DC 750 V"])
def test_supplies_without_a_mean_force_of_the_standard(system):
    found = of_force(figures(mean=300.0), 0.0, 60, system)
    assert (found["mean"].kept, found["mean"].limited, found["mean"].verdict) == (None, False, "")
    assert found["max"].kept
    with pytest.raises(InputError, match=rf"^EN 50367 has no mean force for {system}; give"):
        simulate(load_catenary("re250").model_copy(update={"system": system}), mean_force="en50367")


def test_f_m_plus_3_sigma_is_judged_beside_the_maximum_and_sources_say_what_is_recalled():
    found = of_force(figures(mean=150.0, std=70.0, statistical_max=360.0, max=340.0), 0.0, 250)
    assert (found["statistical_max"].highest, found["statistical_max"].verdict) == (350.0, "broken")
    assert found["max"].verdict == "kept"
    assert all("recalled" in criterion.source for criterion in found.values())
    assert "AC, the line's power supply (drawing 1)" in found["mean"].note
    assert "--mean-force en50367" in found["mean"].note
    assert "contact loss CL counts all" in found["arcing"].note


def test_static_force_is_judged_by_power_supply():
    for system, static, verdict in (
        ("AC 25 kV", 70.0, "kept"), ("AC", 91.0, "broken"), ("DC 3 kV", 70.0, "broken"),
        ("DC 3 kV", 110.0, "kept"), ("DC 1.5 kV", 111.0, "broken"), ("DC 750 V", 90.0, "kept"),
        ("DC 600 V", 121.0, "broken"), ("AC", math.nan, "not judged"),
    ):  # fmt: skip
        (found,) = en50367.of_static(static, system)
        assert found.verdict == verdict
        assert ("not judged, as" in found.note) == (verdict == "not judged")
        ((*_, shown, _),) = criteria_table([found], "").cells
        assert shown == verdict
    assert en50367.of_static(None, "AC") == []


def test_the_static_force_of_a_run_is_the_one_that_was_set(reference_run):
    """Trim included; a force that does not depend on speed counts only where air hardly lifts."""
    trimmed = simulate("periodic-stiffness", "three-mass", 250.0, mean_force=140.0)
    assert trimmed.static_force == pytest.approx(trimmed.nominal_force - 0.00097 * 250**2)
    assert by_key(trimmed.compliance())["static_force"].value == trimmed.static_force
    assert by_key(reference_run.compliance())["static_force"].verdict == "not judged"
    assert simulate("periodic-stiffness", "identified-2dof", 100.0).static_force == pytest.approx(54.0)


def test_a_policy_that_moves_a_trimmed_mean_by_a_tenth_does_not_break_the_limit():
    run = simulate("periodic-stiffness", "three-mass", 250.0, mean_force="en50367")
    limit = en50367.largest_mean(250 / 3.6, "AC")
    assert abs(by_key(run.compliance())["mean"].margin) < 0.15
    moved = replace(run, contact_force=run.contact_force + limit + 0.05 - run.summary().mean)
    criterion = by_key(moved.compliance())["mean"]
    assert criterion.margin == pytest.approx(-0.05, abs=1e-6)
    assert criterion.kept
    assert "--mean-force" not in criterion.note


def test_other_limits_at_both_sides_of_their_speeds():
    at = figures(mean=100.0, std=31.0, max=320.0)
    slow, medium, fast = (of_force(at, 0.15, v) for v in (190, 240, 280))
    assert [each["max"].highest for each in (slow, medium, fast)] == [300, 350, 350]
    assert [each["arcing"].highest for each in (slow, medium, fast)] == [0.1, 0.1, 0.2]
    assert [each["arcing"].kept for each in (slow, medium, fast)] == [False, False, True]
    assert [each["max"].kept for each in (slow, medium, fast)] == [False, True, True]
    assert (fast["std"].highest, fast["std"].kept) == (pytest.approx(30.0), False)
    assert fast["std"].margin == pytest.approx(-1.0)
    assert [en50367.maximum_limit(v / 3.6, "AC") for v in (200, 205)] == [300, 350]


@pytest.mark.parametrize("system", ["DC 1.5 kV", "DC 3 kV"])
def test_maximum_force_and_arcing_depend_on_the_power_supply(system):
    """Recalled: 400 N above 200 km/h under DC; NQ of 0.2 % from 160 km/h under DC, above 250 under AC."""
    at = figures(mean=150.0, max=380.0)
    direct = [of_force(at, 0.15, v, system) for v in (159, 160, 200, 201, 300)]
    assert [each["max"].highest for each in direct] == [300, 300, 300, 400, 400]
    assert [each["max"].kept for each in direct] == [False, False, False, True, True]
    assert [each["arcing"].highest for each in direct] == [0.1, 0.2, 0.2, 0.2, 0.2]
    assert [each["arcing"].kept for each in direct] == [False, True, True, True, True]
    assert {each["max"].source for each in direct} == {"EN 50119, recalled"}
    for voltage in ("AC", "AC 15 kV", "AC 25 kV"):
        other = of_force(at, 0.15, 201, voltage)
        assert (other["max"].highest, other["arcing"].highest) == (350, 0.1)


def of_line(line=LineFacts(), **given):  # noqa: B008
    none = np.zeros((0, 0))
    return by_key(compliance(figures(mean=100.0, **given), 0.0, line, 70.0, none, none))


def test_minimum_force_must_be_positive():
    below, at, above = (of_line(min=value)["min"] for value in (-1.0, 0.0, 0.1))
    assert (below.kept, at.kept, above.kept) == (False, False, True)
    assert above.margin == pytest.approx(0.1)
    assert (limits_in_words(above), above.source) == ("above 0", "EN 50119, recalled")


def test_room_for_the_uplift_is_smaller_where_a_stop_limits_it():
    """Of 140 mm, twice is more than a room of 240 mm, and 1.5 times is not (EN 50119, recalled)."""
    line = LineFacts(free_uplift=0.24, free_uplift_source="drawing 2")
    free, stopped = (
        of_line(replace(line, uplift_stop=stop), max_uplift=0.14)["uplift"] for stop in (False, True)
    )
    assert (free.name, free.value, free.kept) == ("twice the uplift", pytest.approx(280.0), False)
    assert (stopped.name, stopped.value) == ("1.5 times the uplift", pytest.approx(210.0))
    assert stopped.kept
    assert "no stop limits it" in free.note
    assert "a stop limits it" in stopped.note
    assert "drawing 2" in stopped.note


def test_an_arc_is_a_loss_of_more_than_5_ms():
    """Of 40 steps of 2.5 ms: losses of one, two, and three steps, and four at the very end."""
    force = np.full(40, 100.0)
    force[[0, 10, 11, 20, 21, 22, 36, 37, 38, 39]] = 0.0
    assert arcing(force, 2.5e-3) == pytest.approx(100 * 7 / 40)
    assert arcing(force, 6e-3) == pytest.approx(100 * 10 / 40)
    assert arcing(force, 1e-3) == 0.0
    assert contact_loss(force) == pytest.approx(100 * 10 / 40)
    assert arcing(np.full(5, 1.0), 1e-2) == 0.0
    assert arcing(np.zeros(5), 1e-2) == 100.0


def test_margin_is_to_the_nearer_limit():
    between = Criterion("a", "a", "N", 7.0, 5.0, 10.0)
    assert (between.margin, between.kept) == (2.0, True)
    assert [Criterion("a", "a", "N", value, 5.0, 10.0).margin for value in (4.0, 12.0)] == [-1, -2]
    one, two = ([Criterion("a", "a", "N", value, None, 10.0)] for value in (9.0, 11.0))
    assert worst([one, two]) == two
    told = Criterion("a", "a", "N", 4.0)
    assert math.isnan(told.margin)
    assert told.kept is None
    assert Criterion("a", "a", "N", 4.0, 4.0, None).kept


def test_tables_show_limits_and_lines_the_rest():
    criteria = [
        Criterion("a", "mean", "N", 101.0, 80.0, 100.0, "EN 1", "as one reads it"),
        Criterion("b", "Doppler", "", 0.25),
    ]
    table = criteria_table(criteria, "title")
    assert table.cells == [("mean (N)", "101.0", "80.0 to 100.0", "-1.000", "broken", "EN 1")]
    assert remarks(criteria) == ["mean: as one reads it.", "Doppler: 0.250"]


def test_every_criterion_of_a_run(reference_run):
    run, speed = reference_run, 300 / 3.6
    found, whole = by_key(run.compliance()), run.summary()
    wave = math.sqrt(20e3 / 1.35)
    assert found["mean"].value == whole.mean
    assert (found["mean"].lowest, found["mean"].highest) == (pytest.approx(102.3), pytest.approx(157.3))
    assert found["std"].highest == pytest.approx(0.3 * whole.mean)
    assert found["max"].value == whole.max
    assert found["arcing"].value == 0.0
    assert found["uplift"].value == pytest.approx(2e3 * whole.max_uplift)
    assert found["uplift"].highest == 240.0
    assert "recalled: twice the 120 mm" in found["uplift"].note
    assert (found["min"].value, found["min"].lowest, found["min"].kept) == (whole.min, 0.0, True)
    assert (found["speed"].value, found["speed"].highest) == (pytest.approx(speed / wave), 0.7)
    assert found["doppler"].value == pytest.approx((wave - speed) / (wave + speed))
    assert found["doppler"].kept is None
    inside = run.inside()
    tension = run.dropper_force[inside]
    assert found["dropper force"].value == tension.max()
    slack = [
        np.mean(tension[here][:, (run.dropper_position // 60) == span] <= 0)
        for span in range(9, 19)
        if (here := run.position[inside] // 60 == span).any()
    ]
    assert found["slack"].value == pytest.approx(100 * np.mean(slack), rel=0.01)
    assert 0 < found["slack"].value < 20


def test_what_waves_meet_is_told_of_lines_that_have_it(reference_run):
    found = by_key(reference_run.compliance())
    expected = load_catenary("en50318-2002").reflections(300 / 3.6 / 60.0)
    assert (found["dropper reflection"].value, found["support reflection"].value) == expected
    assert not re.search(r"\d", found["support reflection"].name)  # a report names it once, for all speeds
    bare = replace(reference_run, line=replace(reference_run.line, dropper_reflection=math.nan))
    assert set(found) - set(by_key(bare.compliance())) == {"dropper reflection", "support reflection"}


def test_waves_come_back_from_what_they_meet():
    """A dropper as stiff as can be between equal strings sends back half; a stiff or heavy arm, all."""
    line = load_catenary("benchmark-2015")
    dropper, support = line.reflections(1.5)
    contact, messenger = math.sqrt(22e3 * 1.35), math.sqrt(16e3 * 1.08)
    assert dropper == pytest.approx(messenger / (contact + messenger))
    equal = line.model_copy(update={"messenger_wire": line.contact_wire})
    assert equal.reflections(1.5)[0] == pytest.approx(0.5)
    arm = line.steady_arm
    # What comes back and what goes on share the wave's power.
    omega = 2 * math.pi * 1.5
    spring = arm.stiffness - omega**2 * arm.mass
    passed = abs(2j * omega * contact / (spring + 2j * omega * contact))
    assert support**2 + passed**2 == pytest.approx(1.0)

    def with_arm(**given):
        return line.model_copy(update={"steady_arm": arm.model_copy(update=given)})

    assert with_arm(stiffness=1e9).reflections(1.5)[1] == pytest.approx(1.0, abs=1e-3)
    assert with_arm(mass=1e6).reflections(1.5)[1] == pytest.approx(1.0, abs=1e-3)
    assert with_arm(stiffness=0.0, mass=0.0).reflections(1.5)[1] == 0.0


def printed(*arguments):
    result = panto(*arguments)
    assert result.returncode == 0, result.stderr
    return result.stdout


def own_line(folder, values):
    """A line of the user's: that of EN 50318:2002 with other values of power supply and room, or none."""
    text = (FOLDERS["catenary"] / "en50318-2002.toml").read_text()
    own = ("system", "free_uplift", "uplift_stop")
    kept = "".join(line for line in text.splitlines(keepends=True) if not line.startswith(own))
    mine = folder / "mine.toml"
    mine.write_text(kept.replace("[contact_wire]", f"{values}[contact_wire]", 1))
    return mine


def test_every_line_of_the_catalogue_names_its_power_supply_with_a_source():
    for name in available("catenary"):
        source = load_catenary(name).source_of("system")
        assert source.split(":")[0] in ("seen", "recalled", "own choice"), name
    assert load_catenary("re330").system == "AC 15 kV"
    assert load_catenary("ln2").system == "AC 25 kV"


def test_a_line_says_its_system_and_its_room(tmp_path):
    room = 'free_uplift = { value = 0.2, source = "seen: my drawing" }\n'
    mine = own_line(tmp_path, f'system = "DC 3 kV"\n{room}uplift_stop = true\n')
    told = json.loads(printed("simulate", "--catenary", mine, "--speed", 160, "--json"))["compliance"]
    found = {criterion["key"]: criterion for criterion in told}
    assert found["mean"]["highest"] == pytest.approx(0.00097 * 160**2 + 110)
    assert found["mean"]["lowest"] == pytest.approx(0.00096 * 160**2 + 60)
    assert found["arcing"]["highest"] == 0.2
    assert "DC 3 kV, the line's power supply (no source is named)" in found["mean"]["note"]
    assert found["uplift"]["name"] == "1.5 times the uplift"
    assert found["uplift"]["highest"] == pytest.approx(200.0)
    assert "seen: my drawing" in found["uplift"]["note"]
    assert {"value", "margin", "kept", "source", "unit"} <= set(found["std"])


@pytest.mark.parametrize(
    ("value", "highest", "texts"),
    [
        (157.34, 157.32, ("157.34", "at most 157.32", "-0.020")),
        (157.32, 157.34, ("157.3", "at most 157.3", "0.020")),
        (157.3, 157.3, ("157.3", "at most 157.3", "0.000")),
        (10.0004, 9.9999, ("10.00", "at most 9.9999", "-0.001")),
        (0.1000001, 0.1, ("0.1000001", "at most 0.1000000", "-0.0000001")),
        (9.9996, 9.9996, ("10.000", "at most 10.000", "0.000")),
        (math.nan, 0.1, ("–", "at most 0.100", "–")),
    ],
)
def test_text_says_whether_a_limit_is_kept(value, highest, texts):
    found = Criterion("a", "a", "N", value, highest=highest)
    assert (value_in_words(found), limits_in_words(found), margin_in_words(found)) == texts
    lowest = Criterion("a", "a", "N", -value, lowest=-highest)
    assert lowest.kept == found.kept
    limit = float(limits_in_words(lowest).removeprefix("at least "))
    assert found.kept is None or (float(value_in_words(lowest)) >= limit) == found.kept


def test_requirements_of_a_train_are_those_of_the_pantograph_with_the_smallest_margin():
    def own(std, arcing, room):
        return [
            Criterion("std", "σ", "N", std, None, 30.0),
            Criterion("arcing", "NQ", "%", arcing, None, 0.1),
            Criterion("uplift", "uplift", "mm", room, None, 100.0),
            Criterion("doppler", "Doppler factor", "", 0.5),
        ]

    found = of_train([own(20.0, 0.3, math.nan), own(25.0, 0.2, 40.0), own(22.0, math.nan, math.nan)])
    assert [(one.criterion.key, one.pantograph) for one in found] == [
        ("std", 2),
        ("arcing", 1),
        ("uplift", 2),
    ]
    (alone,) = of_train([own(math.nan, math.nan, math.nan)[:1]])
    assert (alone.pantograph, alone.criterion.kept) == (1, None)


def test_the_tutorial_s_first_runs_keep_all_requirements():
    """It had broken the mean force twice, with a pantograph whose values are invented."""
    text = (DOCS / "own-line.md").read_text(encoding="utf-8")
    (line,) = re.findall(r"panto list (\S+) --toml > my-line.toml", text)
    runs = re.findall(r"panto simulate --catenary my-line.toml --pantograph (\S+) --speed (\d+)", text)
    assert len(runs) == 2
    for pantograph, speed in runs:
        assert not pantograph.startswith("own-")
        criteria = simulate(line, pantograph, float(speed)).compliance()
        assert [each.name for each in criteria if each.kept is False] == []
