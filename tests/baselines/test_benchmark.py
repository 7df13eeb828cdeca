"""The benchmark: paired passes, statistics, the rule of the mean force, and its command."""

import hashlib
import json
import math
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from panto_baselines.benchmark import command, report
from panto_baselines.benchmark import run as benchmark
from panto_baselines.benchmark.run import read_result
from panto_baselines.benchmark.settings import (
    ORACLE_TAPE,
    OTHER_SEED,
    SALTED,
    SEEDS,
    TEST,
    BenchmarkSettings,
    Windows,
    load_benchmark,
    policy_of,
    salted_seed,
)
from panto_baselines.benchmark.single_pass import run_pass
from panto_baselines.oracle import stored
from panto_baselines.report.page import page
from panto_env import InputError, simulate
from panto_env.base.checksums import read_checked
from panto_env.base.settings import parse
from panto_env.policies import find_policy

from . import commands

CONFIGS = Path(__file__).parents[2] / "configs"
P = "p:gain=0.1"
LINE = {"distance": 310.0, "speeds_kmh": [300], "spans": (3, 5)}


def settings(**given):
    table = {"policies": [P], "lines": [LINE], "seeds": 2} | given
    return parse(BenchmarkSettings, table, "the benchmark")


@pytest.fixture(scope="module")
def outcome():
    return benchmark.run(settings(), workers=1)


def called(*arguments):
    """The command's result, run as a program would run it."""
    short = ("--seeds", 1, "--workers", 1, "--speed", 300, *arguments)
    return commands.called(command.benchmark, *short, columns=120)


@pytest.mark.longer
def test_every_policy_runs_the_same_passes_beside_the_passive_one(outcome):
    rows = [(row.policy, row.seed) for row in outcome.rows]
    assert rows == [("passive", 0), ("passive", 1), (P, 0), (P, 1)]
    assert outcome.windows == (Windows((3, 5)),)
    run = simulate(policy=P, seed=1, distance=310.0, line_condition="smooth", record_droppers=False)
    assert outcome.rows[3].figures == run.summary((3, 5))
    assert outcome.rows[0].action_rate == outcome.rows[0].figures.effort == 0


@pytest.mark.slow
def test_outcome_does_not_depend_on_workers_and_repeats(outcome):
    calls = []
    again = benchmark.run(settings(), workers=2, progress=lambda *call: calls.append(call))
    assert calls == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert again == outcome
    assert json.dumps(again.as_dict()) == json.dumps(outcome.as_dict())


@pytest.mark.longer
def test_seeds_tell_lines_apart_only_where_there_is_chance(outcome):
    assert outcome.rows[0].figures.std != outcome.rows[1].figures.std
    assert outcome.cells[1].interval is not None
    assert outcome.cells[0].interval is None  # passive less itself
    new = benchmark.run(settings(line_condition="new"), workers=1)
    assert new.rows[0].figures == new.rows[1].figures
    assert new.cells[1].interval is None


@pytest.mark.longer
def test_default_spans_leave_out_the_run_in_and_the_end():
    lines = [
        {"speeds_kmh": [300]},
        {"speeds_kmh": [250], "catenary": "periodic-stiffness", "pantograph": "three-mass"},
    ]
    done = benchmark.run(settings(policies=["passive"], lines=lines, seeds=1), workers=1)
    assert done.windows == (Windows((10, 19)),) * 2
    # That line has no supports: the uplift is nan, which JSON does not know.
    assert math.isnan(done.cells[1].figures["max_uplift"])
    assert done.as_dict()["cells"][1]["figures"]["max_uplift"] is None


