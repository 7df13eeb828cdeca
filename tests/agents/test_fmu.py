"""Units of FMI 2.0 and 3.0, as FMPy validates and runs them, beside the controller's C alone."""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("fmpy")
if shutil.which("cc") is None and "CI" not in os.environ:
    pytest.skip("no C compiler; CI has one", allow_module_level=True)

import fmpy
import fmpy.fmi2
import fmpy.fmi3
from fmpy.validation import validate_fmu

from panto_agents.onboard import Exported, Variable, write_fmu
from panto_env import InputError

VERSIONS = ["2.0", "3.0"]
STATES = {
    "2.0": ("getFMUstate", "setFMUstate", "serializeFMUstate", "deSerializeFMUstate"),
    "3.0": ("getFMUState", "setFMUState", "serializeFMUState", "deserializeFMUState"),
}
"""FMPy's calls that keep a state, put it back, and turn it into bytes and back."""
INTERVAL = 0.01  # s
HEADER = """\
#ifndef LEAD_H
#define LEAD_H
typedef struct { double before; int first; } lead_state;
typedef struct { double contact_force; double frame_velocity; double place; } lead_readings;
void lead_init(lead_state *s);
void lead_step(lead_state *s, const lead_readings *r, double *force);
#endif
"""
SOURCE = """\
#include "lead.h"
#include <math.h>
void lead_init(lead_state *s) { s->before = 0.0; s->first = 1; }
void lead_step(lead_state *s, const lead_readings *r, double *force) {
    double change = s->first ? 0.0 : r->contact_force - s->before;
    s->before = r->contact_force;
    s->first = 0;
    force[0] = 100.0 * tanh((-0.3 * (r->contact_force - 120.0) - 0.1 * change) / 100.0);
    force[1] = fmin(fmax(-200.0 * r->frame_velocity, -50.0), 50.0) * cos(r->place);
}
"""
LEAD = Exported(
    name="lead",
    source=SOURCE,
    header=HEADER,
    inputs=(
        Variable("contact_force", "N", "Contact force"),
        Variable("frame_velocity", "m/s", "Velocity of the frame, upwards"),
        Variable("place", "spans", "Place along the line"),
    ),
    outputs=(Variable("force_frame", "N", "Force on the frame"), Variable("force_head", "N", "On the head")),
    interval=INTERVAL,
    card="A proportional controller with a lead, <for> tests & nothing else.",
    constants={},
    state={},
)


@pytest.fixture(scope="module", params=VERSIONS)
def unit(request, tmp_path_factory):
    """A unit's version and file."""
    path = tmp_path_factory.mktemp("units") / "lead.fmu"
    write_fmu(LEAD, path, version=request.param)
    return request.param, path


@pytest.fixture(scope="module")
def forces(tmp_path_factory):
    """Forces, (steps, 2), of the controller's C alone for readings, (steps, 3)."""
    folder = tmp_path_factory.mktemp("alone")
    (folder / "lead.c").write_text(SOURCE)
    (folder / "lead.h").write_text(HEADER)
    library = folder / "lead.so"
    subprocess.run(["cc", "-O2", "-fPIC", "-shared", "-o", library, folder / "lead.c", "-lm"], check=True)
    alone = ctypes.CDLL(str(library))

    def of(readings):
        state, force = (ctypes.c_double * 8)(), (ctypes.c_double * 2)()
        alone.lead_init(state)
        found = []
        for each in readings:
            alone.lead_step(state, (ctypes.c_double * 3)(*each), force)
            found.append(list(force))
        return np.array(found)

    return of


def begin(instance):
    """Bring an instance to its first step."""
    if isinstance(instance, fmpy.fmi2.FMU2Slave):
        instance.setupExperiment(startTime=0.0)
    instance.enterInitializationMode()
    instance.exitInitializationMode()


@pytest.fixture
def instance(unit, tmp_path):
    """An instance that waits for its first step, and its log."""
    version, path = unit
    fmpy.extract(path, unzipdir=tmp_path)
    description = fmpy.read_model_description(path)
    kind = fmpy.fmi2.FMU2Slave if version == "2.0" else fmpy.fmi3.FMU3Slave
    made = kind(guid=description.guid, unzipDirectory=str(tmp_path), modelIdentifier="lead", instanceName="x")
    made.log = []
    if version == "2.0":
        callbacks = fmpy.fmi2.fmi2CallbackFunctions()
        logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(lambda *given: made.log.append(given[4].decode()))
        callbacks.logger = logger
        made.instantiate(callbacks=callbacks)
        made.put, made.read = made.setReal, made.getReal
    else:
        made.instantiate(logMessage=lambda *given: made.log.append(given[3].decode()))
        made.put, made.read = made.setFloat64, made.getFloat64
    begin(made)
    yield made
    made.freeInstance()


