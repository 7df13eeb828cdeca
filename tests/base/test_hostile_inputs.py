"""Files and values made to do harm or by mistake: one sentence, at once, whatever reads them."""

import json
import os
import threading
import time

import gymnasium
import numpy as np
import pytest

from panto_agents.ablation import load_ablation
from panto_agents.model_file import read_model
from panto_agents.policy import load as load_model
from panto_agents.settings import load_training
from panto_baselines.benchmark.settings import load_benchmark
from panto_baselines.benchmark.submission import read_submission, replay
from panto_baselines.dataset.designs import load_designs
from panto_baselines.dataset.settings import load_episodes
from panto_baselines.oracle.stored import oracle_settings
from panto_baselines.policies.lanes_law import load_gains
from panto_baselines.report.result import read_result
from panto_env import InputError, Trajectory, simulate
from panto_env.base.checksums import checksum, read_checked
from panto_env.base.files import DEEPEST, MOST_KEYS, read_toml
from panto_env.base.settings import Settings, parse, parse_inline
from panto_env.catalog import load_catenary, load_family, load_pantograph, load_section
from panto_env.catalog.loader import text_of
from panto_env.cli.catalogue import described
from panto_env.control.settings import run_settings
from panto_env.estimation.motion import read_motion
from panto_env.identification.record import read_record

TOML = {
    "catenary": load_catenary,
    "pantograph": load_pantograph,
    "family": load_family,
    "section": load_section,
    "list": lambda path: described(str(path)),
    "benchmark": load_benchmark,
    "training": load_training,
    "ablation": load_ablation,
    "oracle": lambda path: oracle_settings(path, {}, {}),
    "episodes": load_episodes,
    "designs": load_designs,
    "gains": lambda path: load_gains(path),
    "submission": lambda path: read_submission(path.parent),
}
OTHER = {
    "a result": read_checked,
    "a result that is played again": replay,
    "a result for a page": read_result,
    "a model": load_model,
    "a model to export": read_model,
    "a saved run": Trajectory.load,
    "a record of a rig": lambda path: read_record(path, {}),
    "a record of motion": lambda path: read_motion(path, {}),
}
PARTS = DEEPEST + 8
HARM = {
    "keys nested by dots": ".".join(["a"] * 1200) + " = 1\n",
    "quoted keys nested by dots": " . ".join(['"a b"', "'c'"] * 600) + " = 1\n",
    "a hundred thousand parts": ".".join(["a"] * 100_000) + " = 1\n",
    "a deep heading": f"[{'.'.join(['a'] * 1200)}]\nb = 1\n",
    "inline tables": "a = " + "{ b = " * PARTS + "1" + " }" * PARTS + "\n",
    "lists": "a = " + "[" * PARTS + "]" * PARTS + "\n",
    "tables built up": "".join(f"[{'.'.join(f'k{j}' for j in range(i + 1))}]\n" for i in range(31)) + "[x]\n"
    f"{'.'.join(['y'] * 31)} = {{ a = {{ b = {{ c = 1 }} }} }}\n",
    "unknown keys": "".join(f"k{number} = 1\n" for number in range(2 * MOST_KEYS)),
    "fewer unknown keys": "".join(f"key_{number} = 1\n" for number in range(MOST_KEYS - 5)),
    "unknown tables": "".join(f"[[t]]\nk{number} = 1\n" for number in range(MOST_KEYS)),
    "a long word": "unknown = 1\n# " + "a" * 1_000_000 + "\n",
    "many quotes": "unknown = 1\n# " + '"' * 1_000_000 + "\n" + "# " + '"a' * 400_000 + "\n",
}


def refused(read, path, limit=20.0):
    begin = time.process_time()  # whatever else the machine does
    with pytest.raises(InputError) as caught:
        read(path)
    assert time.process_time() - begin < limit
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 1500
    return message


@pytest.mark.parametrize("harm", HARM)
@pytest.mark.parametrize("loader", TOML)
def test_a_toml_file_made_to_do_harm(loader, harm, tmp_path):
    path = tmp_path / "card.toml"
    kind = {"catenary": "flexible", "pantograph": "pantograph", "family": "family", "section": "section"}.get(
        loader
    )
    path.write_text((f"kind = '{kind}'\n" if kind else "") + HARM[harm])
    refused(TOML[loader], path, 8.0)


def test_what_is_deep_or_long_is_said(tmp_path):
    path = tmp_path / "x.toml"
    for harm in (
        "keys nested by dots",
        "a hundred thousand parts",
        "a deep heading",
        "inline tables",
        "lists",
    ):
        path.write_text(HARM[harm])
        assert "is nested too deeply" in refused(read_toml, path, 2.0)
    path.write_text("".join(f"k{number} = 1\n" for number in range(300_000)))
    assert f"it has more than {MOST_KEYS:,} keys" in refused(read_toml, path)
    with path.open("wb") as file:
        file.truncate(10**11)  # sparse
    assert "it has more than 20 MB" in refused(read_toml, path, 1.0)


@pytest.mark.parametrize(
    "text", ["a.b.c.d.e = 1", "a = 'x." + "y." * 100 + "'", "a = [" + "1.5, " * 1000 + "]"]
)
def test_what_is_usual_is_read(text, tmp_path):
    path = tmp_path / "x.toml"
    path.write_text(text)
    if "'" in text:  # text of a hundred parts looks like a key, and no description has one
        assert "nested" in refused(read_toml, path)
    else:
        assert read_toml(path)


