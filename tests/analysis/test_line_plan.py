"""A line seen from above, as ``panto line`` prints it: curves, storms, pressed arms, wires off the head."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from panto_env.analysis.line_check import check
from panto_env.analysis.line_plan import line_plan
from panto_env.analysis.plots import plot_line
from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.plan import plan_view
from panto_env.plant.line_condition import NEW, LineCondition

from ..command import panto

BASE = Path(__file__).parents[2] / "panto_env" / "catalog" / "catenaries" / "en50318-2002.toml"
ARM = "[steady_arm]\nmass = 1.5\nlength = 1.2\n\n"


def written(folder, plan, arm=ARM, spans=60.0):
    text = BASE.read_text()
    begin, end = text.index("[steady_arm]"), text.index("[damping]")
    arm = arm if arm is not None else text[begin:end]
    text = text[:begin] + arm + f"[plan]\n{plan}\n\n" + text[end:]
    if spans != 60.0:
        droppers = text.index("[droppers]")
        text = (
            text[:droppers].replace("span_length = { value = 60.0", f"span_length = {{ value = {spans}")
            + "[droppers]\nspacing = 6.5\nfirst = 5.0\nstiffness = 100e3\n\n"
            + text[text.index("[support]") :]
        )
    file = folder / "line.toml"
    file.write_text(text)
    return file


def asked(file, *options):
    result = panto("line", file, *options, "--json")
    assert result.returncode in (0, 1), result.stderr
    table = json.loads(result.stdout)
    return result.returncode, table["plan"], {each["key"]: each for each in table["criteria"]}


def test_a_storm_presses_an_arm_and_the_command_says_so(tmp_path):
    file = written(tmp_path, "stagger = [0.3, -0.3]")
    code, calm, criteria = asked(file)
    assert code == 0
    assert calm["wind_loads"] == [0, 0]
    assert "pull_in_wind" not in criteria
    code, plan, criteria = asked(file, "--line-condition", "new:side_wind=28")
    assert code == 1
    assert criteria["pull_in_wind"]["value"] == pytest.approx(-100, abs=3)
    assert criteria["pull_in_wind"]["kept"] is False
    assert criteria["lateral_position"]["value"] == pytest.approx(0.3077, abs=1e-3)
    assert criteria["position_on_head"]["value"] == pytest.approx(0.3077 + 0.11 + 0.06 * 0.3 / 1.5, abs=1e-3)
    first, second = plan["supports"][:2]
    assert (first["number"], first["position"]) == (1, 0)
    assert first["pull"] == pytest.approx(-first["still_pull"] + 2 * first["still_pull"] - 500, abs=6)
    assert first["rise"] < -0.02
    assert 0.017 < second["rise"] < 0.019
    assert [span["blow_off"] for span in plan["spans"]] == pytest.approx([0.19, 0.19], abs=2e-3)


@pytest.mark.parametrize(("span", "stagger", "out"), [(60.0, 0.4, -0.725), (35.0, 0.25, 0.25)])
def test_in_a_curve_of_400_m_long_spans_leave_the_head(span, stagger, out, tmp_path):
    """The chord is L^2 / 8 R inside the track's middle in mid-span: 1.125 m of 60 m, 0.383 m of 35 m."""
    code, plan, criteria = asked(written(tmp_path, f"stagger = [{-stagger}]\nradius = 400", spans=span))
    assert plan["spans"][0]["radius"] == 400
    inner = span**2 / 8 / 400 - stagger  # to the right, inside a curve to the right
    expected = max(abs(inner), stagger)
    assert (
        abs(plan["spans"][0]["still"])
        == pytest.approx(expected, abs=1e-3)
        == pytest.approx(abs(out), abs=1e-3)
    )
    assert criteria["lateral_position"]["kept"] is (expected <= 0.4)
    assert criteria["position_on_head"]["kept"] is (expected + 0.122 <= 0.6)
    assert code == (0 if expected < 0.4 else 1)
    assert plan["supports"][0]["force"] == pytest.approx(-20e3 * span / 400, rel=1e-3)  # outward: to the left


def test_a_wider_head_has_other_limits(tmp_path):
    _, _, criteria = asked(written(tmp_path, "stagger = [0.5, -0.5]\nhead_width = 1.95"))
    assert (criteria["lateral_position"]["highest"], criteria["position_on_head"]["highest"]) == (0.55, 0.775)
    assert criteria["lateral_position"]["kept"] is True
    _, _, criteria = asked(written(tmp_path, "stagger = [0.5, -0.5]"))
    assert criteria["lateral_position"]["kept"] is False


def test_an_arm_that_hardly_pulls_breaks_its_limit(tmp_path):
    code, plan, criteria = asked(
        written(tmp_path, "stagger = [0.04, -0.04]", arm=None)
    )  # arms have no length
    assert code == 1
    assert criteria["smallest_radial_force"]["value"] == pytest.approx(4 * 20e3 * 0.04 / 60, rel=1e-3)
    assert math.isnan(plan["supports"][0]["slope"] or math.nan)
    assert "arm_slope" not in criteria


