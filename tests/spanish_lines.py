"""Ten Spanish lines by published parameters, beside the elasticity and uplift that are published of them.

``python -m tests.spanish_lines`` prints the tables of docs/evidence.md (a minute on a slow core). Parameters
and published figures were seen in a transcript of ADIF's rules (NAE 107, 108, 300) and of the order
FOM/1630/2015, not in these themselves. Bending stiffness, supports, damping and, where none were found,
droppers are an own choice.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from panto_env import line as line_of
from panto_env import simulate
from panto_env.analysis.line_check import check, elasticity_table
from panto_env.base.table import Table
from panto_env.catalog import available, load_catenary
from panto_env.plant.catenary.flexible import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.spans import parabola

KGF = 9.80665  # N
ARM = {"length": 1.15, "mass": 0.9, "clamp_mass": 0.46}
NO_ARM = {"mass": 0.0, "stiffness": 0.0}
YOUNG = 120e9  # Pa, of copper
APART = 200.0  # m, between two pantographs


class Published(NamedTuple):
    """A line, and what is published of it."""

    wires: int  # contact wires side by side
    section: float  # of one (mm^2)
    contact: float  # tension of one (kgf)
    messenger: tuple[float, float, float]  # section (mm^2), mass (kg/m), tension (kgf)
    span: float  # m
    encumbrance: float  # m
    pre_sag: float  # share of the span (-)
    droppers: tuple[float, ...]  # places, of two wires the middles of pairs 0.5 m apart (m)
    stitch: tuple[float, float] | None = None  # length (m), tension (N)
    stagger: float = 0.2  # m
    elasticity: tuple[float, float] | None = None  # mid-span and support (mm/N)
    speed: float | None = None  # of the uplift (km/h)
    uplift: float = math.nan  # at the support (mm)


def _pairs(first: float, between: float, count: int) -> tuple[float, ...]:
    """Places of droppers for pairs 0.5 m apart: one for each pair."""
    return tuple(first + 0.25 + k * (between + 0.5) for k in range(count))


CU95, CU147, CU150, CU185, BZ120 = (
    (95, 0.85, 1575), (147.1, 1.344, 1425), (150, 1.344, 1650), (184.5, 1.687, 2475), (117, 1.06, 2142),
)  # fmt: skip
FIRST, SECOND = _pairs(4.75, 5.75, 9), _pairs(5.25, 6.5, 8)
NINE = tuple(np.linspace(4.75, 55.25, 9).tolist())
STITCHED = (2.5, 6.0, *np.linspace(12.0, 52.0, 6).tolist(), 58.0, 61.5)
LINES = {
    "CA-160 A": Published(2, 107, 1050, CU147, 60, 1.4, 0.6e-3, FIRST, None, 0.2, (0.65, 0.32), 160, 67),
    "CA-160 B": Published(2, 120, 1200, CU147, 60, 1.4, 0.6e-3, FIRST, speed=160, uplift=61),
    "CA-200H/3kV": Published(2, 120, 1500, CU150, 60, 1.4, 0.5e-3, FIRST, speed=200, uplift=55),
    "CA-220/3kV": Published(2, 150, 1875, CU185, 60, 1.4, 0.5e-3, SECOND, None, 0.2, (0.37, 0.25), 200, 41),
    "CA-200/25kV": Published(1, 120, 1575, CU95, 60, 1.4, 0.4e-3, NINE, speed=200, uplift=46),
    "CA-220/25kV": Published(1, 150, 1875, CU95, 60, 1.4, 0.4e-3, NINE, speed=220, uplift=43),
    "C-350": Published(
        1, 150, 3150, CU95, 64, 1.4, 0.0, STITCHED, (18, 3500.0), 0.2, (0.45, 0.38), 350, 110
    ),
    "C-350-TR-250": Published(
        1, 150, 2100, CU95, 64, 1.4, 0.0, STITCHED, (18, 3087.0), speed=250, uplift=95.5
    ),
    "C-350-TR-200": Published(1, 150, 1575, CU95, 60, 1.4, 0.4e-3, NINE, speed=200, uplift=43),
    "SICAT H1.0": Published(
        1, 120, 27e3 / KGF, BZ120, 65, 1.6, 0.0, tuple(np.linspace(5.0, 60.0, 7).tolist()), (22, 3500.0), 0.3,
        (0.44, 0.40), 330, 94.9,
    ),
}  # fmt: skip


def made(name: str, arm: bool, both: bool = False) -> FlexibleCatenaryData:
    """The line, with its steady arms as pendulums or with none; both: two contact wires, not one for both."""
    own = LINES[name]
    area, (_, mass, tension) = own.section * 1e-6, own.messenger
    wires = 1 if both else own.wires  # for which the contact wire stands
    places = np.add.outer(own.droppers, [-0.25, 0.25]).ravel() if both else np.array(own.droppers)
    sag = parabola(places, own.pre_sag * own.span).tolist()
    table: dict[str, Any] = {
        "span_length": own.span,
        "encumbrance": own.encumbrance,
        "system": "DC 3 kV" if own.wires == 2 else "AC 25 kV",
        "contact_wires": 1 + both,
        "contact_wire": {
            "mass": wires * own.section * 8.89e-3,
            "tension": wires * own.contact * KGF,
            "bending_stiffness": wires * area**2 * YOUNG / (4 * math.pi),
        },
        "messenger_wire": {
            "mass": mass, "tension": tension * KGF, "bending_stiffness": 41.4 * (mass / 0.6) ** 2
        },
        "droppers": {"positions": places.tolist(), "sag": sag, "stiffness": 100e3},
        "steady_arm": (ARM if arm else NO_ARM) | {"holds_wire": False},
        "support": {"stiffness": 500e3, "damping": 1000.0},
        "spans": 34,
    }  # fmt: skip
    if not both:
        table["plan"] = {"stagger": (own.stagger, -own.stagger)}
    if own.stitch is not None:
        table["stitch_wire"] = {"length": own.stitch[0], "tension": own.stitch[1], "mass": 0.31}
    like = "ca-160" if both else "re250-stitched" if own.stitch else "re250"
    found = line_of(table, like=like, name=name)
    assert isinstance(found, FlexibleCatenaryData)
    return found


def yields(name: str, arm: bool, both: bool = False) -> tuple[float, float]:
    """Elasticity at 100 N in mid-span and at a support (mm/N)."""
    middle, end = check(made(name, arm, both), 100.0).in_span
    return 1e3 * middle, 1e3 * end


def uplift(name: str, arm: bool, pantographs: int, both: bool = False) -> float:
    """Largest uplift at the supports of spans 10 to 19 (mm), the mean force at the limit of EN 50367."""
    speed = LINES[name].speed
    assert speed is not None
    pantograph = "dsa250" if speed <= 250 else "dsa380"
    two = {"pantographs": [pantograph] * 2, "distances": [APART]} if pantographs == 2 else {}
    run = simulate(made(name, arm, both), pantograph, speed, mean_force="en50367", **two)
    return 1e3 * max(own.summary((10, 19)).max_uplift for own in run.train)


def of_the_catalogue() -> Table:
    """Elasticity of the catalogue's flexible lines whose spans are all alike, beside what is published."""
    lines = [load_catenary(name) for name in available("catenary")]
    alike = [each for each in lines if isinstance(each, FlexibleCatenaryData) and not each.sequence]
    found = elasticity_table([check(each, 100.0) for each in alike])
    return replace(found, title="Elasticity of the catalogue's lines at 100 N, published ones in brackets")


