"""Points of a line: the same as hard spots and bumps of a condition, and as finite elements have them."""

import re
import tomllib

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.catalog import line, load_catenary
from panto_env.catalog.values import values_of
from panto_env.plant.catenary.flexible import points
from panto_env.plant.catenary.flexible.arrays import CONTACT, PAD
from panto_env.plant.catenary.flexible.build import constants
from panto_env.plant.catenary.flexible.resolution import resolution
from panto_env.plant.catenary.flexible.schema import Rayleigh
from panto_env.plant.catenary.flexible.static import solve
from panto_env.plant.catenary.flexible.wire_defects import locate
from panto_env.plant.catenary.flexible.wires import along
from panto_env.plant.line_condition import LineCondition
from panto_env.plant.numerics import Runs

from ..documents import ROOT
from . import test_flexible
from .test_flexible import energy, swing, undamped

NAME = "en50318-2002"
SPOT = {"name": "section insulator", "span": 3, "offset": 27.0, "mass": 8.0, "stiffness": 3000.0}
STEP = {"name": "splice", "span": 4, "offset": 12.0, "step": 0.002, "length": 1.6}
AS_DEFECTS = {"hard_spots": [(3, 27.0, 8.0, 3000.0)], "surface_bumps": [(4, 12.0, 1.6, 0.002)]}
RUN = {"speed_kmh": 250.0, "distance": 300.0, "spans": 8, "accuracy": "fast"}


def with_points(*points, like=NAME):
    return line({"points": list(points)}, like=like)


def test_points_are_hard_spots_and_bumps_that_belong_to_the_line():
    one = simulate(catenary=with_points(SPOT, STEP), **RUN)
    other = simulate(catenary=NAME, line_condition=AS_DEFECTS, **RUN)
    np.testing.assert_array_equal(one.contact_force, other.contact_force)
    np.testing.assert_array_equal(one.uplift, other.uplift)
    intact = simulate(catenary=NAME, **RUN)
    assert (
        np.abs(np.interp(intact.position, one.position, one.contact_force) - intact.contact_force).max() > 30
    )
    assert one.identity.line_condition == LineCondition()  # of the run: it has no defects
    shown = {each.key: each.value for each in values_of(one.designed.line)}
    assert shown["points.1"].startswith("name section insulator, span 3, offset 27.0, mass 8.0")


def test_a_condition_s_own_defects_act_beside_them_even_at_the_same_place():
    half = SPOT | {"mass": 4.0, "stiffness": 1500.0}
    spot = {"hard_spots": [(3, 27.0, 4.0, 1500.0)]}
    both = simulate(catenary=with_points(half), line_condition=spot, **RUN)
    twice = simulate(catenary=with_points(half, half), **RUN)
    whole = simulate(catenary=with_points(SPOT), **RUN)
    for run in (both, twice):
        np.testing.assert_allclose(run.contact_force, whole.contact_force, atol=0.02)


def test_a_point_without_size_changes_nothing_nor_does_one_that_no_run_reaches():
    intact = simulate(catenary=NAME, **RUN)
    nothing = with_points({"name": "marker", "span": 3, "offset": 27.0})
    np.testing.assert_array_equal(simulate(catenary=nothing, **RUN).contact_force, intact.contact_force)
    far = with_points(SPOT | {"span": 10})
    whole = RUN | {"window": 0}
    beyond, there = (simulate(catenary=each, **whole) for each in (far, NAME))
    np.testing.assert_array_equal(beyond.contact_force, there.contact_force)


def test_points_of_an_overlap_are_on_the_wire_in_use():
    spans, overlap = ["usual"] * 11, [{"first_span": 5, "rises": [0.1, 0.5]}]
    table = {"sequence": spans, "span_types": {"usual": {}}, "overlaps": overlap}
    run = {"pantograph": "dsa250", "speed_kmh": 160.0, "distance": 600.0, "accuracy": "fast"}
    near = {"span": 9, "offset": 30.0, "mass": 6.0, "step": -0.001}
    one = simulate(catenary=line(table | {"points": [near]}, like="re250"), **run)
    defects = {"hard_spots": [(9, 30.0, 6.0, 0.0)], "surface_bumps": [(9, 30.0, 1.0, -0.001)]}
    other = simulate(catenary=line(table, like="re250"), line_condition=defects, **run)
    np.testing.assert_array_equal(one.contact_force, other.contact_force)


