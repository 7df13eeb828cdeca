"""A line drawn: its values are those of the line that an environment with the seed has."""

import gymnasium
import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.analysis.line_check import check, drawn_line, table
from panto_env.analysis.parameters import check_name
from panto_env.analysis.sweep import sweep
from panto_env.catalog import load_catenary, load_drawn
from panto_env.plant.catenary.flexible.spans import spans_of


@pytest.mark.parametrize("source", ["family:high-speed", "section:main-line"])
def test_values_are_those_of_the_line_that_an_environment_has(source):
    family = load_drawn(source)
    found = drawn_line(family, 3)
    env = gymnasium.make("Pantograph-v0", catenary=source, speed_kmh=(0.0, family.fastest_kmh)).unwrapped
    env.reset(seed=3)
    line = env.task.plant.catenary
    each, _, encumbrances = spans_of(line)
    lengths = [span.span_length for span in each]
    assert found.span_length == pytest.approx(np.mean(lengths), rel=1e-12)
    assert found.length == pytest.approx(sum(lengths), rel=1e-12)
    assert (found.shortest_span, found.longest_span) == pytest.approx((min(lengths), max(lengths)), rel=1e-9)
    assert found.droppers == np.mean([len(span.droppers.positions) for span in each])
    assert found.encumbrance == pytest.approx(np.mean(encumbrances), rel=1e-12)
    assert found.pre_sag == max(max(span.droppers.sag) for span in each)
    at_rest = check(line, 100.0)
    assert found.gradient == pytest.approx(at_rest.largest_gradient)
    assert found.gradient_change == pytest.approx(at_rest.largest_change)
    assert {row[0] for row in table(family, [found]).rows} >= {"span (m)"}
    shown = "shortest span (m)" in {row[0] for row in table(family, [found]).rows}
    assert shown == source.startswith("section")
    assert found.contact_tension == line.contact_wire.tension / 1e3
    assert found.messenger_tension == line.messenger_wire.tension / 1e3
    assert found.wave_speed_kmh == pytest.approx(
        3.6 * np.sqrt(line.contact_wire.tension / line.contact_wire.mass)
    )
    run = simulate(line, family.plausible.pantograph, found.speed_kmh, record_droppers=False).summary()
    assert found.force_deviation == run.std / run.mean
    assert found.uplift == run.max_uplift


def test_an_unknown_parameter_names_one_place_of_each_list():
    with pytest.raises(InputError) as told:
        check_name("catenary.nothing", load_catenary("en50318-2002"))
    known = str(told.value).partition("known are ")[2]
    assert "catenary.droppers.positions.1," in known
    assert "catenary.contact_wire.tension" in known
    assert "positions.2" not in known


def test_a_sweep_takes_one_condition():
    with pytest.raises(InputError, match="takes one condition of the line, not a list"):
        sweep({"speed_kmh": [200.0]}, line_condition=("new", "smooth"), workers=1)
