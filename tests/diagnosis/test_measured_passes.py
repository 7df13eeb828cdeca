"""Records held against the line of a fit: one as it was is healthy, a broken dropper is found."""

import json
from dataclasses import replace

import numpy as np
import pytest

from panto_env import simulate
from panto_env.base.errors import InputError
from panto_env.catalog import load_catenary, load_pantograph
from panto_env.diagnosis import diagnose_records
from panto_env.diagnosis.measured_passes import HEALTHY, measured_passes
from panto_env.fitting import problem as preparing
from panto_env.fitting.misfit import OWN
from panto_env.fitting.passes import BANDS
from panto_env.fitting.stored import GOES_ON, Stored, store
from panto_env.plant.numerics import Numerics
from panto_env.records.measured import measured
from panto_env.records.record_file import write_record

from ..command import panto

LINE, PANTOGRAPH, SPANS = "en50318-2002", "dsa380", 15


@pytest.fixture(scope="module", autouse=True)
def coarse():
    """Healthy passes are computed with accuracy="fast", as these tests' records are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(preparing, "NUMERICS", Numerics(accuracy="fast"))
        yield


def record_of(condition, speed=250.0, seed=0, position_error=0.3):
    run = simulate(
        LINE, PANTOGRAPH, speed, spans=2 * SPANS, distance=60.0 * SPANS, accuracy="fast",
        line_condition=condition, record_droppers=False,
    )  # fmt: skip
    return measured(run, seed=seed, position_error=position_error, name=f"{speed:g} km/h")


@pytest.fixture(scope="module")
def healthy_record():
    return record_of({"dropper_scatter": 0.0}, seed=1)


@pytest.fixture(scope="module")
def known(healthy_record, coarse):
    """A fit that knows droppers to a tenth of a millimetre, and that the line is as designed."""
    line, pantograph = load_catenary(LINE), load_pantograph(PANTOGRAPH)
    values = preparing.problem([healthy_record], line, pantograph, free=("droppers",)).values.all
    return Stored(
        "earlier", line.model_dump_json(), pantograph.model_dump_json(), values, np.zeros(len(values)),
        1e-8 * np.eye(len(values)), (540.0, 880.0), np.full(BANDS, 0.6), (),
    )  # fmt: skip


@pytest.mark.longer
def test_healthy_passes_surround_a_healthy_record(healthy_record, known, monkeypatch):
    """Where sensors have neither gain nor zero, as this record's."""
    monkeypatch.setitem(OWN, "gain", 0.0)
    monkeypatch.setitem(OWN, "zero", 0.0)
    own, healthy, _ = measured_passes([healthy_record], known)
    assert healthy.force.shape == (HEALTHY, own.force.shape[1])
    assert own.first == 9
    assert own.position[0] == pytest.approx(540.0)
    spread = healthy.force.std(axis=0, ddof=1)
    away = (own.force[0] - healthy.force.mean(axis=0)) / spread
    assert 0.6 < np.sqrt(np.mean(away**2)) < 1.6
    assert 0.3 < spread.mean() < 3.0  # noise of 0.6 N a coefficient, and what the fit does not know


@pytest.mark.longer
def test_a_healthy_record_is_healthy_and_a_broken_dropper_is_found(healthy_record, known):
    assert diagnose_records([healthy_record], known).healthy
    broken = record_of({"broken_droppers": ((12, 4),)}, seed=2, position_error=-0.4)
    (finding,) = diagnose_records([broken], known).findings
    assert (finding.kind, finding.span, finding.dropper) == ("broken dropper", 12, 4)


@pytest.mark.longer
def test_lost_tension_is_a_changed_line(known):
    assert diagnose_records([record_of({"lost_contact_tension": 0.03}, seed=3)], known).changed


@pytest.mark.longer
def test_sensors_with_a_gain_and_a_zero_make_no_line_unhealthy(healthy_record, known):
    (piece,) = healthy_record.pieces
    record = replace(healthy_record, pieces=(replace(piece, force=0.97 * piece.force + 5.0),))
    assert diagnose_records([record], known).healthy


@pytest.mark.longer
def test_a_record_with_a_gap_is_judged_by_its_longest_piece_and_says_so(healthy_record, known):
    (piece,) = healthy_record.pieces
    ends = piece.position < 610.0, piece.position > 630.0
    pieces = tuple(replace(piece, position=piece.position[at], force=piece.force[at]) for at in ends)
    own, _, notes = measured_passes([replace(healthy_record, pieces=pieces)], known)
    assert own.position[0] == pytest.approx(660.0)
    assert "250 km/h has 2 pieces, and a diagnosis takes one of each record: that from 630 to 900 m." in notes


@pytest.mark.longer
def test_what_is_left_out_and_what_a_record_says_is_among_the_notes(healthy_record, known):
    (piece,) = healthy_record.pieces
    short = replace(piece, position=piece.position[:3000], force=piece.force[:3000], run="May")
    given = [replace(healthy_record, notes=("Said.",)), replace(healthy_record, name="b", pieces=(short,))]
    found = diagnose_records(given, known)
    assert found.notes[0] == "250 km/h: Said."
    assert found.notes[1].startswith("b (run 'May') is left out: It has only")
    assert (GOES_ON in found.notes) is bool(found.findings)


@pytest.mark.longer
def test_what_cannot_be_judged_is_refused(healthy_record, known):
    with pytest.raises(InputError, match=r"at 220 and 250 km/h cannot be judged together"):
        measured_passes([healthy_record, record_of({}, speed=220.0)], known)
    with pytest.raises(InputError, match=r"share 19 m .* takes two whole spans"):
        measured_passes([healthy_record], replace(known, compared=(860.0, 900.0)))
    with pytest.raises(InputError, match="none that this version knows; fit the records anew"):
        measured_passes([healthy_record], replace(known, line='{"kind": "flexible"}'))


@pytest.mark.longer
def test_the_command(known, tmp_path):
    record = record_of({"broken_droppers": ((12, 4),)}, seed=2)
    write_record(record, tmp_path / "later.csv")
    store(replace(known, notes=("The fit to earlier has not settled.",)), tmp_path / "earlier.safetensors")
    asked = ("--fit", "earlier.safetensors", "--plot", "found.png", "--json")
    done = panto("diagnose", "later.csv", *asked, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert any("has not settled" in note for note in told["notes"])
    assert GOES_ON in told["notes"]
    assert [finding["kind"] for finding in told["findings"]] == ["broken dropper"]
    assert (tmp_path / "found.png").read_bytes().startswith(b"\x89PNG")
    for words, sentence in (
        ((), "Give either the healthy runs"),
        (("--fit", "earlier.safetensors", "--healthy", "later.csv"), "Give either the healthy runs"),
        (("--fit", "earlier.safetensors", "--pantograph", "dsa380"), "leave out --pantograph"),
        (("--healthy", "a.parquet", "--unit", "force=kN"), "are of records, which are diagnosed with --fit"),
        (("--fit", "later.csv"), "does not hold a whole fit"),
    ):
        refused = panto("diagnose", "later.csv", *words, cwd=tmp_path)
        assert refused.returncode == 2
        assert sentence in " ".join(refused.stderr.split())
