"""Every plot of results that are made up, so that its picture depends on the plot alone."""

from dataclasses import replace
from functools import partial
from itertools import product
from types import SimpleNamespace
from unittest import mock

import numpy as np

from panto_baselines.benchmark import report as benchmark_report
from panto_baselines.benchmark.settings import Windows
from panto_baselines.benchmark.statistics import Cell
from panto_baselines.oracle import report as oracle_report
from panto_env.analysis import line_check
from panto_env.analysis import plots as line_plot
from panto_env.analysis.plots import plot_forces, plot_run
from panto_env.analysis.sweep_plots import plot_sweep
from panto_env.catalog import load_catenary
from panto_env.diagnosis.diagnosis import Diagnosis, Finding, plot_diagnosis
from panto_env.diagnosis.features import Evidence
from panto_env.estimation.estimate import plot_estimate
from panto_env.identification.performance import Match, plot_matches, plot_record
from panto_env.identification.record import Record
from panto_env.plant.alignment import Alignment
from panto_env.report import charts
from panto_env.rig.computer import Pair
from panto_env.rig.report import plot_pairs

from ..analysis.test_line_check import of_unlike_spans
from ..metrics.test_summary import RUN as FORCES

TIME = np.linspace(0, 15, 6001)
WAVE = 120 + 30 * np.sin(5 * TIME) + 10 * np.sin(40 * TIME)
HEIGHTS = {"wire": 1e-3 * WAVE[:4000:100], "head": 1.1e-3 * WAVE[:4000:100], "frame": 9e-4 * WAVE[:2000:50]}
RUN = replace(FORCES, **HEIGHTS)
QUIET = replace(RUN, frame_force=0 * RUN.frame_force, head_force=0 * RUN.head_force)
OTHER = replace(RUN, contact_force=0.8 * RUN.contact_force, catenary="a rig", head=1e-3 * RUN.contact_force)
ROW = {"catenary": "a line", "pantograph": "one", "system": "AC", "spans": "10-19", "terminated": False}


def rows():
    """A sweep over two parameters."""
    for k, (policy, speed, mass) in enumerate(product(("passive", "pd"), (200.0, 300.0), (5.0, 7.0))):
        figures = {"mean": 120.0 + k, "std": 20.0 + 3 * k, "max": 180.0 + 9 * k, "min": 60.0 - 5 * k}
        figures |= {"statistical_max": 190.0 + 9 * k, "statistical_min": 50.0 - 6 * k}
        figures |= {"max_uplift": 0.04 + 0.003 * k, "contact_loss": 0.1 * k}
        yield ROW | figures | {"speed_kmh": speed, "mass": mass, "policy": policy}


def sweep(*names, **other):
    kept = [row | other for row in rows() if "mass" in names or row["mass"] == 5.0]
    return plot_sweep(kept, names, {"speed_kmh": "speed (km/h)", "mass": "mass (kg)"})


def several():
    ended = replace(RUN, contact_force=1.5 * RUN.contact_force, catenary="another", terminated=True)
    return plot_forces((RUN, ended), ("p", "q"), (1, 3), "two runs")


def line(data):
    return line_plot.plot_line(line_check.check(data, 100.0))


def diagnosis():
    x = np.linspace(0, 200, 801)
    score = 0.01 + np.exp(-(((x - 93) / 4) ** 2)) * 8
    droppers = np.arange(2.0, 200, 6)
    evidence = Evidence(x, WAVE[:1602:2] - 120, score, 2.5, Alignment.equal(40.0, 5), droppers, 50, 120, 9)
    finding = Finding("broken dropper", {}, 92.0, 3, 12.0, 3, 2, 3.2)
    return plot_diagnosis(Diagnosis((finding,), False, 1.0, evidence, 10.0, 190.0, 0.5, ()), "a title")


def estimate():
    tested = SimpleNamespace(window_time=np.arange(2.0, 15), window_nis=1 + 0.1 * np.arange(13.0), nis=1.2)
    found = SimpleNamespace(time=TIME, force=WAVE, first=400, consistency=tested)
    return plot_estimate(found, "a title", WAVE + 15 * np.sin(3 * TIME))


def matches():
    found = [
        Match("y_p1", "force", 1e-3 * WAVE, 1.1e-3 * WAVE),
        Match("force", "plate", WAVE, WAVE + 9 * np.cos(7 * TIME)),
    ]
    return plot_matches(TIME, found, "a title", 1.0, 13.0)


def oracle():
    steps = [SimpleNamespace(number=k, std=20.0 - 4 * k) for k in range(4)]
    searches = [
        SimpleNamespace(start="passive", iterations=steps),
        SimpleNamespace(start="q", iterations=steps[1:]),
    ]
    problem = SimpleNamespace(
        passive=RUN,
        chosen=(2, 3),
        spans=(2, 3),
        seed=7,
        figures=SimpleNamespace(std=19.0),
        settings=SimpleNamespace(pantographs=(), controlled=(1,)),
    )
    forces = RUN.contact_force, OTHER.contact_force
    found = SimpleNamespace(problem=problem, run=RUN, forces=forces, searches=searches, change=-0.123)
    return oracle_report.plot(found)


