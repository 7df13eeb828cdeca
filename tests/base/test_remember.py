"""Results that are kept, and when they are not."""

import numpy as np

from panto_env.base.checksums import remembered
from panto_env.catalog import load_catenary
from panto_env.plant.catenary.flexible.static import hang

LINE = load_catenary("en50318-2002")


def test_equal_arguments_get_the_same_result_and_others_their_own():
    calls = []

    @remembered
    def doubled(x):
        calls.append(x)
        return np.full(3, 2 * x) if isinstance(x, float) else x

    assert doubled(1.5) is doubled(1.5)
    assert doubled(2.5)[0] == 5.0
    assert doubled([1]) == [1]
    assert doubled([1]) == [1]
    assert calls == [1.5, 2.5, [1], [1]]


def test_a_line_that_differs_in_one_value_has_another_shape():
    twin = LINE.model_copy(update={"sources": {}})
    assert hash(twin) == hash(LINE)
    assert hang(LINE) is hang(load_catenary("en50318-2002"))
    droppers = LINE.droppers.model_copy(update={"contact_clamp_mass": 0.1})
    heavier = LINE.model_copy(update={"droppers": droppers})
    assert (hang(heavier).dropper_tension > hang(LINE).dropper_tension).all()


def test_a_line_with_a_list_in_it_is_computed_anew():
    droppers = LINE.droppers.model_copy(update={"sag": list(LINE.droppers.sag)})
    line = LINE.model_copy(update={"droppers": droppers})
    np.testing.assert_array_equal(hang(line).dropper_tension, hang(LINE).dropper_tension)
