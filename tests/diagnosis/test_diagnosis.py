"""Diagnosis of the line: statistics against what is known of them, then simulated lines, then the command."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import optimize, stats
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter
from typer.testing import CliRunner

from panto_env import InputError, simulate
from panto_env.cli import make_app
from panto_env.diagnosis import diagnose
from panto_env.diagnosis.diagnosis import judge
from panto_env.diagnosis.features import (
    KINDS,
    LONG,
    OFFSETS,
    RAISED,
    SHORT,
    SUNK,
    TRAINED,
    Classifier,
    Evidence,
    Sort,
    candidates,
    cautious_threshold,
    features,
    regions,
    threshold,
    trained,
)
from panto_env.diagnosis.healthy import FLOOR, Healthy, _whiten
from panto_env.diagnosis.passes import Passes
from panto_env.diagnosis.training import (
    BEYOND,
    BROKEN,
    FIRST,
    NEAR,
    SEVERITIES,
    SPANS,
    TENSION,
    Defect,
    Track,
    draw_defect,
    drive,
    every_defect,
    examples,
    fit,
    save,
)
from panto_env.plant.alignment import Alignment
from panto_env.plant.line_condition import LineCondition
from panto_env.studies.paper2.diagnosis import within_interval
from panto_env.terminal import console

from .conftest import TRACK

SPAN, PER_SPAN, COUNT = 60.0, 120, 40


def made_up(count, random, spans=COUNT):
    """Passes over a line that differ by one pattern and by coloured noise whose size goes with the span."""
    x = np.arange(spans * PER_SPAN) * SPAN / PER_SPAN
    mean, pattern = 100 + 20 * np.cos(2 * np.pi * x / SPAN), 8 * np.sin(2 * np.pi * x / 37)
    size = 2 + np.cos(2 * np.pi * x / SPAN)
    noise = lfilter([1.0], [1.0, -0.8], random.standard_normal((count, len(x)))) * 0.6
    force = mean + random.standard_normal((count, 1)) * pattern + size * noise
    droppers = np.add.outer(np.arange(spans) * SPAN, [5, 17, 30, 43, 55]).ravel()
    return Passes(force, Alignment.equal(SPAN, spans), 0, PER_SPAN, droppers, "made up", 70.0, 120.0)


@pytest.fixture(scope="module")
def learned():
    return Healthy.of(made_up(10, np.random.default_rng(1)))


def test_patterns_of_passes_are_taken_out_and_the_rest_is_as_large_as_it_was_made(learned):
    passes = made_up(30, np.random.default_rng(2))
    levels = [learned.score(passes.only(k), 1.0)[1][0] * np.sqrt((learned.size**2).mean()) for k in range(30)]
    # Noise of rms 0.6 / sqrt(1 - 0.8^2) = 1 times a size of rms sqrt(4.5). The mean of 10 passes is off by a
    # tenth of that variance, and so is what their pattern, known as well as the mean, explains.
    rest = np.concatenate([learned.score(passes.only(k), 1.0)[0].residual for k in range(30)])
    assert rest.std() == pytest.approx(np.sqrt(4.5) * np.sqrt(1 + 2 / 10), rel=0.03)
    assert np.std(passes.force - learned.mean) > 1.5 * rest.std()
    assert np.std(levels) < 0.2 * np.mean(levels)


def test_a_place_is_predicted_by_those_before_it(learned):
    """So that what a defect does begins where it is: one step, then what was predicted of it in vain."""
    unit = np.zeros(60)
    unit[20] = 1.0
    expected = np.concatenate([np.zeros(20), [1.0], -learned.predictor, np.zeros(60)])[:60]
    np.testing.assert_allclose(_whiten(unit, learned.predictor), expected, atol=1e-12)


@pytest.mark.parametrize("rate", [0.1, 1.0])
def test_threshold_has_the_false_alarms_that_it_is_asked_for(rate):
    """Scores whose spans' largest are Gumbel's in the logarithm, on lines that it has not seen."""
    random = np.random.default_rng(0)
    shape = np.exp(-np.linspace(0, 8, PER_SPAN))
    largest = np.exp(random.gumbel(0.5, 0.3, (400, COUNT)))
    seen = (largest[:20, :, None] * shape).reshape(20, -1)
    level = threshold(seen, PER_SPAN, SPAN, rate)
    measured = (largest[20:] > level).sum() / (largest[20:].size * SPAN / 1e3)
    assert 0.5 * rate < measured < 2 * rate


@pytest.mark.parametrize("passes", [3, 20])
def test_the_spread_between_passes_counts_as_in_a_prediction_interval(passes):
    """By parts: from span to span by the normal quantile, between passes by Student's t of one more."""
    random = np.random.default_rng(passes)
    log = random.normal(0, 0.4, (passes, 1)) + random.gumbel(0, 0.3, (passes, 15))
    plain, cautious = (np.log(each(np.exp(log), 1, SPAN)) for each in (threshold, cautious_threshold))
    alarm = 1 - np.exp(-0.1 * SPAN / 1e3)
    own = sum((pass_.mean() - log.mean()) ** 2 for pass_ in log) / (passes - 1)
    share = min(1.0, own / np.mean((log - log.mean()) ** 2))
    enlarged = stats.t.ppf(1 - alarm, passes - 1) ** 2 * (passes + 1) / passes
    usual = stats.norm.ppf(1 - alarm) ** 2
    ratio = (share * enlarged + (1 - share) * usual) / usual
    assert (cautious - log.mean()) ** 2 == pytest.approx(ratio * (plain - log.mean()) ** 2)


