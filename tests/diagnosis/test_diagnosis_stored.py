"""What a diagnosis says of the same passes is as it was, and its words, worked out by hand.

python -m tests.diagnosis.test_diagnosis_stored   # writes stored.json anew
"""

import json
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from panto_env.catalog import load_catenary
from panto_env.diagnosis.diagnosis import Diagnosis, Finding, findings_table, judge, place, verdict
from panto_env.diagnosis.healthy import Healthy

from .test_diagnosis import made_up

STORED = Path(__file__).with_name("stored.json")


def of_made_up():
    """Passes with a bump beside a dropper and a dip at a support, and others without."""
    learned = Healthy.of(made_up(10, np.random.default_rng(1)))
    passes = made_up(2, np.random.default_rng(9))
    force = passes.force.copy()
    force[:, 1500:1512] += 25 * np.hanning(12)
    force[:, 3000:3020] -= 30 * np.hanning(20)
    return learned, judge(replace(passes, force=force), learned, 0.3)


def in_numbers(found):
    """A diagnosis as plain data; of its curves some values."""
    evidence = found.evidence
    curves = {name: getattr(evidence, name)[::97].tolist() for name in ("position", "residual", "score")}
    facts = {
        name: getattr(found, name) for name in ("changed", "level", "begin", "end", "false_alarms", "notes")
    }
    facts |= {"threshold": evidence.threshold, "quiet": evidence.level, **curves}
    return json.loads(json.dumps(facts | {"findings": [asdict(each) for each in found.findings]}))


def results():
    learned, found = of_made_up()
    known = {name: getattr(learned, name) for name in ("white", "lead", "window")}
    known |= {"levels": learned.levels.tolist(), "predictor": learned.predictor.tolist()}
    known |= {name: getattr(learned, name)[::97].tolist() for name in ("mean", "size")}
    known["scores"] = learned.scores[:, ::97].mean(axis=0).tolist()
    return {"learned": known, "made up": in_numbers(found)}


def flat(value, name=""):
    """Numbers and words by name."""
    if isinstance(value, dict | list):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from flat(item, f"{name}.{key}")
    else:
        yield name, value


def test_the_same_passes_get_the_same_answer():
    now, then = dict(flat(results())), dict(flat(json.loads(STORED.read_text())))
    assert now.keys() == then.keys()
    for name, value in then.items():
        if isinstance(value, float):
            assert now[name] == pytest.approx(value, rel=1e-2, abs=1e-2), name
        else:
            assert now[name] == value, name


SHARES = {"broken dropper": 0.7, "hard spot": 0.26, "worn wire": 0.04}
FOUND = Finding("broken dropper", SHARES, 731.25, 13, 11.25, 3, 2, 1.84)
HALF = replace(FOUND, kind="hard spot", position=720.5, offset=0.5, interval=1, dropper=None)
AT_MAST = replace(HALF, position=720.0, offset=0.0)


def test_a_place_is_a_dropper_or_a_support_or_an_interval():
    assert [place(each) for each in (FOUND, HALF, AT_MAST)] == ["dropper 2", "interval 1", "support 12"]


def test_a_table_has_the_most_likely_kind_and_the_next_one():
    evidence = SimpleNamespace(alignment=load_catenary("en50318-2002").alignment())
    (first, second) = findings_table(replace(made((FOUND, HALF), False), evidence=evidence)).rows
    assert first == ("broken dropper", "70", "hard spot (26)", "dropper 2", "13", "11.2", "731", "1.8")
    assert second == ("hard spot", "26", "broken dropper (70)", "interval 1", "13", "0.5", "720", "1.8")


def made(findings, changed):
    return Diagnosis(findings, changed, 2.34, None, 540.0, 2540.0, 0.1, ())


@pytest.mark.parametrize(("count", "changed"), list(product((0, 1, 2), (False, True))))
def test_a_verdict_says_what_was_found_where_and_what_chance_would_find(count, changed):
    found = made((FOUND, HALF)[:count], changed)
    whole = "The whole line differs from its healthy state, 2.3 times as much as healthy passes do from one"
    where = [
        ["Healthy from 540 to 2540 m."],
        ["1 defect from 540 to 2540 m."],
        ["2 defects from 540 to 2540 m."],
    ]
    *said, last = verdict(found)
    assert last == "A healthy line would show 0.2 false ones along this way."
    assert [each for each in said if not each.startswith(whole)] == where[count] * (count > 0 or not changed)
    assert any(each.startswith(whole) for each in said) == changed
    assert found.healthy == (count == 0 and not changed)


@pytest.mark.parametrize("above", [1.9, 2.1])
def test_the_whole_line_has_changed_from_twice_the_level_on(above):
    """Of healthy passes that hardly differ from one another."""
    learned, passes = Healthy.of(made_up(10, np.random.default_rng(1))), made_up(1, np.random.default_rng(6))
    levels = np.log(learned.score(passes, 1.0)[1])
    healthy = np.exp(1e-3 * np.array([-1.0, 1.0] * 5) + levels - np.log(above))
    assert judge(passes, replace(learned, levels=healthy)).changed == (above > 2)


if __name__ == "__main__":
    STORED.write_text(json.dumps(results(), indent=1) + "\n")
