"""A line that was found to differ from its design differs in every run on it, under any condition."""

import numpy as np
import pytest

from panto_env import InputError, simulate
from panto_env.analysis.simulation import check_made_anew, load_with_settings
from panto_env.catalog import available, load_catenary
from panto_env.catalog.loader import content_of, text_of
from panto_env.control.lines import on_drawn_line, on_example
from panto_env.control.settings import run_settings
from panto_env.plant.line_condition import LINE_CONDITIONS, NEW, LineCondition, together

LINE = "en50318-2002"
FOUND = LineCondition(
    miscut_droppers=((4, 5, 0.004), (5, 1, -0.003)),
    raised_supports=((4, 0.005),),
    lost_contact_tension=0.02,
    lost_messenger_tension=-0.03,
)
SHORT = {"spans": 8, "distance": 200.0, "accuracy": "fast", "record_droppers": False}


@pytest.fixture
def fitted(tmp_path):
    """A file of a line with what was found."""
    path = tmp_path / "found.toml"
    rows = [f"{key} = {value}" for key, value in FOUND.model_dump(exclude_defaults=True, mode="json").items()]
    path.write_text("\n".join([text_of(LINE), "[as_found]", *rows]) + "\n", encoding="utf-8")
    return path


def test_together():
    for given in LINE_CONDITIONS.values():
        assert together(NEW, given) == given
        assert together(given, NEW) == given
        once = together(FOUND, given)
        assert once.miscut_droppers == FOUND.miscut_droppers
        assert once.irregularity == given.irregularity
        assert together(FOUND, once) == once  # as a saved run's settings are read again
    given = LineCondition(
        miscut_droppers=((6, 2, 0.01), (4, 5, 0.004)), broken_droppers=((3, 3),), lost_contact_tension=0.1
    )
    both = together(FOUND, given)
    assert both.miscut_droppers == (*FOUND.miscut_droppers, (6, 2, 0.01))
    assert both.broken_droppers == ((3, 3),)
    assert (both.lost_contact_tension, both.lost_messenger_tension) == (0.1, -0.03)


def test_a_place_of_two_values_is_refused(fitted):
    with pytest.raises(InputError, match=r"names \(4,\) twice") as caught:
        run_settings({"catenary": str(fitted), "line_condition": {"raised_supports": [(4, 0.001)]}})
    assert str(caught.value).count("\n") == 0


@pytest.mark.filterwarnings("error")
def test_runs_are_in_the_condition_that_was_found(fitted):
    """A condition of the run comes on top."""
    settings = run_settings({"catenary": str(fitted)})
    assert settings.line_condition == (FOUND,)
    again = {"catenary": settings.catenary, "line_condition": settings.line_condition}
    assert run_settings(again) == settings
    found = simulate(str(fitted), **SHORT)
    same = simulate(LINE, line_condition=FOUND, **SHORT)
    np.testing.assert_array_equal(found.contact_force, same.contact_force)
    both = {"catenary": str(fitted), "line_condition": ["smooth", "worn"]}
    smooth, worn = run_settings(both).line_condition
    assert smooth == FOUND.model_copy(update={"irregularity": 1.0})
    assert (worn.irregularity, worn.miscut_droppers) == (10.0, FOUND.miscut_droppers)


def test_a_saved_run_on_it_is_repeated(fitted, tmp_path):
    run = simulate(str(fitted), line_condition="smooth", seed=5, **SHORT)
    run.save(tmp_path / "run.parquet")
    loaded, settings = load_with_settings(tmp_path / "run.parquet")
    assert settings["catenary"].as_found == FOUND
    assert run_settings(settings).line_condition == (FOUND.model_copy(update={"irregularity": 1.0}),)
    fitted.unlink()
    check_made_anew(loaded, settings, tmp_path / "run.parquet")
    anew = simulate(seed=5, record_droppers=False, **settings)
    np.testing.assert_array_equal(anew.contact_force, run.contact_force)
    assert anew.settings == run.settings


def test_it_is_so_too_where_it_is_one_of_several(fitted):
    settings = run_settings({"catenary": [str(fitted), "re250"], "line_condition": "smooth"})
    assert settings.line_condition == (LINE_CONDITIONS["smooth"],)
    assert on_example(settings).line_condition == (together(FOUND, LINE_CONDITIONS["smooth"]),)
    drawn = [on_drawn_line(settings, lambda own=k: np.random.default_rng(own)) for k in range(20)]
    conditions = {own.line.name: own.line_condition for own in drawn}
    assert conditions == {
        "found": (together(FOUND, LINE_CONDITIONS["smooth"]),),
        "re250": (LINE_CONDITIONS["smooth"],),
    }


def test_the_key_changes_no_line_without_it(fitted):
    for name in available("catenary"):
        line = load_catenary(name)
        assert getattr(line, "as_found", None) is None
        assert "as_found" not in line.model_dump(exclude_defaults=True)
    found, design = load_catenary(fitted), load_catenary(LINE)
    assert content_of(found) != content_of(design)
    assert content_of(found.model_copy(update={"as_found": None})) == content_of(design)
    assert hash(found) != hash(design)