def test_the_threshold_is_a_quantile_of_gumbel_s_by_maximum_likelihood():
    log = np.random.default_rng(4).gumbel(0.4, 0.3, 300)

    def unlikely(values):
        z = (log - values[0]) / values[1]
        return np.sum(z + np.exp(-z)) + len(log) * np.log(values[1])

    place, scale = optimize.minimize(unlikely, [0.0, 1.0], method="Nelder-Mead", tol=1e-10).x
    alarms = 0.5 * SPAN / 1e3  # Poisson's mean in a span; of none at all: exp(-alarms)
    expected = place - scale * np.log(alarms)
    assert np.log(threshold(np.exp(log)[None], 1, SPAN, 0.5)) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(("count", "spread"), [(1, 0.25), (4, 0.4)])
def test_the_whole_line_has_changed_where_a_further_pass_would_hardly_be_so_loud(learned, count, spread):
    """12 healthy levels of known spread in the logarithm: Student's t of further passes, at 1 in 1000."""
    passes = made_up(count, np.random.default_rng(6))
    levels = np.log(learned.score(passes, 1.0)[1])
    healthy = spread * np.sqrt(11 / 12) * np.array([-1.0, 1.0] * 6)
    assert np.std(healthy, ddof=1) == pytest.approx(spread)
    limit = stats.t.ppf(0.999, 11) * spread * np.sqrt(1 / count + 1 / 12)
    assert limit > np.log(2)  # below which no line counts as changed
    for above in (0.98 * limit, 1.02 * limit):
        found = judge(passes, replace(learned, levels=np.exp(healthy + levels.mean() - above)))
        assert found.changed == (above > limit)
        assert found.level == pytest.approx(np.exp(above))


@pytest.mark.longer
def test_healthy_passes_held_against_each_other_are_as_loud_as_further_ones():
    """Of noise alone. The mean of three others is off by more than that of all four: by 3 % of the level."""
    random, healthy, later = np.random.default_rng(7), [], []
    for _ in range(12):
        passes = made_up(8, random)
        noise = replace(passes, force=100 + random.standard_normal(passes.force.shape))
        one = Healthy.of(noise.only(0, 1, 2, 3))
        healthy.append(one.levels.mean())
        later += [one.score(noise.only(k), 1.0)[1][0] for k in range(4, 8)]
    assert np.mean(healthy) == pytest.approx(np.mean(later), rel=0.012)


def test_a_bump_is_found_where_it_is_and_a_healthy_pass_has_none(learned):
    passes = made_up(12, np.random.default_rng(4))
    limit = threshold(learned.scores, PER_SPAN, SPAN)
    for k, at in enumerate((25.25, 18.7, 9.4)):
        bumped = passes.force.copy()
        bumped[:, int(at * PER_SPAN) : int(at * PER_SPAN) + 12] += 15.0
        evidence, _ = learned.score(replace(passes, force=bumped).only(k), limit)
        (region,) = regions(evidence)
        assert abs(evidence.position[region.peak] - at * SPAN) < 8
    assert sum(len(regions(learned.score(passes.only(k), limit)[0])) for k in range(12)) <= 2