@pytest.mark.parametrize("loader", {**TOML, **OTHER})
def test_a_pipe_is_refused_at_once(loader, tmp_path):
    """Nobody writes into it, so reading would never end."""
    suffix = {"a saved run": ".parquet", "a model": ".safetensors"}.get(loader, ".toml")
    path = tmp_path / f"card{suffix}"
    os.mkfifo(path)
    done = []
    thread = threading.Thread(target=lambda: done.append(refused((TOML | OTHER)[loader], path)), daemon=True)
    thread.start()
    thread.join(20)
    if thread.is_alive():
        os.close(os.open(path, os.O_WRONLY | os.O_NONBLOCK))  # lets it go on
    assert done


@pytest.mark.parametrize("device", ["/dev/zero", "/dev/full"])
def test_a_device_is_refused_at_once(device):
    for read in (read_toml, read_checked, OTHER["a record of a rig"], OTHER["a record of motion"]):
        assert "it is not a regular file, but a device" in refused(read, device, 1.0)


def test_json_nested_deeply_with_a_checksum_that_fits(tmp_path):
    table = {}
    for _ in range(200):
        table = {"a": [table]}
    path = tmp_path / "x.json"
    path.write_text(json.dumps({"sha256": checksum(table), **table}))
    assert "nested too deeply" in refused(read_checked, path)


SEEDS = [
    "abc",
    -1,
    1.5,
    True,
    float("nan"),
    b"x",
    {},
    {1, 2},
    object(),
    np.float64(2),
    np.bool_(1),
    np.array(3),
]
LISTS = [["a", "b"], [1.5, 2], [-1, 2], [True, 2], [1], [1, 2, 3], [[1], [2, 3]], np.array([1.0, 2.0])]
OPTIONS = [
    "abc",
    "",
    5,
    0,
    [1],
    [],
    {1: 2},
    np.zeros(3),
    np.zeros(0),
    [("speed_kmh", 200)],
    {"speed_kmh": "x"},
]


@pytest.fixture(scope="module", params=[None, 2])
def env(request):
    name = "panto_env:PantographStiffness-v0"
    if request.param is None:
        return gymnasium.make(name, disable_env_checker=True, distance=40.0).unwrapped
    return gymnasium.make_vec(name, num_envs=2, distance=40.0)


@pytest.mark.parametrize("seed", [*SEEDS, *LISTS])
def test_a_seed_that_is_none(env, seed):
    env.reset(seed=3)
    before = env.np_random_seed
    with pytest.raises(InputError, match=r"^seed must be a (whole )?number"):
        env.reset(seed=seed)
    assert env.np_random_seed == before


@pytest.mark.parametrize("options", OPTIONS)
def test_options_that_are_none(env, options):
    env.reset(seed=3)
    before = env.np_random_seed
    with pytest.raises(InputError):
        env.reset(seed=4, options=options)
    assert env.np_random_seed == before


def test_seeds_that_are(env):
    for seed in (None, 0, 7, np.int64(7), np.uint8(7), 10**30):
        env.reset(seed=seed)
    if isinstance(env, gymnasium.vector.VectorEnv):
        for seeds in ([1, None], (1, 2), np.array([1, 2]), range(2), [np.int64(1), 2]):
            env.reset(seed=seeds)


def kinds(parent=Settings):
    for each in parent.__subclasses__():
        yield each
        yield from kinds(each)


def truths(kind):
    """Keys of truth values alone."""
    return [name for name, field in kind.model_fields.items() if field.annotation is bool]


CASES = [(kind, name) for kind in kinds() if kind.__module__.startswith("panto_") for name in truths(kind)]


def test_there_are_truth_values():
    assert {name for _, name in CASES} >= {
        "bilateral",
        "line_values",
        "blind",
        "wear_drawn",
        "holds_wire",
        "trusted",
    }


@pytest.mark.parametrize(("kind", "name"), CASES, ids=lambda each: getattr(each, "__name__", each))
@pytest.mark.parametrize("value", ["yes", "true", "1", "", 1, 0, 1.0, None])
def test_a_truth_value_is_true_or_false(kind, name, value):
    with pytest.raises(InputError, match=f"key '{name}' must be true or false"):
        parse(kind, {name: value}, "it")


class Odd(Settings):
    whole: int = 1
    number: float = 1.0
    several: tuple[int, ...] = ()
    perhaps: int | None = None


@pytest.mark.parametrize("key", ["whole", "number", "several", "perhaps"])
@pytest.mark.parametrize("value", ["1", "1.0", True, False, b"1"])
def test_text_and_truth_values_are_no_numbers(key, value):
    with pytest.raises(InputError, match=rf"key '{key}(\.1)?' must be a (whole )?number"):
        parse(Odd, {key: [value] if key == "several" else value}, "it")


def test_truth_values_of_the_library():
    for wrong in ("yes", 1, None):
        with pytest.raises(InputError, match="bilateral must be true or false"):
            gymnasium.make("panto_env:PantographStiffness-v0", bilateral=wrong)
        with pytest.raises(InputError, match="record_droppers must be True or False"):
            simulate("periodic-stiffness", "three-mass", distance=50.0, record_droppers=wrong)
    assert parse_inline("blind=true,other=false") == {"blind": True, "other": False}
    assert run_settings({"sensors": "realistic:blind=true"}).sensors.blind
    assert "kind" in text_of("re330")
