"""Trains on lines whose spans differ, beside the line with one span repeated, and as a model by itself.

A line of equal spans that are written out is that line itself. One whose last support is a thousandth of a
millimetre higher is not: everything that hangs on it has nodes of its own, and the figures are the same.
"""

import pickle

import gymnasium
import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.plant.catenary.flexible import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.arrays import CONTACT, LINK, MESSENGER, PAD
from panto_env.plant.catenary.flexible.wires import along
from panto_env.plant.numerics import Numerics, Runs
from panto_env.plant.plant import Plant
from panto_env.plant.train import Train

from .. import line_energy
from ..finite_element import __main__ as comparison
from ..finite_element.figures import figures
from ..finite_element.sections import Section, sections
from ..finite_element.sections import line_of as changed
from ..lanes import check_lanes_are_singles
from ..marks import some_in_proofs
from .test_flexible import PULSES, swing, undamped

NAME, SPANS = "en50318-2002", 30
UNIFORM = load_catenary(NAME).model_copy(update={"spans": SPANS})
MIXED = (50, 60, 55, 65, 45, 62, 50, 65, 60, 40, 60, 55, 64, 65, 50, 60)


def line_of(lengths, base=UNIFORM, **more):
    """The line with spans of these lengths (m), its droppers at the same distances."""
    table = base.model_dump(exclude={"sources", "spans"}, exclude_none=True)
    return FlexibleCatenaryData.model_validate(
        table | {"sequence": [{"span_length": length} for length in lengths]} | more
    )


def nearly(base=UNIFORM):
    return line_of([base.span_length] * SPANS, base, end_support={"encumbrance": base.encumbrance + 1e-6})


def both(line=UNIFORM, pantograph=NAME, **settings):
    """The same run on a line and on the same one with spans that differ by nothing that matters."""
    settings = {"speed_kmh": 250, "precision": "double"} | settings
    return [simulate(catenary=each, pantograph=pantograph, **settings) for each in (line, nearly(line))]


def rms(difference):
    return np.sqrt((difference**2).mean())


def alike(runs, force=2e-3):
    """Behind the train, a dropper that just goes slack in one run may not do so in the other."""
    one, other = runs
    np.testing.assert_allclose(other.contact_force, one.contact_force, atol=force)
    assert rms(other.uplift - one.uplift) < 5e-3 * rms(one.uplift)
    assert rms(other.dropper_force - one.dropper_force) < 5e-3 * rms(one.dropper_force)
    assert one.contact_force.std() > 10


HOLDING = load_catenary("benchmark-2015").model_copy(update={"spans": SPANS})
"""Its arms hold the wire."""


@pytest.fixture(scope="module")
def new():
    """While the window travels, and on the whole line."""
    runs = [both(HOLDING, "dsa380", distance=10 * 55.0, window=window) for window in (16, 0)]
    for each in runs:
        alike(each, 0.02)
    return runs[0][0]


@pytest.mark.longer
@pytest.mark.parametrize(
    "condition",
    [
        "as-built",
        {
            "broken_droppers": [(6, 3), (7, 1)],
            "miscut_droppers": [(8, 5, 0.02)],
            "raised_supports": [(7, 0.03)],
        },
        {"hard_spots": [(7, 20.3, 4.0, 200.0)], "worn_stretches": [(8, 10.0, 90.0, 0.2)]},
        {"lost_contact_tension": 0.05, "lost_messenger_tension": 0.1},
    ],
    ids=lambda condition: condition if isinstance(condition, str) else next(iter(condition)),
)
def test_nearly_equal_spans_move_as_equal_ones_with_the_same_defects(new, condition):
    runs = both(HOLDING, "dsa380", line_condition=condition, seed=3, distance=10 * 55.0)
    alike(runs, 0.02)
    there = np.interp(new.position, runs[0].position, runs[0].contact_force)
    assert np.abs(new.contact_force - there).max() > 5


def test_shape_seen_is_the_same_where_spans_nearly_are():
    views = []
    for line in (UNIFORM, nearly()):
        plant = plant_of(line)
        plant.advance_passively(6000, plant.samples(1))
        views.append(plant.model.view(0, 300.0, 700.0))
    one, other = views
    for name in ("contact", "messenger"):
        there = np.interp(one.x, other.x, getattr(other, name))
        np.testing.assert_allclose(there, getattr(one, name), atol=2e-6)
    np.testing.assert_allclose(other.supports, one.supports)
    np.testing.assert_allclose(other.droppers, one.droppers)
    np.testing.assert_array_equal(other.slack, one.slack)


def plant_of(line, lanes=1, kmh=(250.0,), **numerics):
    speeds = np.array(kmh) / 3.6
    given = {"numerics": Numerics(**numerics), "runs": Runs((speeds.min(), speeds.max()))}
    plant = Plant(line, Train.of(load_pantograph(NAME)), lanes=lanes, **given)
    plant.start(np.arange(lanes), speeds)
    return plant