@pytest.mark.slow
def test_trainings_run_by_themselves_and_are_ranked_as_their_method(tmp_path):
    given = settings(policies=["passive"], trainings={"p's": [P, "p:gain=0.2"]})
    done = benchmark.run(given, workers=1)
    assert [cell.policy for cell in done.cells] == ["passive", P, "p:gain=0.2"]
    ranked = {each.policy: each.rank is not None for each in done.standings}
    assert ranked == {"passive": True, P: False, "p:gain=0.2": False, "p's": True}
    done.save(tmp_path / "out.json")
    assert "a training of p&#39;s" in page([read_result(tmp_path / "out.json")])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"policies": ["pp"]}, "Unknown policy 'pp'"),
        ({"policies": ["p:gain=-1"]}, "'p:gain=-1' cannot be made"),
        ({"policies": ["p", "p"]}, "key 'policies': 'p' is given twice"),
        ({"policies": ["model.safetensors"]}, "model.safetensors does not exist"),
        ({"trainings": {"p's": ["p"]}}, "key 'trainings': \"p's\" must have two trainings or more"),
        ({"trainings": {"x": ["p", "p"]}}, "'p' is given twice"),
        ({"trainings": {"x": [P, "p"]}}, f"'{P}' is given twice"),
        ({"trainings": {P: ["p", "pd"]}}, f"'{P}' is given twice"),
        ({"seeds": 0}, "key 'seeds'"),
        ({"seeds": [1, 1]}, "key 'seeds': 1 is given twice"),
        ({"seeds": [-1]}, "key 'seeds.1'"),
        ({"lines": []}, "key 'lines'"),
        ({"lines": [LINE, LINE]}, "is given twice"),
        ({"lines": [{"speeds_kmh": [300, 300]}]}, "300.0 is given twice"),
        ({"lines": [{"speeds_kmh": [500]}]}, "below the wave speed"),
        ({"lines": [{"catenary": "nowhere"}]}, "Unknown catenary 'nowhere'"),
        ({"lines": [{"distance": 200.0}]}, "no spans 10 to 3 to evaluate"),
        ({"lines": [LINE | {"spans": (3, 6)}]}, "Spans 3 to 6 can't be evaluated"),
        ({"lines": [{"speed": 300}]}, "key 'lines.1.speed'"),
        ({"policies": ["adaptive"], "lines": [LINE | {"pantograph": "dsa250"}]}, "'adaptive' failed"),
        ({"policies": ["tape of tuned-pd"], "lines": [LINE | {"speeds_kmh": [300, 120]}]}, "for 120 km/h"),
        ({"actuator": "strong"}, "key 'actuator': actuator must be 'ideal' or 'realistic'"),
        ({"sensors": {"noise": 1}}, "key 'noise'"),
        ({"control_interval": 0.0}, "must be a number from 0.0001 to 10 s"),
    ],
)
def test_bad_settings_are_refused_before_anything_runs(given, words):
    with pytest.raises(InputError) as caught:
        benchmark.run(settings(**given), workers=1, progress=lambda *_: pytest.fail("it ran"))
    assert words in str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted((CONFIGS / "benchmark").glob("*.toml")), ids=lambda path: path.stem)
def test_tracks_load_with_every_policy_that_they_name(path):
    track = load_benchmark(f"benchmark/{path.stem}")
    assert track.title != BenchmarkSettings().title
    for policy in set(track.policies) - {ORACLE_TAPE}:
        find_policy(policy_of(policy))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("seed = 3", "key 'seed'"),
        ("[[lines]]\nspeeds_kmh = [-3]", "key 'lines.1.speeds_kmh.1'"),
        (None, "does not exist"),
    ],
)
def test_a_bad_file_is_named_with_its_key(tmp_path, text, words):
    path = tmp_path / "mine.toml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_benchmark(path)
    assert str(path) in str(caught.value)
    assert words in str(caught.value)


@pytest.mark.longer
def test_json_holds_everything_and_the_settings_that_make_it_again(outcome, tmp_path):
    outcome.save(tmp_path / "out.json")
    table = read_checked(tmp_path / "out.json")
    assert table == outcome.as_dict()
    assert parse(BenchmarkSettings, table["settings"], "it") == outcome.settings
    assert len(table["rows"]) == 4
    assert table["cells"][1]["rank"] in (1, 2)
    assert [(each["policy"], each["seed"]) for each in table["traces"]] == [("passive", 0), (P, 0)]