def evidence_of(score, rest=None):
    x = np.arange(len(score)) * 0.5
    rest = np.sin(x) if rest is None else rest
    droppers = np.add.outer(np.arange(12) * SPAN, [5, 17, 30, 43, 55]).ravel()
    return Evidence(
        x, rest, np.asarray(score, dtype=float), 5.0, Alignment.equal(SPAN, COUNT), droppers, 70.0, 120.0, 2.0
    )


def test_waves_of_a_defect_are_no_defects_of_their_own():
    score = np.zeros(12 * PER_SPAN)
    for span, value in ((3, 100.0), (4, 60.0), (5, 40.0), (6, 15.0), (8, 9.0), (11, 6.0)):
        score[span * PER_SPAN + 4] = value
    # 60 is within 1.3 spans, 40 is less than half within 2.5, 15 less than a fifth within 4; 9 and 6 are far.
    assert [region.peak // PER_SPAN for region in regions(evidence_of(score))] == [3, 8, 11]


def test_candidates_are_droppers_supports_and_the_wire_about_the_greatest_score():
    score = np.zeros(12 * PER_SPAN)
    score[5 * PER_SPAN :][:21] = 10 * np.hanning(21)  # greatest 5 m into span 6
    evidence = evidence_of(score)
    (region,) = regions(evidence)
    found = candidates(evidence, region)
    assert [c.position for c in found if c.sort is Sort.DROPPER] == [283, 295, 305, 317, 330]
    assert [c.position for c in found if c.sort is Sort.SUPPORT] == [300]
    shown = features(evidence, region, found)
    assert np.isfinite(shown).all()
    # What is shown of a candidate lies about it: the score's peak moves with the candidate.
    middle = OFFSETS[shown[:, len(OFFSETS) : 2 * len(OFFSETS)].argmax(axis=1)]
    np.testing.assert_allclose(middle[:4], [305 - c.position for c in found[:4]], atol=0.8)


def test_network_gives_what_scikit_learn_gives(tmp_path):
    from sklearn.neural_network import MLPClassifier

    random = np.random.default_rng(0)
    shown, classes = random.standard_normal((400, 5)), random.integers(0, 8, 400)
    shown[:, 0] += classes
    ours = fit(shown, classes)
    path = tmp_path / "kinds.npz"
    save(ours, path)
    read = Classifier.load(path)
    network = MLPClassifier((ours.inner.shape[1],), max_iter=1).fit(shown, classes)
    network.coefs_, network.intercepts_ = [ours.inner, ours.outer], [ours.inner_bias, ours.outer_bias]
    theirs = network.predict_proba((shown - ours.mean) / ours.scale)
    np.testing.assert_allclose(ours.probabilities(shown), theirs, atol=1e-12)
    np.testing.assert_allclose(read.probabilities(shown), theirs, atol=1e-4)


def test_a_classifier_s_file_cannot_hold_anything_to_run(tmp_path):
    path = tmp_path / "kinds.npz"
    with np.load(TRAINED) as arrays:
        np.savez(path, **dict(arrays) | {"mean": np.array([print], dtype=object)})
    with pytest.raises(ValueError, match="allow_pickle=False"):
        Classifier.load(path)


UNEVEN = Track("en50318-2002", "dsa380", 200.0, 1, 0.0)


@pytest.mark.parametrize(("given", "broken"), [((), 1), ((1,), 1), ((8,), 8)])
def test_there_is_one_of_each_severity_and_as_many_broken_droppers_as_wanted(given, broken):
    defects = every_defect(UNEVEN, np.random.default_rng(0), *given)
    assert sum(defect.kind == BROKEN for defect in defects) == broken
    others = [(defect.kind, defect.severity) for defect in defects if defect.kind != BROKEN]
    assert others == [
        (kind, each) for kind, several in SEVERITIES.items() if kind != BROKEN for each in several
    ]
    assert FIRST < BEYOND < SPANS
    begin, end = (UNEVEN.data.alignment().support(each) for each in (FIRST - 1, BEYOND))
    signs = {LONG: 1, SHORT: -1, RAISED: 1, SUNK: -1}
    for defect in defects:
        LineCondition(**defect.condition)  # can be simulated
        if defect.kind in signs:
            ((*_, amount),) = next(iter(defect.condition.values()))
            assert amount == signs[defect.kind] * defect.severity
        assert np.isnan(defect.position) if defect.kind == TENSION else begin <= defect.position <= end + 10


@pytest.mark.slow
def test_broken_droppers_are_found_and_named_and_a_healthy_line_is_healthy(healthy_runs):
    """At a speed, under a pantograph, and on lines that the classifier has not seen."""
    places = [(13, 3), (16, 5), (19, 7), (22, 4)]
    located = named = changed = 0
    for k, (span, number) in enumerate(places):
        at = (span - 1) * 60 + TRACK.data.droppers.positions[number - 1]
        run = drive(TRACK, 20 + k, (Defect(BROKEN, 1.0, {"broken_droppers": [(span, number)]}, at),))
        found = diagnose([run], healthy_runs)
        assert not found.healthy
        changed += found.changed
        best = max(found.findings, key=lambda each: each.score)
        located += within_interval(best.position, at, found.evidence.droppers)
        named += (best.kind, best.span, best.dropper) == (BROKEN, span, number)
    assert located == 4
    assert named >= 3
    controls = [diagnose([drive(TRACK, 40 + k)], healthy_runs) for k in range(3)]
    assert sum(len(each.findings) for each in controls) <= 1
    # Two of these seven pantographs are unlike all twelve healthy ones: then the whole line seems changed.
    assert changed + sum(each.changed for each in controls) <= 2


@pytest.mark.slow
def test_lost_tension_changes_the_whole_line(healthy_runs):
    defect = draw_defect(TRACK, TENSION, 0.05, 15, np.random.default_rng(0))
    found = diagnose([drive(TRACK, 60, (defect,))], healthy_runs)
    assert found.changed
    assert found.level > 2
    assert found.notes == ()


@pytest.mark.longer
def test_healthy_passes_that_are_few_or_over_other_lines_are_said_to_be(healthy_runs):
    others = [drive(replace(TRACK, seed=1000 + k), 0) for k in range(6)]
    note = diagnose(healthy_runs[:1], others).notes[-1]
    assert "differ by" in note
    assert "if they are over other lines" in note
    rare, often = (diagnose(healthy_runs[:1], healthy_runs[1:4], false_alarms=rate) for rate in (0.01, 5.0))
    assert rare.evidence.threshold > 1.2 * often.evidence.threshold
    assert len(rare.notes) == 2
    assert rare.notes[0].startswith("Only 3 healthy passes")


@pytest.mark.longer
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"catenary": "re330"}, "different lines, 're330' and 'en50318-2002'"),
        ({"speed": 224.0 / 3.6}, "Passes at 224 and 220.* cannot be compared: speeds may differ by 1 %"),
        ({"terminated": True, "ending": "It ended."}, "It ended. A run that ended early cannot be judged"),
        ({"followers": (None,)}, "Healthy run .* is of 2 pantographs, which feel each other's waves"),
        ({"dropper_position": np.zeros(0)}, "No run says where the line's droppers are"),
    ],
)
def test_runs_that_cannot_be_compared_are_refused(healthy_runs, change, message):
    runs = [replace(run, **change) if "dropper_position" in change else run for run in healthy_runs]
    faster = change.get("speed", runs[-1].speed) / runs[-1].speed
    runs[-1] = replace(runs[-1], **{"position": faster * runs[-1].position} | change)
    with pytest.raises(InputError, match=message):
        diagnose(runs[:1], runs[1:])