@pytest.mark.parametrize("line", [UNIFORM, line_of(MIXED)], ids=["uniform", "mixed"])
def test_lanes_of_a_batch_equal_single_runs_bit_for_bit(line):
    """Each with a window that travels at its own time; a pickled copy goes on as the original would."""
    speeds = (150.0, 200.0, 250.0)
    together = plant_of(line, 3, speeds, window=8)
    samples = together.samples(5001, tension=True)
    together.clear(samples, np.arange(3))
    together.advance_passively(5000, samples)
    for lane, speed in enumerate(speeds):
        alone = Plant(line, Train.of(load_pantograph(NAME)), numerics=Numerics(window=8), runs=together.runs)
        alone.start(0, speed / 3.6)
        own = alone.samples(5001, tension=True)
        alone.clear(own, np.arange(1))
        alone.advance_passively(2500, own)
        alone = pickle.loads(pickle.dumps(alone))
        alone.advance_passively(2500, own)
        assert alone.model.wire.travelled[0] > 0
        for name in ("rows", "uplift", "tension"):
            np.testing.assert_array_equal(getattr(own, name)[0], getattr(samples, name)[lane])


@pytest.mark.parametrize("line", [UNIFORM, line_of(MIXED)], ids=["uniform", "mixed"])
def test_restarted_lane_forgets_the_run_before(line):
    plant, runs = plant_of(line, window=5), []
    for _ in range(2):
        samples = plant.samples(4001)
        plant.start(0, 250 / 3.6)
        plant.advance(np.full((1, 1, 2), 30.0), 4000, samples)
        runs.append(samples)
    assert plant.model.wire.travelled[0] > 0
    np.testing.assert_array_equal(runs[0].rows, runs[1].rows)
    np.testing.assert_array_equal(runs[0].uplift, runs[1].uplift)


def energy(line, wire, data, step):
    """Energy (J) of the discrete line at mid-step, of all pairs of wires; each node has a mass of its own."""
    old, move = along(wire.displacement[0]), along(wire.increment[0])
    now, middle, total = old + move, old + move / 2, 0.0
    for w in range(len(old)):
        mobility = line.scattered.mobility[w, : now.shape[1]]
        mass = step**2 / np.where(mobility > 0, mobility, np.inf)
        bare = data.wires[w % 2].mass * line.spacing
        total += line_energy.of_wire(old[w], now[w], line.stencil[0, w], mass, bare, step)

    def at(things, above, u=middle):
        four = u[things.wire[:, None] + above, PAD + things.first + np.arange(4)]
        return (things.constants[:, :4] * four).sum(axis=1)

    masts, links = line.scattered.masts, line.scattered.links
    total += (data.support.stiffness * at(masts, MESSENGER) ** 2).sum() / 2
    extensions = [at(links, MESSENGER, u) - at(links, CONTACT, u) for u in (old, now)]
    stiffness = links.constants[:, LINK.PULL : LINK.PULL + 3].sum(axis=1)
    return total + line_energy.of_droppers(*extensions, stiffness, line.link_static[0, links.number])


@pytest.mark.longer
@PULSES
def test_undamped_line_keeps_its_energy_for_10_s(height, goes_slack, bar):
    """Supports and droppers lie between nodes, and clamps make some nodes heavier."""
    line = undamped(UNIFORM)
    heavy = line.droppers.model_copy(update={"contact_clamp_mass": 0.3, "messenger_clamp_mass": 0.2})
    data = line_of(MIXED[:10], line.model_copy(update={"droppers": heavy}))
    assert swing(data, 10, 300.0, height, goes_slack, energy)[0] < bar


def test_a_sequence_has_its_own_number_of_spans_and_an_end():
    line = line_of(MIXED)
    with pytest.raises(InputError, match="is a sequence of 16 spans, so it has no other number of them"):
        simulate(catenary=line, pantograph=NAME, speed_kmh=250, spans=20)
    with pytest.raises(InputError, match=r"distance must be at most 906 m on line 'en50318-2002'"):
        simulate(catenary=line, pantograph=NAME, speed_kmh=250, distance=907)
    with pytest.raises(InputError, match=r"at most 512 m on .*, behind 7 spans before the run, not 513 m"):
        gymnasium.make("Pantograph-v0", catenary=line, distance=513.0)
    gymnasium.make("Pantograph-v0", catenary=line, distance=512.0).close()
    assert simulate(catenary=line, pantograph=NAME, speed_kmh=250).distance == pytest.approx(846, abs=1)


