"""Every number of every schema has a range; what lies outside is refused by one sentence that names it."""

import math
import re
from pathlib import Path
from typing import get_args, get_origin

import numpy as np
import pytest
from pydantic import BaseModel

from panto_env import InputError, simulate
from panto_env.base.settings import Between, dotted, parse, ranges_of
from panto_env.catalog import available, load_catenary, load_pantograph
from panto_env.catalog.loader import parse_catenary, parse_pantograph
from panto_env.estimation.force import FORCE_MODELS, as_force_model
from panto_env.estimation.model import EstimatorSettings
from panto_env.plant.actuators import ACTUATORS, actuator_settings
from panto_env.plant.catenary import CATENARIES
from panto_env.plant.line_condition import LineCondition
from panto_env.plant.pantograph.schema import PantographData
from panto_env.plant.sensors import SENSORS, sensor_settings

ABSURD = (-1e9, 1e9, math.nan, "12", True)
LINES = {load_catenary(name).kind: load_catenary(name) for name in reversed(available("catenary"))}
"""A line of each kind, to change one value of."""
ALONE = {  # of settings that are not files: how they are read
    "line condition": ((LineCondition,), lambda value: parse(LineCondition, value, "line_condition")),
    "actuator": (ACTUATORS.values(), actuator_settings),
    "sensors": (SENSORS.values(), sensor_settings),
    "estimator": ((EstimatorSettings,), lambda value: parse(EstimatorSettings, value, "settings")),
    **{
        f"force model {name}": ((kind,), lambda value, name=name: as_force_model({"kind": name} | value))
        for name, kind in FORCE_MODELS.items()
    },
}


def places(annotation):
    """Where numbers stand in an annotation: () for a number, (0,) for those of a list, and so on."""
    if annotation in (int, float):
        yield ()
    elif get_origin(annotation) is tuple:
        for place, part in enumerate(part for part in get_args(annotation) if part is not ...):
            yield from ((place, *rest) for rest in places(part))
    elif not (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
        for part in get_args(annotation):
            if not isinstance(part, Between):
                yield from places(part)


def table_in(annotation):
    return annotation if isinstance(annotation, type) and issubclass(annotation, BaseModel) else None


def every_field(schema):
    for field in schema.model_fields.values():
        inner = table_in(field.rebuild_annotation())
        yield from [field] if inner is None else every_field(inner)


def numbers(schema, prefix=()):
    """The keys that lead to each field that holds numbers, the field's annotation, and places in it."""
    for key, field in schema.model_fields.items():
        annotation = field.rebuild_annotation()
        if table_in(annotation) is not None:
            yield from numbers(annotation, (*prefix, key))
        else:
            for place in places(annotation):
                yield (*prefix, key), annotation, place


def with_absurd(annotation, place, absurd):
    """A value of an annotation, all in the middle of its ranges but for one number in it."""
    if not place:
        return absurd
    parts = [part for part in get_args(strip(annotation)) if part is not ...]
    return [
        with_absurd(part, place[1:], absurd) if k == place[0] else middle(part)
        for k, part in enumerate(parts)
    ]


def strip(annotation):
    """The tuple within an annotation, or the annotation."""
    if get_origin(annotation) is tuple:
        return annotation
    return next(
        (strip(part) for part in get_args(annotation) if get_origin(strip(part)) is tuple), annotation
    )


def middle(annotation):
    if get_origin(strip(annotation)) is tuple:
        return [middle(part) for part in get_args(strip(annotation)) if part is not ...]
    (between,) = set(ranges_of(annotation))
    value = (between.low + between.high) / 2
    return int(value) if int in get_args(annotation) else value


def without_none(value):
    """A table as TOML has it."""
    if not isinstance(value, dict):
        return value
    return {key: without_none(each) for key, each in value.items() if each is not None}


def put(table, keys, value):
    key, *rest = keys
    return table | {key: put(table.get(key) or {}, rest, value) if rest else value}


def one_sentence(message, key):
    assert message.endswith(".")
    assert not re.search(r"[.?!]\s|\n", message), message
    assert re.search(rf"\b{re.escape(key)}\b", message), message


FILES = {
    "pantograph": (PantographData, load_pantograph("en50318-2002"), parse_pantograph),
    **{name: (kind.schema, LINES[name], parse_catenary) for name, kind in CATENARIES.items()},
}


@pytest.mark.parametrize("kind", FILES)
def test_an_absurd_number_of_a_file_is_refused(kind):
    """A new field without a range fails here."""
    schema, data, read = FILES[kind]
    entry = without_none(data.model_dump(exclude={"sources": True, "line": {"sources"}}))
    for keys, annotation, place in numbers(schema):
        for absurd in ABSURD:
            with pytest.raises(InputError) as caught:
                read(put(entry, keys, with_absurd(annotation, place, absurd)), Path("FILE"))
            one_sentence(str(caught.value), dotted((*keys, *place)))
            several = list(ranges_of(annotation))
            between = several[place[-1]] if len(set(several)) > 1 else several[0]  # of a height, of a force
            assert f"from {between.low:,g} to {between.high:,g}" in str(caught.value)


@pytest.mark.parametrize("family", ALONE)
def test_an_absurd_number_of_a_table_is_refused(family):
    schemas, read = ALONE[family]
    for schema in schemas:
        kind = {"kind": schema.model_fields["kind"].default} if "kind" in schema.model_fields else {}
        for keys, annotation, place in numbers(schema):
            for absurd in ABSURD:
                with pytest.raises(InputError, match=r"must be a (whole )?number from") as caught:
                    read(put(kind, keys, with_absurd(annotation, place, absurd)))
                one_sentence(str(caught.value), dotted((*keys, *place)))


def test_units_of_ranges_are_those_of_the_descriptions():
    schemas = [kind.schema for kind in CATENARIES.values()] + [PantographData, LineCondition]
    schemas += [*ACTUATORS.values(), *SENSORS.values(), EstimatorSettings, *FORCE_MODELS.values()]

    told = [
        (field.description, between)
        for schema in schemas
        for field in every_field(schema)
        for between in ranges_of(field.rebuild_annotation())
    ]
    assert len(told) > 40
    for description, between in told:
        assert between.low < between.high
        if between.unit:
            assert f"({between.unit})" in description


def test_any_kind_of_number_is_one_and_whole_ones_are_whole():
    wire = {"mass": np.float32(1.5), "tension": np.int64(20_000), "bending_stiffness": 0}
    entry = LINES["flexible"].model_dump() | {"contact_wire": wire, "spans": 12.0}
    line = type(LINES["flexible"]).model_validate(entry)
    assert (line.contact_wire.mass, line.contact_wire.tension, line.spans) == (1.5, 20_000.0, 12)
    assert type(line.spans) is int
    assert type(line.contact_wire.tension) is float


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"control_interval": math.nan}, "control_interval must be a number from 0.0001 to 10 s, not nan"),
        ({"control_interval": "0.01"}, "control_interval must be a number from 0.0001 to 10 s, not '0.01'"),
        ({"time_step": "0.002"}, "time_step must be a number from 1e-06 to 10 s, not '0.002'"),
        ({"speed_kmh": "300"}, r"speed_kmh must be a number or a range of two \(km/h\), not '300'"),
        ({"reward": {"effort": "0.1"}}, "key 'effort' must be a number"),
    ],
)
def test_text_and_nan_are_no_settings_of_a_run(settings, message):
    with pytest.raises(InputError, match=message):
        simulate(**settings)