def test_a_canted_track_is_set_out_from_its_plumb_line():
    """A source has 125 mm over 1.435 m at a height of 6 m: 0.52265 m."""
    line = load_catenary("en50318-2002").model_dump(exclude={"sources"}, exclude_none=True)
    plan = {"stagger": (-0.25,), "radius": 800.0, "cant": 0.125, "cant_base": 1.435, "contact_height": 6.0}
    found = line_plan(FlexibleCatenaryData.model_validate(line | {"plan": plan}), NEW)
    assert found is not None
    assert found.supports[0].setting_out == pytest.approx(-0.25 + 0.52265, abs=1e-5)
    left = plan | {"stagger": (0.25,), "radius": -800.0}
    found = line_plan(FlexibleCatenaryData.model_validate(line | {"plan": left}), NEW)
    assert found is not None
    assert found.supports[0].setting_out == pytest.approx(0.25 - 0.52265, abs=1e-5)


def test_a_line_without_stagger_has_no_plan():
    assert line_plan(load_catenary("en50318-2002"), LineCondition(side_wind=20)) is None


@pytest.mark.longer
@pytest.mark.parametrize("wind", [0.0, 20.0])
def test_the_drawing_shows_the_plan(wind, tmp_path):
    line = load_catenary(str(written(tmp_path, "stagger = [0.3, -0.3]")))
    found = line_plan(line, LineCondition(side_wind=wind))
    assert found is not None
    axis = plot_line(check(line, 100.0), found).axes[3]
    curves = {each.get_label(): each for each in axis.lines}
    shown = curves["contact wire, in the wind" if wind else "contact wire"]
    x, y = shown.get_data()
    expected = plan_view(line.layout(20), found.loads).at(np.asarray(x) + 60.0 * 8)
    assert (x[0], x[-1]) == (0, pytest.approx(180))
    assert y == pytest.approx(expected, abs=2e-4)


SURVEYS = {
    "all": ["0.3", "-0.3"] * 6 + ["0.3"],
    "one is missing": ["0.3", "-0.3"] * 3 + [""] + ["-0.3", "0.3"] * 3,
}


@pytest.mark.longer
@pytest.mark.parametrize("base", ["en50318-2002", "re250", "arms"])
@pytest.mark.parametrize("name", SURVEYS)
def test_a_survey_of_equal_spans_is_seen_from_above_where_it_has_all_staggers(base, name, tmp_path):
    masts = tmp_path / "masts.csv"
    rows = [f"M{k},{60 * k},{stagger}" for k, stagger in enumerate(SURVEYS[name])]
    masts.write_text("\n".join(["mast,position (m),stagger (m)", *rows]) + "\n")
    line = written(tmp_path, "contact_height = 5.5") if base == "arms" else base
    result = panto("line", line, "--masts", masts, "--plot", tmp_path / "line.png", cwd=tmp_path)
    if name == "all":
        assert result.returncode == 0, result.stderr
        assert "The contact wire's lateral position" in result.stdout
        assert re.search("12 │ +straight", result.stdout)
    elif base == "en50318-2002":  # nothing depends on it
        assert result.returncode == 0, result.stderr
        assert "not seen from above: not every mast has a stagger" in result.stdout
    elif base == "re250":  # which has a plan
        assert result.returncode == 0, result.stderr
        missing = sum(not each for each in SURVEYS[name])
        told = " ".join(result.stdout.split())
        assert f"{missing} of 13 masts have no stagger, and theirs is assumed" in told
    else:
        assert "Support 7 (M6) of line 'masts' has no stagger" in result.stderr.replace("\n", " ")


def planned(plan, **changes):
    """en50318-2002 with a plan and arms by their length."""
    line = load_catenary("en50318-2002").model_dump(exclude={"sources"}, exclude_none=True)
    arm = {"mass": 1.5, "length": 1.2}
    return FlexibleCatenaryData.model_validate(line | {"plan": plan, "steady_arm": arm} | changes)


def test_wind_that_blows_the_wire_back_hides_no_broken_limit():
    """At a radius of 1 km the middle lies 0.45 m out in still air; wind from outside brings it in."""
    line = planned({"stagger": [0.0], "radius": 1000.0})
    blown = NEW.model_copy(update={"side_wind": -25.0})
    found = {each.key: each for each in line_plan(line, blown).criteria()}
    assert found["lateral_position"].value == pytest.approx(0.45, abs=0.02)
    assert not found["lateral_position"].kept
    assert found["largest_radial_force"].value == pytest.approx(1200, rel=0.01)


def test_points_beyond_the_spans_that_are_shown_do_no_harm_in_wind():
    line = planned({"stagger": [0.3, -0.3]}, spans=40, points=[{"span": 30, "offset": 20.0, "mass": 8.0}])
    blown = NEW.model_copy(update={"side_wind": 20.0})
    assert line_plan(line, blown).criteria()
