"""Labels of figures: every field has one, in its unit."""

from dataclasses import fields

import pytest

from panto_env.metrics.figures import LABELS, Figures

PER_SI = {"N": 1.0, "N/s": 1.0, "N m": 1.0, "%": 1.0, "m": 1.0, "mm": 1e3}
"""Units in which tables show figures, and what a figure of 1 is in them."""


def test_every_figure_has_a_label_in_its_order():
    assert list(LABELS) == [field.name for field in fields(Figures)]


@pytest.mark.parametrize("name", LABELS)
def test_a_figure_is_scaled_to_the_unit_that_its_label_names(name):
    assert LABELS[name].scale == PER_SI[LABELS[name].unit]
