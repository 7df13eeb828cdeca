"""Costs of controllers whose instructions, stack and memory can be counted by hand or by another way."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("unicorn")
if shutil.which("arm-none-eabi-gcc") is None and "CI" not in os.environ:
    pytest.skip("no arm-none-eabi-gcc; CI has one", allow_module_level=True)

from panto_agents.onboard import Exported, Variable
from panto_agents.onboard.cost import cost, drawn
from panto_env import InputError

HEADER = """\
#include <math.h>
typedef struct { double sum[32]; } model_state;
typedef struct { double contact_force; double place; } model_readings;
void model_init(model_state *s);
void model_step(model_state *s, const model_readings *r, double *force);
"""
START = '#include "model.h"\nvoid model_init(model_state *s) { s->sum[0] = 0.0; }\n'
STEP = "void model_step(model_state *s, const model_readings *r, double *force)"


def model(body, before=""):
    """A controller whose step has a body."""
    return Exported(
        name="model",
        source=f"{START}{before}\n{STEP} {{ {body} }}\n",
        header=HEADER,
        inputs=(Variable("contact_force", "N", "Contact force"), Variable("place", "spans", "Place")),
        outputs=(Variable("force", "N", "Force"),),
        interval=0.01,
        card="",
        constants={},
        state={},
    )


def nops(count):
    return f'__asm__ volatile (".rept {count}\\n nop\\n .endr"); force[0] = 0.0;'


@pytest.mark.longer
@pytest.mark.parametrize("processor", ["cortex-m4", "cortex-m7"])
def test_instructions_are_counted_one_by_one(processor):
    few, many = (cost(model(nops(count)), processor, steps=3) for count in (10, 210))
    assert many.worst - few.worst == 200
    assert many.worst == many.mean
    assert many.program - few.program == 400  # a nop has two bytes
    wide = cost(
        model('__asm__ volatile (".rept 200\\n nop.w\\n .endr"); force[0] = 0.0;'), processor, steps=3
    )
    assert wide.worst == cost(model(nops(200)), processor, steps=3).worst


def test_instructions_that_a_condition_skips_count():
    body = '__asm__ volatile ("cmp r0, r0\\n ittt {}\\n nop{}\\n nop{}\\n nop{}" ::: "cc"); force[0] = 0.0;'
    taken, skipped = (cost(model(body.format(*[which] * 4)), steps=2).worst for which in ("eq", "ne"))
    assert taken == skipped


def test_the_costliest_step_is_found_among_many():
    """Only a force above 250 N, about one reading in seventy, or nonsense takes the long way."""
    loop = "double sum = 0.0; int n = r->contact_force > 250.0 ? 1000 : 1; for (int k = 0; k < n; ++k) "
    body = loop + '{ __asm__ volatile ("nop"); sum += 1.0; } force[0] = sum;'
    found = cost(model(body), steps=100)
    assert found.worst > 4000
    assert found.worst > 3 * found.mean
    assert found.share == found.worst / 1e6


def test_double_precision_costs_more_without_hardware_for_it():
    body = "s->sum[1] = 0.9 * s->sum[1] + r->contact_force; force[0] = exp(-fabs(s->sum[1]) / 1e3);"
    small, large = (cost(model(body), processor, steps=20) for processor in ("cortex-m4", "cortex-m7"))
    assert small.worst > 5 * large.worst
    assert small.program > large.program


def test_memory_and_stack_are_those_of_the_program():
    before = "__attribute__((noinline)) static double deep(volatile double *x) { volatile double y[100]; "
    before += "for (int k = 0; k < 100; ++k) y[k] = x[k % 2]; return y[7]; }"
    body = "volatile double x[2] = {r->place, 1.0}; force[0] = deep(x);"
    found = cost(model(body, before), steps=2)
    assert found.state == 256
    assert 816 <= found.stack <= 816 + 64  # two arrays, and registers that are saved
    table = "static const double table[500] = {1.0, 2.0};"
    extra = cost(model(body + " force[0] += table[(int)(fabs(r->place)) % 500];", before + table), steps=2)
    assert 4000 <= extra.program - found.program <= 4400


def test_too_deep_a_stack_is_refused():
    before = "__attribute__((noinline)) static double deep(volatile double *x) { volatile double y[10000]; "
    before += "for (int k = 0; k < 10000; ++k) y[k] = x[k % 2]; return y[7]; }"
    body = "volatile double x[2] = {r->place, 1.0}; force[0] = deep(x);"
    with pytest.raises(InputError, match="more than 65536 bytes of stack"):
        cost(model(body, before), steps=1)


def test_readings_are_those_of_a_line_and_then_in_part_nonsense():
    readings = np.array(list(drawn(model(""), 2000, 0)))
    line, faulty = readings[:1000], readings[1000:]
    np.testing.assert_allclose(np.diff(line[:, 1]), 0.0128)
    assert line[:, 0].mean() == pytest.approx(120.0, abs=10.0)
    strange = ~np.isfinite(faulty) | (np.abs(faulty) > 1e3) | (np.abs(faulty) < 1e-300)
    assert 0.4 < (~strange.any(axis=1)).mean() < 0.6
    assert 0.3 < strange.all(axis=1).mean() < 0.5
    assert np.isnan(faulty).any(axis=0).all()
    np.testing.assert_array_equal(readings, list(drawn(model(""), 2000, 0)))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"processor": "cortex-m3"}, "did you mean 'cortex-m7'.*known are cortex-m4, cortex-m7"),
        ({"exported": replace(model("nonsense"))}, "arm-none-eabi-gcc failed on the controller: .*error"),
    ],
)
def test_bad_input_is_one_sentence(given, words):
    with pytest.raises(InputError, match=words):
        cost(**{"exported": model("force[0] = 0.0;")} | given)


def test_a_machine_without_the_compiler_is_told_so(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="install gcc-arm-none-eabi and libnewlib-arm-none-eabi"):
        cost(model("force[0] = 0.0;"))