@pytest.mark.longer
def test_runs_that_say_too_little_are_refused(healthy_runs):
    with pytest.raises(InputError, match="takes at least 3 of them, not 2; give more with --healthy"):
        diagnose(healthy_runs[:1], healthy_runs[1:3])
    with pytest.raises(InputError, match="One run stands there twice"):
        diagnose(healthy_runs[:1], healthy_runs[:4])
    short = simulate(TRACK.catenary, "dsa250", 220.0, distance=600.0, spans=20)
    with pytest.raises(
        InputError, match=r"ends at 600.1 m, but a run's start is felt up to span 9, .* 610 m"
    ):
        diagnose([short], healthy_runs[1:])


@pytest.mark.longer
def test_an_example_is_right_only_where_the_defect_is(monkeypatch):
    """Of a short training: classes are those of the kinds, and candidates right or wrong by their place."""
    monkeypatch.setattr("panto_env.diagnosis.training.BROKEN_EACH", 1)
    monkeypatch.setattr(
        "panto_env.diagnosis.training.SEVERITIES", {BROKEN: (1.0,), "hard spot": (5.0,), "worn wire": (0.3,)}
    )
    shown, classes = examples(TRACK)
    assert set(classes) == {0, 1, KINDS.index("hard spot") + 1, KINDS.index("worn wire") + 1}
    assert (classes == 1).sum() == 1
    assert 1 <= (classes == KINDS.index("hard spot") + 1).sum() <= 2 * NEAR[Sort.WIRE] + 1
    assert shown.shape[1] == len(trained().mean)