@pytest.mark.longer
@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_rows_can_be_written_as_tables(outcome, tmp_path, suffix):
    import pyarrow.csv
    import pyarrow.parquet

    path = tmp_path / f"out{suffix}"
    outcome.save(path)
    read = pyarrow.csv.read_csv if suffix == ".csv" else pyarrow.parquet.read_table
    column = "std (N)" if suffix == ".csv" else "std"
    assert read(path)[column].to_pylist() == pytest.approx([r.figures.std for r in outcome.rows])


def test_a_picture_shows_every_policy_and_says_its_units(outcome):
    figure = report.plot(outcome)
    forces, sigmas, changes = figure.axes
    *named, limit, none = forces.get_legend_handles_labels()[1]
    assert [*named, none] == ["passive", P, "nominal force", "0 N: no contact"]
    assert limit.startswith("EN 50367: at most 350 N")
    assert forces.get_xlim() == (180, 300)  # the last two spans evaluated
    means = [cell.figures["mean"] for cell in outcome.cells if cell.policy == "passive"]
    assert list(sigmas.lines[-1].get_ydata()) == pytest.approx([0.3 * mean for mean in means])
    intervals = [list(line.get_ydata()) for line in changes.lines if len(line.get_xdata()) == 2]
    for cell in outcome.cells:
        if cell.interval is not None:
            assert list(cell.interval) in intervals
    (part,) = figure.subfigs
    assert "spans" in part.get_suptitle()
    assert all(axis.get_legend() is None for axis in figure.axes)  # none lies on data
    assert "(N)" in forces.get_ylabel()
    assert "(km/h)" in sigmas.get_xlabel()


@pytest.mark.slow
def test_command_prints_a_table_and_a_drawn_salt_and_writes_the_page_that_its_json_gives(
    tmp_path,
):
    files = tmp_path / "out.json", tmp_path / "out.html"
    result = called("p:gain=0.5", "--salt", "draw", "--output", str(files[0]), "--html", str(files[1]))
    assert result.exit_code == 0, result.output
    found = re.search(r"salt '(\w{32})', SHA-256 (\w{64})\.", " ".join(result.stdout.split()))
    assert found
    assert hashlib.sha256(found[1].encode()).hexdigest() == found[2]
    assert files[1].read_text(encoding="utf-8") == page([read_result(files[0])])
    for words in ("p:gain=0.5", "passive", "CL", "Δσ", "rank", "--wide"):
        assert words in result.stdout
    wide = called("p:gain=0.5", "--wide").stdout
    for words in ("p:gain=0.5", "passive", "CF", "CL", "F_m", "σ", "uplift", "effort", "spans 10–19"):
        assert words in wide


@pytest.mark.longer
def test_command_prints_nothing_but_json_for_machines(tmp_path):
    files = (tmp_path / "out.csv", tmp_path / "out.png")
    result = called("p", "--json", "--output", str(files[0]), "--plot", str(files[1]))
    assert result.exit_code == 0, result.output
    assert [cell["policy"] for cell in json.loads(result.stdout)["cells"]] == ["passive", "p"]
    assert all(path.stat().st_size > 100 for path in files)
    assert files[1].read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["q"], "Unknown policy 'q'"),
        (["p", "--catenary", "nowhere"], "Unknown catenary"),
        (["p", "--actuator", "strong"], "key 'actuator'"),
        (["p", "--output", "out.txt"], "out.txt must end in one of .json, .json.gz, .csv, .xlsx, .parquet"),
        (["p", "--html", "out.txt"], "out.txt must end in .html"),
        (["p", "--plot", "out.txt"], "out.txt must end in one of .png, .svg, .pdf"),
    ],
)
def test_command_raises_one_sentence_and_overwrites_nothing(tmp_path, arguments, words):
    kept = tmp_path / "out.json"
    kept.write_text("kept")
    result = called("--output", str(kept), "--force", *arguments)
    assert isinstance(result.exception, InputError)
    assert words in str(result.exception)
    assert "\n" not in str(result.exception)
    assert kept.read_text() == "kept"