def test_a_policy_sees_its_own_span_and_its_length():
    env = gymnasium.make(
        "Pantograph-v0", catenary=line_of(MIXED), line_values=True, observation="measured", speed_kmh=250
    ).unwrapped
    env.reset(seed=1)
    names = [entry.name for entry in env.task.layout.entries]
    sine, cosine, length = map(
        names.index, ("sine of span position", "cosine of span position", "span length")
    )
    supports = np.append(0, np.cumsum(MIXED))
    for _ in range(400):
        observation, *_, info = env.step(np.zeros(1))
        x = info["position"]
        k = np.searchsorted(supports, x, side="right") - 1
        turns = 2 * np.pi * (x - supports[k]) / MIXED[k]
        # The odometer is wrong by up to half a metre.
        assert observation[[sine, cosine]] == pytest.approx((np.sin(turns), np.cos(turns)), abs=0.08)
        inside = min(x - supports[k], supports[k + 1] - x) > 0.5
        assert not inside or 50 * observation[length] == pytest.approx(MIXED[k])


APPLIED = load_pantograph("dsa380").model_copy(update={"force": "applied"})
"""With its static force as it is: no mean is aimed at."""


def climbing(slope):
    """A line whose contact wire rises by so much per metre from the tenth support on."""
    heights = np.interp(np.arange(26) * 55.0, [550.0, 1375.0], [0.0, slope * 825.0]).tolist()
    spans, end = [{"contact_height": height} for height in heights[:-1]], {"contact_height": heights[-1]}
    return changed("benchmark-2015", {"sequence": spans, "end_support": end})


@pytest.mark.longer
def test_a_climb_costs_the_damping_to_ground_times_its_speed():
    """2 per mille at 250 km/h: 0.14 m/s times 70 N s/m."""
    level, climb = (simulate(climbing(slope), APPLIED, 250).summary((16, 23)) for slope in (1e-9, 2e-3))
    expected = -APPLIED.dampings[-1] * 250 / 3.6 * 2e-3
    assert expected < -9
    assert climb.mean - level.mean == pytest.approx(expected, abs=0.3)


def test_a_high_wire_is_no_end_of_a_run():
    heights = [0.0] * 8 + [0.1, 0.2, 0.3, 0.4] + [0.5] * 8
    line = changed("benchmark-2015", {"sequence": [{"contact_height": height} for height in heights]})
    run = simulate(line, APPLIED, 160)
    assert not run.terminated
    assert run.head[-1] > 0.45


def test_lanes_of_a_vector_environment_equal_single_ones():
    settings = {"catenary": line_of(MIXED), "line_condition": "as-built", "speed_kmh": (200, 260)}
    check_lanes_are_singles("Pantograph-v0", settings, steps=100, lanes=2)


SECTIONS = sections()
IN_PROOFS = ("both", "stitched-330", "overlap-2002")
"""One of each kind, and "both" is "mixed" under "bridge". The others are compared in `make studies`."""


@pytest.mark.slow
def test_contact_force_and_uplift_on_unlike_spans_are_those_of_finite_elements():
    agrees(SECTIONS["mixed"], element=1.0)


@pytest.mark.parametrize("name", some_in_proofs(SECTIONS, IN_PROOFS))
def test_every_section_agrees_with_fine_finite_elements(name):
    agrees(SECTIONS[name], element=0.25)


@pytest.mark.slow
def test_both_codes_are_printed_and_drawn_section_by_section(monkeypatch, tmp_path, capsys):
    line = load_catenary("en50318-2002").model_copy(update={"spans": 5})
    short = Section(line, load_pantograph("en50318-2002"), 250.0, spans=(2, 3))
    monkeypatch.setattr(comparison, "sections", lambda: {"short": short})
    monkeypatch.setenv("COLUMNS", "150")
    comparison.compare_sections("short", tmp_path / "pictures")
    rows = [line.split("│") for line in capsys.readouterr().out.splitlines() if "short" in line]
    ours, theirs = ([float(each) for each in row[3:7] + row[7].split()] for row in rows)
    assert ours == pytest.approx(theirs, abs=1.5)
    assert len(ours) == 4 + 3
    assert (tmp_path / "pictures" / "short.png").read_bytes().startswith(b"\x89PNG")
    agrees(short, element=0.5)


def agrees(section, element):
    """Sigma within 2 %; mean, maximum, minimum within 2 % of the mean; uplift at each support within 1 mm."""
    ours = figures(section.by_simulator(), section.spans)
    theirs = figures(section.by_finite_elements(element), section.spans)
    near = 0.02 * theirs.mean
    assert ours.std == pytest.approx(theirs.std, rel=0.02)
    assert ours.mean == pytest.approx(theirs.mean, abs=near)
    assert ours.maximum == pytest.approx(theirs.maximum, abs=near)
    assert ours.minimum == pytest.approx(theirs.minimum, abs=near)
    assert len(ours.uplifts_mm) == section.spans[1] - section.spans[0] + 2
    assert ours.uplifts_mm == pytest.approx(theirs.uplifts_mm, abs=1.0)
