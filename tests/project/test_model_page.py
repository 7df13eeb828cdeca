"""The page of the model says of heights, symbols and elasticity what the code has."""

import re

import numpy as np
import pytest

from panto_env.catalog import available, load_catenary
from panto_env.plant.catenary.flexible import FlexibleCatenaryData
from panto_env.plant.catenary.flexible.as_run import elasticity, non_uniformity
from panto_env.plant.catenary.flexible.static import hang

from ..documents import ROOT

PAGE = (ROOT / "docs" / "model.md").read_text(encoding="utf-8")
LINES = [line for line in map(load_catenary, available("catenary")) if isinstance(line, FlexibleCatenaryData)]


@pytest.mark.parametrize("line", LINES, ids=lambda line: line.name)
def test_height_zero_is_where_sag_counts_from_and_at_a_support_only_where_the_arm_holds_the_wire(line):
    places, sag = np.array(line.droppers.positions), np.array(line.droppers.sag)
    held = line.layout(1).held[: len(places)]
    for wire, (contact, _) in enumerate(hang(line).contacts):
        np.testing.assert_allclose(contact.height(places)[held == wire], -sag[held == wire], atol=1e-9)
        at_support = float(contact.height(np.zeros(1))[0])
        assert (abs(at_support) < 1e-9) == line.steady_arm.holds_wire
    told = re.search(rf"([\d.]+) mm with `{line.name}`", PAGE)
    assert told is None or float(told[1]) == pytest.approx(-1e3 * at_support, abs=0.05)


def test_the_page_says_so():
    opening = PAGE.partition("![")[0]
    assert "holds_wire" in opening
    assert "contact wire's height at a support, at rest" not in opening
    assert re.search(r"[\d.]+ mm with `re250`", opening)


def test_each_of_these_symbols_has_one_meaning():
    sections = PAGE.split("\n## ")
    for symbol in (r"\kappa", r"\lambda", r"\gamma_w", r"\eta", r"\tau", r"\rho", r"\zeta", r"\varepsilon"):
        assert sum(symbol in section for section in sections) == 1, symbol
    assert "b_1 + b_2 s" in PAGE  # and not a, an action, and c, the wave speed


def test_elasticity_and_its_non_uniformity_are_as_defined():
    assert r"\eta(x) = \frac{y_c(x)}{F_0}" in PAGE
    assert r"u_\eta = 100\, \frac{\max \eta - \min \eta}{\max \eta + \min \eta}" in PAGE
    _, lifts = elasticity(load_catenary("re250"), 100.0)
    share = (lifts.max() - lifts.min()) / (lifts.max() + lifts.min())
    assert non_uniformity(lifts) == pytest.approx(100 * share)
