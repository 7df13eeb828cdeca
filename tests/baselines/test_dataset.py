"""Data to learn from: episodes as Minari reads them, designs as a table, whatever ended their making."""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest
from huggingface_hub import DatasetCard

from panto_baselines.benchmark import settings as seeds
from panto_baselines.dataset import designs
from panto_baselines.dataset.designs import DesignsSettings, load_designs
from panto_baselines.dataset.episodes import COLUMNS, Stage, read_part
from panto_baselines.dataset.make import LIST, make_designs, make_episodes, verify
from panto_baselines.dataset.settings import EpisodesSettings, chosen, load_episodes
from panto_configs import names
from panto_env import InputError, simulate
from panto_env import cluster as parts
from panto_env.base.checksums import read_checked, write_arrays, write_checked
from panto_env.base.files import alone_in
from panto_env.base.settings import parse

PANTO = Path(sys.executable).with_name("panto")
KNOWN = {"catenary": "en50318-2002", "pantograph": "en50318-2002", "speed_kmh": [280, 300]}
OTHER = {"catenary": "re330", "pantograph": "dsa380", "speed_kmh": [240, 260]}
TABLE = {
    "title": "tiny",
    "environment": {"distance": 60.0, "washout": 0.0, "settle": 0.0},
    "places": [KNOWN],
    "sets": [{"name": "noisy-pd", "policies": ["pd"], "noise": [0.0, 0.2], "episodes": 2}],
}
RANGES = {
    "speed_kmh": (200.0, 300.0),
    "catenary.span_length": (50.0, 65.0),
    "pantograph.masses.1": (5.0, 10.0),
}


def settings(**changes):
    return parse(EpisodesSettings, TABLE | changes, "test")


def few_designs(**changes):
    return parse(DesignsSettings, {"title": "few", "ranges": RANGES, "count": 3} | changes, "test")


def panto(*arguments, cwd):
    return subprocess.run([PANTO, *map(str, arguments)], capture_output=True, text=True, cwd=cwd)


@pytest.fixture(scope="module")
def minari():
    return pytest.importorskip("minari")


@pytest.fixture(scope="module")
def made(minari, tmp_path_factory):
    """A folder of one data set, and what was told of it."""
    folder = tmp_path_factory.mktemp("data")
    (one,) = make_episodes(settings(), folder, workers=1)
    return folder, one


@pytest.fixture
def data(made, minari, monkeypatch):
    folder, one = made
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(folder))
    return minari.load_dataset(one.dataset_id)


@pytest.mark.longer
def test_of_the_project_are_whole_and_have_seeds_of_their_own():
    for name in names("dataset"):
        found = load_episodes(name)
        for policy_set in found.sets:
            plans = list(found.plans(policy_set))
            assert len(plans) == found.count(policy_set)
            assert {plan.seed for plan in plans} <= set(seeds.DATA)
            assert len({plan.seed for plan in plans}) == len(plans)
            kinds = {(plan.policy, plan.noise, plan.place) for plan in plans}
            assert len(kinds) * policy_set.episodes == len(plans)
    assert {"dataset-known-line", "dataset-unknown-lines"} <= set(names("dataset"))
    assert load_designs("dataset-designs").count >= 10_000


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"title": "Known Line"}, "title"),
        ({"places": [KNOWN, KNOWN]}, "is given twice"),
        ({"environment": {"speed_kmh": 300}}, "speed_kmh belongs into places"),
        ({"seed": 999_998}, "a set has 4 episodes from seed 999,998 on, of 1,000,000 seeds"),
        ({"sets": [TABLE["sets"][0] | {"episodes": 0}]}, "episodes"),
    ],
)
def test_nonsense_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        settings(**changes)