def drawn(steps, seed=0):
    """Readings, (steps, 3)."""
    random = np.random.default_rng(seed)
    return random.normal((120.0, 0.0, 5.0), (30.0, 0.2, 3.0), (steps, 3))


def run(instance, readings, first=0):
    """Forces of an instance, (steps, 2)."""
    found = []
    for k, each in enumerate(readings, start=first):
        instance.put([1, 2, 3], list(each))
        instance.doStep(k * INTERVAL, INTERVAL)
        found.append(instance.read([4, 5]))
    return np.array(found)


@pytest.mark.longer
def test_it_is_valid_and_says_what_it_is(unit, tmp_path):
    version, path = unit
    assert validate_fmu(str(path)) == []
    description = fmpy.read_model_description(path)
    assert description.fmiVersion == version
    assert not description.coSimulation.canHandleVariableCommunicationStepSize
    assert float(description.defaultExperiment.stepSize) == INTERVAL
    told = [(each.name, each.unit, each.description) for each in description.modelVariables]
    expected = [(each.name, each.unit, each.description) for each in (*LEAD.inputs, *LEAD.outputs)]
    assert told[len(told) - len(expected) :] == expected
    with zipfile.ZipFile(path) as archive:
        assert "&lt;for&gt; tests &amp;" in archive.read("documentation/index.html").decode()
    # The same controller makes the same archive, another one another token.
    write_fmu(LEAD, tmp_path / "again.fmu", version=version)
    assert (tmp_path / "again.fmu").read_bytes() == path.read_bytes()
    write_fmu(replace(LEAD, interval=0.02), tmp_path / "other.fmu", version=version, binary=False)
    tokens = {fmpy.read_model_description(each).guid for each in (path, tmp_path / "other.fmu")}
    assert len(tokens) == 2


def test_fmpy_runs_it_with_the_forces_of_the_c_alone(unit, forces):
    """FMPy sets the inputs of a time, does the step, and records the outputs at its end."""
    _, path = unit
    readings = drawn(100)
    columns = [(name, float) for name in ("time", *(each.name for each in LEAD.inputs))]
    given = np.array([(INTERVAL * k, *each) for k, each in enumerate(readings)], dtype=columns)
    steps = {"stop_time": 0.99, "step_size": INTERVAL, "output_interval": INTERVAL}
    result = fmpy.simulate_fmu(str(path), **steps, input=given)
    found = np.column_stack([result["force_frame"], result["force_head"]])
    np.testing.assert_array_equal(found[0], 0.0)
    np.testing.assert_array_equal(found[1:], forces(readings)[: len(found) - 1])


def test_a_second_tool_runs_it_too(forces, tmp_path):
    """DNV's libcosim, in C++, which takes units of FMI 2.0 only; its steps are counted in nanoseconds."""
    pytest.importorskip("libcosimpy")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.ERROR)
    write_fmu(LEAD, tmp_path / "lead.fmu", version="2.0")
    execution = CosimExecution.from_step_size(round(1e9 * INTERVAL))
    slave = execution.add_local_slave(CosimLocalSlave(str(tmp_path / "lead.fmu"), "lead"))
    sets, sees = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(sets)
    execution.add_observer(sees)
    readings, found = drawn(100), []
    for each in readings:
        sets.slave_real_values(slave, [1, 2, 3], list(each))
        assert execution.step()
        found.append(list(sees.last_real_values(slave, [4, 5])))
    np.testing.assert_array_equal(found, forces(readings))


