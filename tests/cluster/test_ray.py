"""Work over a Ray cluster of two machines, which here are two nodes of this one; `make ray` runs it.

Workers are killed by a policy, ``deadly``.
"""

import importlib
import os
import sys
import time
from functools import partial
from pathlib import Path

import pytest

pytest.importorskip("ray")
pytest.importorskip("stable_baselines3")

import ray
from ray.cluster_utils import Cluster

from panto_agents.model_file import read_model
from panto_agents.trainings import RunFolder, train_all
from panto_baselines.benchmark.run import run
from panto_baselines.benchmark.settings import BenchmarkSettings, Line
from panto_env import InputError
from panto_env import cluster as tasks
from panto_env.cluster import spread

from ..agents.test_agents import rows, settings
from ..deadly import deadly
from ..plugin import on_path

NODE = {"num_cpus": 1, "object_store_memory": 80 * 2**20}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder whose packages this process and all nodes find."""
    folder = tmp_path_factory.mktemp("site")
    with pytest.MonkeyPatch.context() as patch:
        on_path(folder, patch)
        yield folder


@pytest.fixture(scope="module")
def two_nodes(site):
    """Address of a cluster of two nodes with one CPU each."""
    cluster = Cluster(initialize_head=True, head_node_args=NODE)
    cluster.add_node(**NODE)
    yield cluster.address
    cluster.shutdown()


def node(mark: Path) -> str:
    """Node of a job that waits until another one has begun."""
    mark.touch()
    begun = time.monotonic()
    while len(list(mark.parent.iterdir())) < 2 and time.monotonic() < begun + 60:
        time.sleep(0.05)
    return ray.get_runtime_context().get_node_id()


def later(seconds: float, result: str) -> str:
    time.sleep(seconds)
    return result


def fail() -> None:
    raise InputError("This job fails.")


def die() -> None:
    os.kill(os.getpid(), 9)


class TestJobs:
    def test_both_nodes_work(self, two_nodes, tmp_path):
        one, other = spread([partial(node, tmp_path / name) for name in "ab"], ray=two_nodes)
        assert one != other

    def test_a_job_runs_in_the_folder_of_the_caller(self, two_nodes, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        assert spread([os.getcwd], ray=two_nodes) == [str(tmp_path)]

    def test_a_job_that_a_machine_cannot_load_is_named(self, two_nodes, tmp_path, monkeypatch):
        (tmp_path / "only_here.py").write_text("def work():\n    return 1\n")
        monkeypatch.syspath_prepend(tmp_path)
        job = importlib.import_module("only_here").work
        monkeypatch.setattr(sys, "path", sys.path[1:])  # which Ray hands to the workers
        with pytest.raises(InputError, match=r"could not load a job \(.*No module named 'only_here'\)"):
            spread([job], ray=two_nodes)

    def test_results_are_in_order_and_progress_counts_every_job(self, two_nodes):
        done = []
        jobs = [partial(later, 0.5, "first"), partial(later, 0.0, "second"), partial(later, 0.0, "third")]
        jobs.append(partial(os.environ.get, "OPENBLAS_NUM_THREADS"))
        results = spread(jobs, ray=two_nodes, progress=lambda *counts: done.append(counts))
        assert results == ["first", "second", "third", "1"]
        assert done == [(k, 4) for k in range(1, 5)]

    def test_errors_of_jobs_come_through(self, two_nodes):
        with pytest.raises(InputError) as caught:
            spread([fail, partial(later, 0.0, "never mind")], ray=two_nodes)
        assert str(caught.value) == "This job fails."

    def test_a_job_that_always_kills_its_worker_is_given_up(self, two_nodes, monkeypatch):
        monkeypatch.setattr(tasks, "RETRIES", 1)
        with pytest.raises(
            InputError, match="started 2 times on the Ray cluster and lost each time"
        ) as caught:
            spread([die], ray=two_nodes)
        assert "\n" not in str(caught.value)

    def test_a_machine_with_other_sources_is_refused(self, two_nodes, monkeypatch):
        monkeypatch.setattr(tasks, "source_hash", lambda: "of another version")
        with pytest.raises(InputError, match="has other sources of panto-env"):
            spread([partial(later, 0.0, "never")], ray=two_nodes)

    def test_what_cannot_be_joined(self, two_nodes):
        for address in ("nowhere:at-all", "127.0.0.1:1"):
            with pytest.raises(InputError, match=f"No Ray cluster could be joined at '{address}'") as caught:
                spread([fail], ray=address)
            assert "\n" not in str(caught.value)
        with pytest.raises(InputError, match="leave out either workers or ray"):
            spread([fail], ray=two_nodes, workers=2)
        ray.init(address=two_nodes, logging_level="ERROR")
        try:
            with pytest.raises(InputError, match="connected to a Ray cluster already"):
                spread([fail], ray=two_nodes)
        finally:
            ray.shutdown()

    def test_a_cluster_of_this_machine_alone_ends_with_the_jobs(self):
        assert spread([partial(later, 0.0, "done")] * 2, ray="local") == ["done", "done"]
        assert not ray.is_initialized()


def test_a_benchmark_whose_worker_is_killed_is_that_of_processes(two_nodes, tmp_path):
    line = Line(catenary="periodic-stiffness", pantograph="three-mass", speeds_kmh=(250.0, 300.0))
    policy = deadly(tmp_path, wanted=tmp_path)
    settings = BenchmarkSettings(policies=(policy, "pd"), lines=(line,), seeds=2)
    spread_out = run(settings, ray=two_nodes)
    assert (tmp_path / "deadly.dead").exists()
    assert spread_out.as_dict() == run(settings, workers=2).as_dict()
    assert len(spread_out.rows) == 2 * 3 * 2


def test_a_machine_that_dies_loses_no_job(tmp_path):
    cluster = Cluster(initialize_head=True, head_node_args=NODE)
    try:
        doomed = cluster.add_node(**NODE)
        jobs = [partial(node, tmp_path / "a"), partial(node, tmp_path / "b")]
        jobs += [partial(later, 3.0, str(k)) for k in range(4)]

        def kill_after_two(done, count):
            if done == 2:
                cluster.remove_node(doomed, allow_graceful=False)

        results = spread(jobs, ray=cluster.address, progress=kill_after_two)
    finally:
        cluster.shutdown()
    assert results[0] != results[1]  # both machines had begun to work
    assert results[2:] == ["0", "1", "2", "3"]


def test_a_training_whose_worker_is_killed_goes_on_from_its_checkpoint(two_nodes, site, tmp_path):
    folder = tmp_path / "run"
    deadly(site, wanted=folder / "checkpoints" / "step-000000256.safetensors")
    killed, other = settings("ppo", total_steps=768, residual_of="deadly"), settings("ppo", seed=2)
    train_all({folder: killed, tmp_path / "other": other}, ray=two_nodes)
    assert (site / "deadly.dead").exists()
    assert read_model(folder / "model.safetensors")[0].steps == 768
    assert [row["steps"] for row in rows(RunFolder(folder))] == [str(128 * k) for k in range(7)]