@pytest.mark.longer
def test_what_cannot_be_run_is_refused_before_anything_is_made(tmp_path, minari):
    tuned = {"sets": [TABLE["sets"][0] | {"policies": ["tuned-pd"]}]}
    for changes, message in (
        ({"environment": {"distanse": 60}}, "arguments of the environment"),
        ({"environment": {"distance": 60.0}}, "needs washout = 0, and the data set's environment has 1"),
        ({"sets": [TABLE["sets"][0] | {"policies": ["pdd"]}]}, "Unknown policy 'pdd'"),
        ({"places": [KNOWN | {"catenary": "nowhere"}]}, "nowhere"),
        (tuned | {"places": [KNOWN | {"speed_kmh": [200, 300]}]}, "in reset: .* not for 200 km/h"),
    ):
        with pytest.raises(InputError, match=message):
            make_episodes(settings(**changes), tmp_path / "out", workers=1)
        assert not (tmp_path / "out").exists()


def test_sets_are_chosen_by_name():
    found = load_episodes("dataset-known-line")
    assert [each.name for each in chosen(found, ("passive",)).sets] == ["passive"]
    with pytest.raises(InputError, match="There is no set 'pasive'"):
        chosen(found, ("pasive",))


@pytest.mark.longer
def test_a_data_set_loads_and_gives_its_environment_back(data, made):
    _, one = made
    assert (one.episodes, one.steps, one.kept) == (len(data), data.total_steps, False)
    env = data.recover_environment()
    assert env.spec.kwargs["distance"] == 60.0
    assert env.spec == data.env_spec
    assert env.observation_space == data.observation_space
    assert data.spec.env_spec.kwargs["catenary"] == "en50318-2002"


@pytest.mark.longer
def test_seed_and_actions_give_an_episode_again(data):
    env = data.recover_environment()
    for k, (episode, facts) in enumerate(
        zip(data, data.storage.get_episode_metadata(range(len(data))), strict=True)
    ):
        assert facts["seed"] == seeds.DATA[k]
        observations, rewards = [env.reset(seed=facts["seed"], options=facts.get("options"))[0]], []
        for step, action in enumerate(episode.actions, start=1):
            observation, reward, terminated, truncated, info = env.step(action)
            observations.append(observation)
            rewards.append(reward)
            assert info["contact_force"] == episode.infos["contact_force"][step]
            assert info["reward_terms"]["rate"] == episode.infos["reward_terms"]["rate"][step]
        np.testing.assert_array_equal(observations, episode.observations)
        np.testing.assert_array_equal(rewards, episode.rewards)
        assert (terminated, truncated) == (episode.terminations[-1], episode.truncations[-1])
        assert truncated
        assert facts["figures"]["std"] == info["figures"]["std"]
        assert facts["return"] == pytest.approx(sum(rewards))


@pytest.mark.longer
def test_noise_is_as_strong_as_asked_for_and_the_policy_s_own_wish_is_kept(data):
    for episode, facts in zip(data, data.storage.get_episode_metadata(range(4)), strict=True):
        added = episode.actions - episode.infos["policy_action"][1:]
        inside = np.abs(episode.actions) < 1
        assert np.std(added[inside]) == pytest.approx(facts["noise"], abs=0.05)
        assert (np.abs(added).max() > 1e-6) == (facts["noise"] > 0)
    assert {facts["noise"] for facts in data.storage.get_episode_metadata(range(4))} == {0.0, 0.2}


def test_metadata_say_what_it_is(data, made):
    folder, one = made
    told = data.storage.metadata
    assert told["algorithm_name"] == "pd, with white noise of rms 0.2 on the action"
    assert "Seeds 2000000 to 2000003" in told["description"]
    assert told["code_permalink"].startswith("panto-env ")
    card = (folder / one.dataset_id / "card.md").read_text()
    assert "\n# pantograph/tiny/noisy-pd-v0\n" in card
    assert "| pd | 0.2 | en50318-2002 | 2 |" in card
    assert "| 7 | force deviation |" in card