@pytest.mark.longer
def test_mass_and_spring_of_a_point_take_part_in_the_line_s_energy(monkeypatch):
    """Kept over 10 s of free motion with what is theirs, by velocity and height of the node they hang on."""
    data = undamped(with_points(SPOT))
    runs = points.with_points(data, Runs(), 10)
    own = locate(data.layout(10), runs.conditions[0])

    def with_own(line, spans, numerics):
        return constants(line, solve(line), spans, numerics, resolution(line, numerics, Runs()), own)

    def with_point(line, wire, data, step):
        old, move = (along(each[0])[CONTACT] for each in (wire.displacement, wire.increment))
        node = PAD + round((2 * 60.0 + 27.0) / line.spacing)
        moving = 8.0 * (move[node] / step) ** 2 + 3000.0 * (old[node] + move[node] / 2) ** 2
        return energy(line, wire, data, step) + moving / 2

    monkeypatch.setattr(test_flexible, "constants_of", with_own)
    kept, missing = (swing(data, 10, 150.0, 1e-3, False, each)[0] for each in (with_point, energy))
    assert kept < 1e-6
    assert missing > 1e-2


@pytest.mark.parametrize(
    ("message", "point"),
    [
        ("point 1 is in span 11, and the line has 10", {"span": 11, "offset": 1.0}),
        ("points.1.mass", {"span": 1, "offset": 1.0, "mass": 500.0}),
        ("no place 61 m from the first support", {"span": 2, "offset": 61.0, "mass": 1.0}),
        ("must lie between the line's anchors", {"span": 1, "offset": 0.0, "mass": 1.0}),
        ("A bump reaches from -1.5 to 2.5 m", {"span": 1, "offset": 0.5, "step": 0.001, "length": 4.0}),
    ],
)
def test_a_point_off_the_line_is_refused(message, point):
    with pytest.raises(InputError, match=message):
        simulate(catenary=with_points(point))


def test_damping_by_its_ratio():
    """The ratio of alpha / (2 omega) + beta omega / 2 is the given one at both frequencies, less between."""
    damping = line({"damping": {"ratio": 0.01, "frequencies": [1.0, 20.0]}}, like="re250").damping
    omega = 2 * np.pi * np.array([1.0, 20.0, np.sqrt(20.0)])
    ratio = damping.alpha / (2 * omega) + damping.beta * omega / 2
    assert ratio[:2] == pytest.approx([0.01, 0.01], rel=1e-12)
    assert ratio[2] == pytest.approx(0.01 * 2 * np.sqrt(20.0) / 21.0)  # the least, at the geometric mean
    one = Rayleigh.model_validate({"ratio": 0.02, "frequencies": (5.0, 5.0)})
    assert (one.alpha, one.beta) == pytest.approx((0.02 * 2 * np.pi * 5.0, 0.02 / (2 * np.pi * 5.0)))
    assert load_catenary("re250").damping != damping


@pytest.mark.parametrize(
    ("message", "given"),
    [
        ("either alpha and beta, or ratio", {"ratio": 0.01, "frequencies": [1.0, 20.0], "beta": 1e-4}),
        ("'frequencies' is missing", {"ratio": 0.01}),
        ("must be a number from 0 to 0.5", {"ratio": 5.0, "frequencies": [1.0, 20.0]}),
    ],
)
def test_damping_given_twice_or_by_half_is_refused(message, given):
    with pytest.raises(InputError, match=message):
        line({"damping": given}, like="re250")


def test_the_file_that_the_page_shows_is_a_line():
    page = (ROOT / "docs" / "own-line.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"### Points and tunnels\n\n```toml\n(.*?)```", page, re.DOTALL)
    own = line(tomllib.loads(text), like="re250")
    assert [point.name for point in own.points] == ["section insulator", "mid-point anchor"]
    assert own.tunnels[0].factor == 1.4
    assert own.has_points
