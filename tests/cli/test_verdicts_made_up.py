"""What a diagnosis and a comparison of rigs print of results that are made up."""

import json
from types import SimpleNamespace

import pytest

from panto_env.base.table import Table

from ..command import panto
from .test_printed_made_up import cells, wide  # noqa: F401  # a fixture


def test_a_healthy_and_an_unhealthy_line(monkeypatch, tmp_path):
    from panto_env.cli import diagnose

    runs = SimpleNamespace(load=lambda path: SimpleNamespace(catenary="a", speed_kmh=250.0, path=path))
    monkeypatch.setattr(diagnose, "Trajectory", runs)
    called = {}
    evidence = SimpleNamespace(threshold=2.5)
    found = SimpleNamespace(
        findings=(), healthy=True, changed=False, level=1.0, begin=10.0, end=90.0, evidence=evidence,
        false_alarms=0.1, notes=("first note", "second note"),
    )  # fmt: skip

    def judge(judged, reference, **given):
        called.update(
            given, judged=[run.path.name for run in judged], reference=[run.path.name for run in reference]
        )
        return found

    monkeypatch.setattr("panto_env.diagnosis.diagnose", judge)
    monkeypatch.setattr(
        "panto_env.diagnosis.diagnosis.verdict", lambda found: ["It is healthy.", "So it is."]
    )
    words = ("diagnose", "run", "--healthy", "a", "b", "c", "--again", "d", "--seed", 4)
    done = panto(*words)
    assert done.returncode == 0
    assert done.stdout.splitlines()[:2] == ["It is healthy.", "So it is."]
    for note in found.notes:
        assert f"Degraded: {note}" in done.stdout
    assert called == {
        "judged": ["run", "d"], "reference": ["a", "b", "c"], "seed": 4, "pantograph": None,
        "false_alarms": 0.1,
    }  # fmt: skip
    told = json.loads(panto(*words, "--json", "--false-alarms", 20).stdout)
    assert called["false_alarms"] == 20
    assert told == {
        "healthy": True, "changed": False, "level": 1.0, "begin": 10.0, "end": 90.0, "threshold": 2.5,
        "false_alarms": 0.1, "notes": ["first note", "second note"], "findings": [],
    }  # fmt: skip
    for wrong, sentence in (
        (("--false-alarms", 0), "--false-alarms must lie between 1e-06 and 20 per km, not 0."),
        (("--false-alarms", 20.1), "--false-alarms must lie between 1e-06 and 20 per km, not 20.1."),
        (("--seed", -1), "--seed must be a whole number from 0 up, not -1."),
    ):
        refused = panto("diagnose", "run", "--healthy", "a", *wrong)
        assert (refused.returncode, sentence in refused.stderr) == (2, True)

    monkeypatch.setattr(
        "panto_env.diagnosis.diagnosis.findings_table", lambda found: Table("where", ("m",), (("93",),))
    )
    titles = []
    monkeypatch.setattr(
        "panto_env.diagnosis.diagnosis.plot_diagnosis", lambda found, title: titles.append(title)
    )
    monkeypatch.setattr("panto_env.analysis.plots.save", lambda plot, path: None)
    assert "where" not in done.stdout
    found.findings = (SimpleNamespace(begin=93.0),)
    alone = panto("diagnose", "run", "--healthy", "a", "b", "--plot", tmp_path / "it.png")
    assert ["93"] in cells(alone.stdout)
    assert titles == ["run: a at 250 km/h, 2 healthy runs"]


@pytest.mark.parametrize(
    ("options", "lines"), [((), ["re250", "it"]), (("--reference", "re330"), ["re330"] * 2)]
)
def test_a_rig_is_compared_with_its_own_line_or_the_one_that_is_named(monkeypatch, options, lines):
    asked = []

    def compare(data, line, pantograph, speed_kmh, spans, policy, seed):
        asked.append((data.name, line.name, pantograph.name, speed_kmh, spans, policy, seed))
        return data.name

    own = SimpleNamespace(kind="flexible", name="it")
    rigs = {"one": SimpleNamespace(kind="stiffness"), "two": own}
    monkeypatch.setattr("panto_env.cli.studies.REFERENCE", "re250")
    monkeypatch.setattr(
        "panto_env.rig.computer.load_rig", lambda name: SimpleNamespace(name=name, line=rigs[name])
    )
    load = lambda name: name if name is own else SimpleNamespace(name=name)  # noqa: E731
    monkeypatch.setattr("panto_env.catalog.load_catenary", load)
    monkeypatch.setattr("panto_env.rig.computer.compare", compare)
    monkeypatch.setattr("panto_env.rig.report.pair_facts", lambda pair: {"rig": pair})
    monkeypatch.setattr("panto_env.rig.report.pair_table", lambda pair: Table("", ("x",), ((pair,),)))
    monkeypatch.setattr("panto_env.rig.report.followed_sentence", lambda pair: f"It follows {pair}.")
    done = panto("rig", "one", "two", "--seed", 3, *options)
    assert done.returncode == 0
    rest = ("own-two-mass", 250.0, None, None, 3)
    assert asked == [("one", lines[0], *rest), ("two", lines[1], *rest)]
    assert done.stdout.startswith("own-two-mass at 250 km/h, policy passive\n")
    assert done.stdout.endswith("It follows one.\nIt follows two.\n")
    assert [row for row in cells(done.stdout) if row != ["x"]] == [["one"], ["two"]]
    assert json.loads(panto("rig", "one", "--json", *options).stdout) == [{"rig": "one"}]