def test_the_table_of_steps_holds_the_same_as_minari(data, made):
    folder, one = made
    table = pq.read_table(folder / one.dataset_id / "steps.parquet")
    assert table.num_rows == one.steps
    assert table.column_names[: len(COLUMNS)] == list(COLUMNS)
    for number, episode in enumerate(data):
        own = table.filter(pc.field("episode") == number).to_pydict()
        assert own["step"] == list(range(len(episode.rewards)))
        assert set(own["policy"]) == {"pd"}
        there = {"observation": episode.observations[:-1], "next_observation": episode.observations[1:]}
        there |= {"action": episode.actions, "reward": episode.rewards}
        there |= {"terminated": episode.terminations, "truncated": episode.truncations}
        there |= {name: episode.infos[name][1:] for name in ("contact_force", "policy_action")}
        there["reward_terms/rate"] = episode.infos["reward_terms"]["rate"][1:]
        for name, values in there.items():
            np.testing.assert_array_equal(own[name], values, err_msg=name)


def test_a_hub_reads_the_head_of_the_card(made):
    folder, one = made
    head = DatasetCard.load(folder / one.dataset_id / "card.md").data
    assert (head.license, head.task_categories) == ("mit", ["reinforcement-learning"])
    assert head.pretty_name == one.dataset_id
    assert head.size_categories == ["n<1K" if one.steps < 1000 else "1K<n<10K"]
    (config,) = head.to_dict()["configs"]
    assert (folder / one.dataset_id / config["data_files"]).is_file()


@pytest.mark.slow
def test_the_same_is_made_again_to_the_last_byte_and_kept_where_it_is(made, tmp_path):
    _, one = made
    (again,) = make_episodes(settings(), tmp_path, workers=1)
    for file in ("data/main_data.hdf5", "steps.parquet", "card.md"):
        assert (again.folder / file).read_bytes() == (one.folder / file).read_bytes()
    (kept,) = make_episodes(settings(), tmp_path, workers=1)
    assert kept.kept
    with pytest.raises(InputError, match=r"holds another data set of this id .*raise the version"):
        make_episodes(settings(seed=7), tmp_path, workers=1)


def test_other_places_are_options_of_reset_and_a_policy_sees_what_it_asks_for():
    both = settings(places=[KNOWN, OTHER])
    plans = list(both.plans(both.sets[0]))
    assert {plan.place for plan in plans} == {0, 1}
    stage = Stage(both)
    there = stage.play(plans[-1]._replace(noise=0.0))
    assert both.options(plans[-1]) == OTHER
    assert 240 <= there.infos["speed_kmh"][0] <= 260
    np.testing.assert_array_equal(there.actions, there.infos["policy_action"][1:].astype(np.float32))
    agent = Stage(settings()).play(plans[0]._replace(policy="agent-known-line"))
    assert agent.observations.shape[1] == there.observations.shape[1] == 10
    assert np.abs(agent.actions).max() > 0.01


def played(folder, observation, action):
    """An episode of a policy of a file that wishes this observation, and always acts alike."""
    path = folder / "mine.py"
    path.write_text(
        f"import numpy as np\nclass Mine:\n    observation = {observation!r}\n"
        f"    def reset(self, context): pass\n    def act(self, seen): return np.full(1, {action})\n"
    )
    plan = next(settings().plans(settings().sets[0]))
    return Stage(settings()).play(plan._replace(policy=f"{path}:Mine"))


def test_a_policy_whose_action_is_no_number_is_refused(tmp_path):
    with pytest.raises(InputError, match="its action must be finite numbers"):
        played(tmp_path, "measured", "np.nan")


@pytest.mark.slow
def test_an_estimator_changes_what_is_seen_and_nothing_else(tmp_path):
    assert (played(tmp_path, "estimated", 0.0).actions == 0).all()