def cells():
    for k, (policy, speed) in enumerate(product(("passive", "p", "q"), (250.0, 300.0))):
        figures = {"std": 20.0 + 2 * k if k != 3 else np.nan, "mean": 120.0 + k}
        change, interval = -3.0 * k, None if k == 2 else (-3.0 * k - 2, -3.0 * k + 4)
        rest = {"cost_change": 0.0, "mean_change": 0.0, "most_moved": 0.0, "moved": 0, "improved": 1.0}
        rest |= {
            "early": change,
            "late": None,
            "harm": None,
            "kilometres": (),
            "spread": 0.0,
            "oracle": None,
            "oracle_share": None,
            "disqualified": "moved" * (k == 5),
            "rank": None,
        }
        yield Cell(policy, "a", "b", "", speed, 4, 120.0, figures, change, interval, **rest)


def benchmark():
    line = SimpleNamespace(catenary="a", pantograph="b", case="", speeds_kmh=(250.0, 300.0))
    settings = SimpleNamespace(
        lines=(line,), drawn_seeds=(3, 4), policies_on=lambda line: ("passive", "p", "q")
    )
    rows = [
        SimpleNamespace(policy=policy, catenary="a", pantograph="b", case="", speed_kmh=300.0, seed=3)
        for policy in ("passive", "p", "q")
    ]
    outcome = SimpleNamespace(
        settings=settings, windows=(Windows((1, 3)),), cells=tuple(cells()), rows=rows, played=[None] * 3
    )
    runs = [(replace(run, speed=300 / 3.6), None) for run in (RUN, OTHER, QUIET)]
    with mock.patch.object(benchmark_report, "drive", side_effect=runs):
        return benchmark_report.plot(outcome)


def findings(run, number):
    inside = run.inside((2, 4))
    share = np.linspace(0, 1, 40, endpoint=False)
    wave = 100 + 9 * np.sin(6 * share + number)
    return SimpleNamespace(
        run=run,
        inside=inside,
        losses=[SimpleNamespace(position=13.5)],
        folded=SimpleNamespace(share=share, median=wave, low=wave - 20, high=wave + 30),
        uplifts=[(k, 5.0 * k, 1e-3 * (40 + 3 * k + number)) for k in range(1, 4)],
        droppers=[SimpleNamespace(position=place) for place in (0.5, 1.7, 2.9)],
        elasticity=(np.linspace(0, 5, 30), 1e-3 * (0.3 + 0.1 * np.sin(np.linspace(0, 3, 30))), 20.0),
    )


class _Hashed(SimpleNamespace):
    __hash__ = object.__hash__


def chart(name):
    """The figure of a chart of the report."""
    first, second = (_Hashed(**vars(findings(run, k))) for k, run in enumerate((RUN, OTHER)))
    names = {first: "first", second: "second"}
    calls = {
        "along": lambda: charts.force_along(first, [first, second]),
        "folded": lambda: charts.force_folded(names),
        "spectrum": lambda: charts.spectrum(names),
        "uplifts": lambda: charts.uplifts(names),
        "stiffness": lambda: charts.stiffness(first),
    }
    kept = []

    def savefig(figure, file, **_):
        kept.append(figure)
        file.write("<svg")

    with mock.patch("matplotlib.figure.Figure.savefig", savefig):
        calls[name]()
    return kept[0]


PLOTS = {
    "run": lambda: plot_run(RUN, "all"),
    "run-passive": lambda: plot_run(QUIET, (2, 3)),
    "runs": several,
    "sweep": lambda: sweep("speed_kmh"),
    "sweep-without-loss": lambda: sweep("speed_kmh", contact_loss=0.0, max=200.0, terminated=True),
    "maps": lambda: sweep("speed_kmh", "mass"),
    "line": lambda: line(load_catenary("en50318-2002")),
    "line-of-unlike-spans": lambda: line(of_unlike_spans()),
    "rig": lambda: plot_pairs([Pair(RUN, OTHER, "all")]),
    "record": lambda: plot_record(
        Record(2.5e-3, 1e-3 * WAVE, 2e-3 * WAVE, 3e-3 * WAVE, WAVE, 2.0), "it", 12.0
    ),
    "matches": matches,
    "diagnosis": diagnosis,
    "estimate": estimate,
    "oracle": oracle,
    "benchmark": benchmark,
    **{
        f"report-{name}": partial(chart, name)
        for name in ("along", "folded", "spectrum", "uplifts", "stiffness")
    },
}