def tables() -> list[Table]:
    """All tables of the page."""
    rows, lifted = [], []
    for name, own in LINES.items():
        if own.elasticity is not None:
            plain, armed = yields(name, arm=False), yields(name, arm=True)
            differ = (100 * (each / told - 1) for each, told in zip(armed, own.elasticity, strict=True))
            cells = (
                "{:.2f} / {:.2f}".format(*own.elasticity),
                "{:.3f} / {:.3f}".format(*plain),
                "{:.3f} / {:.3f}".format(*yields(name, arm=False, both=True)) if own.wires == 2 else "–",
                "{:.3f} / {:.3f}".format(*armed),
            )
            rows.append((name, *cells, "{:+.0f} / {:+.0f}".format(*differ)))
        lifts = [uplift(name, arm, count) for arm in (False, True) for count in (1, 2)]
        off = [100 * (each / own.uplift - 1) for each in lifts[2:]]
        cells = (
            "{:.1f} / {:.1f}".format(*lifts[:2]),
            "{:.1f} / {:.1f}".format(*(uplift(name, False, count, both=True) for count in (1, 2)))
            if own.wires == 2
            else "–",
            "{:.1f} / {:.1f}".format(*lifts[2:]),
            "{:+.0f} / {:+.0f}".format(*off),
        )
        lifted.append((name, f"{own.speed:g}", f"{own.uplift:g}", *cells))
    both = ("published", "without arm", "without arm, both wires", "arm as pendulum", "difference (%)")
    return [
        Table("Elasticity at 100 N, mid-span / support (mm/N)", ("line", *both), rows),
        Table(
            "Uplift at a support (mm), one / two pantographs 200 m apart",
            ("line", "km/h", *both),
            lifted,
        ),
        of_the_catalogue(),
    ]  # fmt: skip


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    for table in tables():
        print(f"*{table.title}*\n\n{table.markdown}\n")