@pytest.fixture(scope="module")
def files(healthy_runs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    at = 17 * 60 + TRACK.data.droppers.positions[4]
    judged = drive(TRACK, 77, (Defect(BROKEN, 1.0, {"broken_droppers": [(18, 5)]}, at),))
    names = []
    for k, run in enumerate([judged, *healthy_runs]):
        whole = replace(run, dropper_force=np.zeros((len(run.time), len(run.dropper_position))))
        names.append(str(folder / f"run{k}.parquet"))
        whole.save(names[-1])
    return names


@pytest.mark.slow
def test_command_prints_a_table_and_draws(files, tmp_path, monkeypatch):
    monkeypatch.setattr(console, "_width", 200)  # it has asked for its width when it was made
    picture = tmp_path / "line.png"
    call = ["diagnose", files[0], "--healthy", *files[1:], "--plot", str(picture)]
    told = CliRunner().invoke(make_app(), call)
    assert told.exit_code == 0, told.output
    assert "1 defect from 540 to 1620 m." in told.output
    assert "broken dropper" in told.output
    assert "dropper 5" in told.output
    assert picture.stat().st_size > 20_000


@pytest.mark.longer
def test_command_prints_json(files):
    call = ["diagnose", files[0], "--healthy", files[1], "--healthy", files[2], files[3], "--json"]
    told = CliRunner().invoke(make_app(), call)
    found = json.loads(told.stdout)
    assert found["healthy"] is False
    assert [note[:6] for note in found["notes"]] == ["Only 3", "Only 5"]
    assert all(sum(each["shares"].values()) == pytest.approx(1) for each in found["findings"])


@pytest.mark.longer
@pytest.mark.parametrize(
    ("extra", "message"),
    [
        ([], "Give either the healthy runs"),
        (["--healthy", "none.parquet"], "none.parquet does not exist"),
        (["--healthy", "a.parquet", "--false-alarms", "0"], "must lie between 1e-06 and 20 per km, not 0"),
        (["--healthy", "a.parquet", "--seed", "-1"], "--seed must be a whole number from 0 up, not -1"),
    ],
)
def test_command_refuses(files, extra, message):
    told = CliRunner().invoke(make_app(), ["diagnose", files[0], *extra])
    assert isinstance(told.exception, InputError)
    assert message in str(told.exception)


def test_whitened_remainders_are_white_and_their_energy_is_one(learned):
    passes = made_up(20, np.random.default_rng(3))
    scores = np.array([learned.score(passes.only(k), 1.0)[0].score[PER_SPAN:] for k in range(20)])
    assert scores.mean() == pytest.approx(1.0, rel=0.1)
    # Of noise whose correlation falls by 0.8 from place to place, with the white noise that it reckons with.
    lags = 0.8 ** np.arange(len(learned.predictor) + 1) + FLOOR * (np.arange(len(learned.predictor) + 1) == 0)
    np.testing.assert_allclose(learned.predictor, solve_toeplitz(lags[:-1], lags[1:]), atol=0.05)
    # Of each span at its place: nowhere louder than elsewhere.
    by_place = scores.reshape(-1, PER_SPAN).mean(axis=0)
    assert by_place.max() / by_place.min() < 1.4