@pytest.mark.slow
def test_the_whole_command_may_be_killed(tmp_path):
    """SIGKILL of the command itself while a table is made: what is whole stays, and is not made again."""
    (tmp_path / "few.toml").write_text(
        'title = "few"\ncount = 200\n[ranges]\nspeed_kmh = [200, 300]\n"pantograph.masses.1" = [5, 10]\n'
    )
    command = [PANTO, "dataset", "designs", "few.toml", "--output", "out", "--workers", "1"]
    process = subprocess.Popen(command, cwd=tmp_path, start_new_session=True)
    first = tmp_path / "out/.parts/designs/0000000.json"
    while not first.exists():
        assert process.poll() is None
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    made = first.stat().st_mtime_ns
    assert not (tmp_path / "out/designs").exists()
    rows = read_checked(first)["rows"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    table = pq.read_table(tmp_path / "out/designs/designs.parquet")
    assert table["design"].to_pylist() == list(range(200))
    assert table["std"].to_pylist()[:64] == [row["std"] for row in rows]
    assert made < (tmp_path / "out/designs").stat().st_mtime_ns


def test_two_processes_do_not_make_data_in_one_folder(tmp_path):
    message = "Another process makes data in"
    with alone_in(tmp_path, "makes data in"), pytest.raises(InputError, match=message):
        make_designs(few_designs(), tmp_path, workers=1)


def test_files_are_as_listed_until_one_changes(made, tmp_path):
    _, one = made
    copied = tmp_path / "copy"
    shutil.copytree(one.folder, copied)
    assert verify(tmp_path) == [(copied, 4)]
    listed = dict(reversed(line.split("  ")) for line in (copied / LIST).read_text().splitlines())
    file = copied / "data/main_data.hdf5"
    assert listed["data/main_data.hdf5"] == hashlib.sha256(file.read_bytes()).hexdigest()
    (copied / "more.txt").write_text("mine")
    with pytest.raises(InputError, match=r"more.txt is not in SHA256SUMS"):
        verify(copied)
    (copied / "more.txt").unlink()
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)
    with pytest.raises(InputError, match=r"main_data.hdf5 does not match SHA256SUMS"):
        verify(copied)
    file.unlink()
    with pytest.raises(InputError, match=r"main_data.hdf5 is missing"):
        verify(copied)
    with pytest.raises(InputError, match="There is no SHA256SUMS in or below"):
        verify(tmp_path / "nothing")


def test_a_part_draws_what_the_whole_draws_evenly_over_the_ranges():
    found = few_designs(count=256)
    values = designs.draw(found, 0, 256)
    np.testing.assert_array_equal(values[100:130], designs.draw(found, 100, 130))
    low, high = np.array(list(RANGES.values())).T
    shares = (values - low) / (high - low)
    assert ((shares >= 0) & (shares <= 1)).all()
    for column in shares.T:
        counts, _ = np.histogram(column, bins=16, range=(0, 1))
        assert (counts == 16).all()


def test_a_row_is_what_simulate_says():
    values = {"speed_kmh": 250.0, "catenary.span_length": 60.0, "pantograph.masses.1": 7.2}
    row = designs.design(few_designs(), 5, values)
    figures = simulate(speed_kmh=250.0).summary().as_dict()
    assert [row[name] for name in designs.FIGURES] == [figures[name] for name in designs.FIGURES]
    assert (row["design"], row["refused"], row["ending"], row["accuracy_warning"]) == (5, "", "", "")


def test_a_longer_span_takes_its_droppers_along():
    values = {"speed_kmh": 250.0, "catenary.span_length": 54.0, "pantograph.masses.1": 7.2}
    line, _ = designs.designed(few_designs(), values)
    base = few_designs().entries()["catenary"]
    assert line.span_length == 54.0
    np.testing.assert_allclose(line.droppers.positions, 0.9 * np.array(base.droppers.positions))


