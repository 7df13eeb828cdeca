"""Small parts of the benchmark, the oracle and reports, each value worked out by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from panto_baselines.benchmark import returns as returns_of
from panto_baselines.benchmark.command import _report
from panto_baselines.benchmark.settings import BLIND, TAPE, control_of, policy_of
from panto_baselines.benchmark.submission import Card, _difference, read_submission
from panto_baselines.oracle.search import MEAN_TOLERANCE, MEAN_WEIGHT, _mean_met, merit
from panto_baselines.policies.fb_ff import FeedbackFeedforward
from panto_baselines.report.charts import Scale
from panto_env import InputError


@pytest.mark.parametrize("given", ["pd", "", "xblind:", 3, None, ("pd",), object()])
def test_a_policy_is_no_control(given):
    assert control_of(given) == ""
    assert policy_of(given) is given


@pytest.mark.parametrize("kind", [BLIND, TAPE])
def test_a_control_names_the_policy_behind_it(kind):
    assert control_of(f"{kind}pd:gain=1") == kind
    assert policy_of(f"{kind}pd:gain=1") == "pd:gain=1"


@pytest.mark.parametrize(
    ("stored", "again", "difference"),
    [
        ({"a": 2.0, "b": "x", "c": None}, {"a": 2.0, "b": "x", "c": None}, 0.0),
        ({"a": 4.0, "b": -1.0}, {"a": 3.0, "b": -1.5}, 1 / 3),
        ({"a": 3.0}, {"a": 4.0}, 0.25),
        ({"a": -1.0}, {"a": 1.0}, 2.0),
        ({"a": 1.0}, {"a": None}, np.inf),
        ({"a": None}, {"a": 1.0}, np.inf),
        ({"a": 1.0}, {"a": 2}, np.inf),
        ({"a": 1, "b": 1.0}, {"a": 2, "b": 1.0}, np.inf),
        ({"a": "x"}, {"a": "y"}, np.inf),
        ({"a": 1.0}, {"b": 1.0}, np.inf),
        ({"a": 1.0}, {"a": 1.0, "b": 1.0}, np.inf),
    ],
)
def test_rows_differ_by_their_largest_relative_difference(stored, again, difference):
    assert _difference(stored, again) == pytest.approx(difference)


def test_a_scale_goes_from_its_lowest_to_its_highest_value():
    up, down = Scale(100.0, 300.0, 40.0, 640.0), Scale(0.0, 50.0, 300.0, 20.0)
    assert [up(value) for value in (100.0, 150.0, 300.0, 350.0)] == [40.0, 190.0, 640.0, 790.0]
    assert [down(value) for value in (0.0, 12.5, 50.0)] == [300.0, 230.0, 20.0]
    assert up(100.1) == 40.3


def test_the_merit_is_sigma_and_what_the_mean_is_off_by():
    problem = SimpleNamespace(figures=SimpleNamespace(mean=100.0))
    assert merit(problem, np.array([95.0, 109.0])) == pytest.approx(7.0 + MEAN_WEIGHT * 2.0)
    assert merit(problem, np.array([91.0, 105.0])) == pytest.approx(7.0 + MEAN_WEIGHT * 2.0)
    for off, met in ((0.0, True), (0.99, True), (-0.99, True), (1.01, False), (-1.01, False)):
        force = np.full(3, 100.0 + off * MEAN_TOLERANCE * 100.0)
        assert _mean_met(problem, force) == met


CHECKED = SimpleNamespace(
    card=SimpleNamespace(
        name="Mine", authors=("A", "B"), licence="MIT", learnt_from="re250", policy="policy.safetensors"
    ),
    standing=SimpleNamespace(
        interval=(-21.26, -18.0),
        change=-20.04,
        worst=3.21,
        worst_at="re250 at 200 km/h",
        improved=0.876,
        disqualified="",
    ),
    tape=SimpleNamespace(change=-1.26),
    requirements=(),
)


def test_a_submission_s_report_line_by_line():
    lines = _report(CHECKED, [-30.0, -10.0])
    assert lines == [
        "Mine by A, B (MIT)",
        "Learnt from: re250",
        "Change of sigma: -20.0 %, 95 % interval -21.3 to -18.0; its tape: -1.3 %",
        "Worst: +3.2 %, re250 at 200 km/h; ahead of passive in 88% of passes",
        "It would be ranked, at place 2 of 3.",
    ]
    assert _report(CHECKED, [])[-1] == "It would be ranked."
    standing = SimpleNamespace(
        **vars(CHECKED.standing) | {"interval": None, "disqualified": "it moves the mean"}
    )
    lines = _report(
        SimpleNamespace(**vars(CHECKED) | {"standing": standing, "requirements": ("one==1", "two==2")}),
        [-30.0],
    )
    assert lines[2] == "Change of sigma: -20.0 %; its tape: -1.3 %"
    assert lines[-2:] == ["It requires: one==1, two==2", "It would not be ranked: it moves the mean."]


@pytest.mark.parametrize(
    "given", ["mine.safetensors", "mine.safetensors:gain=1", "mine.safetensors:a=1,b=c:d"]
)
def test_a_submission_s_policy_is_its_file_with_its_parameters(tmp_path, given, monkeypatch):
    given_with = {"authors": ("A",), "description": "d", "licence": "MIT", "learnt_from": "nothing"}
    card = Card(name="Mine", policy=given, **given_with)
    monkeypatch.setattr("panto_baselines.benchmark.submission.read_toml", lambda path: {})
    monkeypatch.setattr("panto_baselines.benchmark.submission.parse", lambda *_: card)
    with pytest.raises(InputError, match=r"but there is no file .*mine\.safetensors\.$"):
        read_submission(tmp_path)
    (tmp_path / "mine.safetensors").touch()
    assert read_submission(tmp_path) == (card, str(tmp_path / given), ())


@pytest.mark.parametrize(("length", "read"), [(1.0, True), (0.72, True), (0.70, False), (0.0, False)])
def test_the_place_within_the_span_is_an_angle_unless_nothing_measures_it(monkeypatch, length, read):
    """Sine and cosine of a place that is measured have a sum of squares of about 1, else of about 0."""
    policy, seen = FeedbackFeedforward(), {}
    policy.context = SimpleNamespace(alignment=SimpleNamespace(mean_length=60.0))
    policy._share, policy._spans = None, 0
    monkeypatch.setattr(policy, "read", lambda observation, name: seen[name])
    for angle in (0.3, 2.0, 4.0, 6.0):
        seen.update(
            {
                "sine of span position": length * np.sin(angle),
                "cosine of span position": length * np.cos(angle),
            }
        )
        if not read:
            with pytest.raises(InputError, match="place within the span, which these sensors do not measure"):
                policy._distance(None)
        else:
            assert policy._distance(None) == pytest.approx(60.0 * angle / (2 * np.pi))
    if read:
        seen.update(
            {"sine of span position": length * np.sin(0.1), "cosine of span position": length * np.cos(0.1)}
        )
        assert policy._distance(None) == pytest.approx(60.0 * (1 + 0.1 / (2 * np.pi)))  # the next span


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("episodes", "mean", "error"), [(1, 10.0, None), (2, 11.0, 1.0), (4, 13.0, 1.291)])
def test_a_mean_return_has_the_standard_error_of_its_episodes(monkeypatch, episodes, mean, error):
    """Of policies alone, not controls or means of trainings. A single episode has no error."""
    given = []

    def spread(jobs, workers, progress):
        given.extend(job.args for job in jobs)
        return [10.0 + 2 * k for k in range(episodes)] * 2

    standing = {"change": -5.0, "disqualified": "", "trainings": ()}
    names = ("p", f"{TAPE}p", "pd", "mean of two")
    standings = [SimpleNamespace(policy=name, **standing) for name in names]
    standings[-1].trainings = ("a", "b")
    cells = [
        SimpleNamespace(catenary="re250", pantograph="dsa250", speed_kmh=speed) for speed in (250.0, 200.0)
    ]
    line = {"catenary": "re250", "pantograph": "dsa250"}
    settings = {"actuator": "ideal", "sensors": "realistic", "seeds": 3, "lines": [line]}
    monkeypatch.setattr(returns_of, "spread", spread)
    result = SimpleNamespace(standings=standings, cells=cells, settings=settings)
    found = returns_of.returns(result, episodes=episodes, arguments={"settle": 0.0})
    assert [each.policy for each in found] == ["p", "pd"]
    assert {(each.mean, each.change, each.disqualified) for each in found} == {(mean, -5.0, "")}
    if error is None:
        assert all(np.isnan(each.error) for each in found)
    else:
        assert [each.error for each in found] == pytest.approx([error] * 2, abs=1e-3)
    assert [(each[2], each[3]) for each in given] == [
        (name, k) for name in ("p", "pd") for k in range(episodes)
    ]
    assert [each[1]["speed_kmh"] for each in given[:episodes]] == [200.0, 250.0, 200.0, 250.0][:episodes]
    place = {
        "catenary": "re250",
        "pantograph": "dsa250",
        "actuator": "ideal",
        "sensors": "realistic",
        "settle": 0.0,
    }
    assert all(each[1].items() >= place.items() and "seeds" not in each[1] for each in given)