@pytest.mark.longer
def test_the_command_is_looked_up_fast():
    code = (
        "import sys, panto_baselines.benchmark.command; "
        "print({'torch', 'matplotlib', 'pyarrow', 'scipy.stats'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


@pytest.mark.longer
def test_a_line_can_have_policies_of_its_own():
    lines = [LINE, {**LINE, "catenary": "ln2", "speeds_kmh": [200], "policies": ["p"]}]
    done = benchmark.run(settings(policies=["passive"], lines=lines, seeds=1), workers=1)
    assert [(row.catenary, row.policy) for row in done.rows] == [
        ("en50318-2002", "passive"),
        ("ln2", "passive"),
        ("ln2", "p"),
    ]


@pytest.mark.slow
def test_pd_and_fb_ff_are_ranked_with_a_washout():
    """As built, at 300 km/h, as `docs/benchmark.md` has them: in the papers' form they move the mean."""
    laws = ("pd", "fb+ff")
    given = load_benchmark("benchmark/as-built").model_dump() | {"seeds": 1, "lines": [{"speeds_kmh": [300]}]}
    given["policies"] = [f"{law}{form}" for law in laws for form in ("", ":washout=1")]
    done = benchmark.run(parse(BenchmarkSettings, given, "it"), workers=1)
    found = {each.policy: each for each in done.standings}
    for law in laws:
        assert "washout = 1.0 keeps the mean" in found[law].disqualified
        assert found[f"{law}:washout=1"].disqualified == ""
        assert found[f"{law}:washout=1"].change < -5


def test_seeds_have_one_purpose_and_those_of_a_salt_are_what_their_definition_says():
    tapes = range(TEST.start + OTHER_SEED, TEST.stop + OTHER_SEED)
    ordered = sorted((*SEEDS.values(), SALTED, tapes), key=lambda seeds: seeds.start)
    assert all(one.stop <= other.start for one, other in pairwise(ordered))
    salted = settings(seeds=3, salt="salt")
    assert (settings().drawn_seeds, salted.seeds) == ((0, 1), (0, 1, 2))
    assert salted.drawn_seeds == tuple(salted_seed("salt", number) for number in range(3))
    first = int(hashlib.sha256(b"salt:0").hexdigest()[:16], 16)
    assert salted.drawn_seeds[0] == 2**52 + first % 2**52
    with pytest.raises(InputError, match="key 'salt'"):
        settings(salt="")


@pytest.mark.longer
def test_the_tape_of_the_oracle_does_on_its_own_line_what_the_oracle_did():
    track = load_benchmark("benchmark/known-line")
    rows = [
        run_pass(track, track.lines[0], Windows((10, 19)), ORACLE_TAPE, 300.0, seed).row for seed in (0, 1)
    ]
    cells = [each for each in stored.stored_cells() if each["speed_kmh"] == 300.0]
    best = next(each["passes"][0] for each in cells if each["actuator"]["place"] == "frame")
    assert best["seed"] == 0
    assert rows[0].figures.std == pytest.approx(best["oracle"]["std"], rel=1e-6)
    assert rows[1].figures.std > 1.01 * rows[0].figures.std
    with pytest.raises(InputError, match="No oracle is stored for 'en50318-2002' at 351 km/h"):
        benchmark.run(settings(policies=[ORACLE_TAPE], lines=[LINE | {"speeds_kmh": [351]}]), workers=1)


@pytest.mark.longer
@pytest.mark.parametrize(
    ("source", "speeds_kmh", "spans"),
    [
        ("family:high-speed", (300.0,), (10, 19)),
        # The shortest has 36 spans, and its end is felt in 8 of them.
        pytest.param("section:main-line", (160.0,), (10, 28), marks=pytest.mark.slow),
    ],
)
def test_a_family_or_a_section_is_a_line_of_a_benchmark(source, speeds_kmh, spans):
    """Policies meet the same line under a seed, at speeds for it, over spans that all runs cover."""
    line = {"catenary": source, "speeds_kmh": speeds_kmh}
    given = settings(lines=[line], seeds=[3], policies=["pd"])
    found = benchmark.run(given, workers=1)
    assert found.windows == (Windows(spans),)
    for row in found.rows:
        run = {"speed_kmh": row.speed_kmh, "policy": row.policy, "line_condition": "smooth"}
        assert row.figures.std == simulate(source, seed=3, **run, record_droppers=False).summary(spans).std
        assert row.catenary == source