def test_what_cannot_be_run_or_ends_early_or_is_inaccurate_has_a_row_that_says_so(tmp_path):
    ranges = {"speed_kmh": (200.0, 600.0), "pantograph.static_force": (60.0, 900.0)}
    found = few_designs(ranges=ranges, count=4)
    refused = designs.design(found, 0, {"speed_kmh": 590.0, "pantograph.static_force": 120.0})
    assert "km/h" in refused["refused"]
    early = designs.design(found, 1, {"speed_kmh": 300.0, "pantograph.static_force": 880.0})
    assert early["ending"].startswith("The run ended early at ")
    assert {refused["std"], early["std"]} == {None}
    assert early["time_step"] > 0
    hard = few_designs(ranges={"speed_kmh": (200.0, 300.0), "pantograph.contact_stiffness": (5e4, 1e6)})
    warned = designs.design(hard, 2, {"speed_kmh": 250.0, "pantograph.contact_stiffness": 9e5})
    assert "A contact stiffer than" in warned["accuracy_warning"]
    assert warned["std"] > 0


@pytest.mark.slow
def test_a_table_tells_what_it_is(tmp_path):
    found = few_designs(ranges=RANGES | {"catenary.encumbrance": (0.5, 1.3)}, count=8)
    made = make_designs(found, tmp_path, workers=1)
    assert made.designs == 8
    assert 0 < made.refused < 8
    table = pq.read_table(made.folder / "designs.parquet")
    assert table.num_rows == 8
    refused = sum(text != "" for text in table["refused"].to_pylist())
    assert refused == made.refused == table["std"].null_count
    told = json.loads(table.schema.metadata[b"panto_env"])
    assert told["settings"]["seed"] == 0
    assert b"(m)" in table.schema.field("max_uplift").metadata[b"description"]
    assert b"drawn from 200 to 300" in table.schema.field("speed_kmh").metadata[b"description"]
    card = (made.folder / "card.md").read_text()
    assert f"- {made.refused} of 8 refused (`refused`):" in card
    head = DatasetCard(card).data
    assert (head.task_categories, head.size_categories) == (["tabular-regression"], ["n<1K"])
    assert (made.folder / head.to_dict()["configs"][0]["data_files"]).is_file()
    assert verify(tmp_path) == [(made.folder, 2)]
    assert make_designs(found, tmp_path, workers=1).kept
    with pytest.raises(InputError, match=r"holds another table .*its seed is 0, this is 1"):
        make_designs(found.model_copy(update={"seed": 1}), tmp_path, workers=1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ranges": {"pantograph.masses.1": (5, 10)}}, "ranges must have speed_kmh"),
        ({"ranges": RANGES | {"pantograph.mases.1": (5, 10)}}, "did you mean 'pantograph.masses.1'"),
        ({"ranges": RANGES | {"actuator.lag": (0, 0.1)}}, "must be speed_kmh or begin with"),
        ({"ranges": {"speed_kmh": (300, 200)}}, "must rise"),
        ({"count": 0}, "count"),
    ],
)
def test_ranges_that_are_nonsense_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        few_designs(**changes)


@pytest.mark.slow
def test_kept_parts_count_as_done_and_damaged_ones_are_made_again(tmp_path):
    told, path = [], tmp_path / "0.json"
    parts.make_parts({path: partial(_part, "whole")}, read_checked, workers=1)
    parts.make_parts({path: _never}, read_checked, workers=1, progress=lambda *done: told.append(done))
    assert told == [(1, 1)]
    for damage in (lambda: path.write_text(path.read_text().replace("whole", "Whole")), path.unlink):
        damage()
        parts.make_parts({path: partial(_part, "again")}, read_checked, workers=1)
        assert read_checked(path) == {"text": "again"}
    named = tmp_path / "0.safetensors"
    write_arrays(named, {}, {"0|rewards|": np.ones(3)})
    parts.make_parts({named: _never}, read_part, workers=1)
    named.write_bytes(named.read_bytes()[:-1])
    with pytest.raises(AssertionError, match="is not made again"):
        parts.make_parts({named: _never}, read_part, workers=1)


def _part(text, path):
    write_checked(path, {"text": text})


def _never(path):
    raise AssertionError("what is there is not made again")