def test_its_state_is_reset_kept_put_back_and_stored_as_bytes(instance, forces):
    readings = drawn(60)
    expected = forces(readings)
    np.testing.assert_array_equal(run(instance, readings), expected)
    instance.reset()
    begin(instance)
    names = STATES["2.0" if isinstance(instance, fmpy.fmi2.FMU2Slave) else "3.0"]
    kept, put_back, to_bytes, from_bytes = (getattr(instance, name) for name in names)
    run(instance, readings[:20])
    state = kept()
    stored = to_bytes(state)
    np.testing.assert_array_equal(run(instance, readings[20:], 20), expected[20:])
    put_back(state)
    np.testing.assert_array_equal(run(instance, readings[20:40], 20), expected[20:40])
    put_back(from_bytes(stored))
    np.testing.assert_array_equal(run(instance, readings[20:], 20), expected[20:])


def test_several_intervals_in_one_step_hold_the_inputs(instance, forces):
    (one,) = drawn(1)
    instance.put([1, 2, 3], list(one))
    instance.doStep(0.0, 4 * INTERVAL)
    np.testing.assert_array_equal(instance.read([4, 5]), forces([one] * 4)[-1])
    assert instance.read([0]) == [pytest.approx(4 * INTERVAL)]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda unit: unit.doStep(0.0, 0.5 * INTERVAL), "0.005 s is not a whole number of intervals"),
        (lambda unit: unit.doStep(0.0, 1.5 * INTERVAL), "0.015 s is not a whole number of intervals"),
        (lambda unit: unit.doStep(0.0, float("nan")), "nan s is not a whole number of intervals"),
        (lambda unit: unit.doStep(0.5, INTERVAL), "begins at 0.5 s, the controller is at 0 s"),
        (lambda unit: unit.put([1, 4], [0.0, 0.0]), "no input has the value reference 4"),
        (lambda unit: unit.read([6]), "no variable has the value reference 6"),
        (lambda unit: unit.getString([1]), "there is no fmi.GetString"),
        (lambda unit: unit.enterInitializationMode(), "fmi.EnterInitializationMode is not allowed"),
    ],
)
def test_what_it_cannot_do_is_an_error_with_the_reason(instance, call, words):
    with pytest.raises(Exception, match="failed with status 3"):
        call(instance)
    (said,) = instance.log
    assert re.search(words, said)
    assert run(instance, drawn(1)).shape == (1, 2)  # and it goes on


def test_another_token_is_refused(unit, tmp_path):
    version, path = unit
    fmpy.extract(path, unzipdir=tmp_path)
    kind = fmpy.fmi2.FMU2Slave if version == "2.0" else fmpy.fmi3.FMU3Slave
    other = kind(guid="{other}", unzipDirectory=str(tmp_path), modelIdentifier="lead", instanceName="first")
    with pytest.raises(Exception, match="instantiate"):
        other.instantiate()


@pytest.mark.parametrize("version", VERSIONS)
def test_the_wrapper_has_the_signatures_and_functions_of_the_standard(version, tmp_path):
    """FMPy brings the standard's headers: compiled with these, another signature is an error."""
    path = tmp_path / "lead.fmu"
    write_fmu(LEAD, path, version=version, binary=False)
    with zipfile.ZipFile(path) as archive:
        assert not any(name.startswith("binaries") for name in archive.namelist())
        archive.extractall(tmp_path)
    fmi, headers = f"fmi{version[0]}", Path(fmpy.__file__).parent / "c-code"
    strict = ["cc", "-std=c99", "-Wall", "-Wextra", "-Wno-unused-parameter", "-Werror", "-fsyntax-only"]
    sources = tmp_path / "sources"
    subprocess.run([*strict, f"{fmi}.c"], cwd=sources, check=True)
    (sources / f"{fmi}.h").write_text(f'#include "{fmi}Functions.h"\n')
    subprocess.run([*strict, f"-I{headers}", f"{fmi}.c"], cwd=sources, check=True)


def test_what_cannot_be_made_is_refused_and_leaves_no_file(monkeypatch, tmp_path):
    path = tmp_path / "lead.fmu"
    with pytest.raises(InputError, match=r"FMI 2\.0 and 3\.0, not 1\.0"):
        write_fmu(LEAD, path, version="1.0")
    with pytest.raises(InputError, match=r"could not make the unit's library: .*error: "):
        write_fmu(replace(LEAD, source="nonsense"), path)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"needs a C compiler, cc or gcc, and there is none"):
        write_fmu(LEAD, path)
    assert not list(tmp_path.iterdir())
    write_fmu(LEAD, path, binary=False)
    assert validate_fmu(str(path)) == []
