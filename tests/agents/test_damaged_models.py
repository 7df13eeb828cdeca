"""Model files that are damaged, or made to do harm: refused in one sentence, without time or memory."""

import json
import struct
import time
import tracemalloc

import numpy as np
import pytest

from panto_agents.model_file import read_model
from panto_agents.policy import load
from panto_agents.stored import FOLDER
from panto_env import InputError
from panto_env.base.checksums import CHECKSUM, KEY, checksum, read_arrays, with_checksum, write_arrays
from panto_env.policies import find_policy

MODEL = FOLDER / "head.safetensors"
FACTS, ARRAYS = read_arrays(MODEL)
LAST = len(ARRAYS) // 2 - 1
TYPES = {"<f4": "F32", "<f8": "F64"}


def safetensors(text, arrays, header=None):
    """A file with any text of facts, and any header of arrays, (type, shape) by name."""
    data = b"".join(array.tobytes() for array in arrays.values())
    table, begin = {"__metadata__": {KEY: text}}, 0
    for name, array in arrays.items():
        kind, shape = (header or {}).get(name, (TYPES.get(array.dtype.str), list(array.shape)))
        table[name] = {"dtype": kind, "shape": shape, "data_offsets": [begin, begin + array.nbytes]}
        begin += array.nbytes
    text = json.dumps(table).encode()
    return struct.pack("<Q", len(text)) + text + data


def changed(**arrays):
    """Other layers, and the checksum that fits them; None: without that one."""
    named = {f"actor/{name}": array for name, array in arrays.items()}
    return FACTS, {name: each for name, each in (ARRAYS | named).items() if each is not None}


def facts(**values):
    """Other facts, and the checksum that fits them."""
    return {key: each for key, each in (FACTS | values).items() if each != "gone"}, ARRAYS


def needs(**values):
    return facts(needs=FACTS["needs"] | values)


def header(kind, shape):
    """A header that says something else of a layer; no checksum can fit it."""
    return safetensors(json.dumps(with_checksum(FACTS, ARRAYS)), ARRAYS, {"actor/weight_0": (kind, shape)})


def text(facts):
    """Facts as any text."""
    return safetensors(facts, ARRAYS)


def with_nan(name):
    array = ARRAYS[f"actor/{name}"].copy()
    array.flat[0] = np.nan
    return changed(**{name: array})


W, B = ARRAYS["actor/weight_0"], ARRAYS["actor/bias_0"]
WHOLE = MODEL.read_bytes()
DEEP = "[" * 100_000 + "]" * 100_000
JSON = json.dumps(FACTS)
CRAFTED = {
    "no facts": safetensors("{}", ARRAYS),
    "no network": (FACTS, {}),
    "facts that are no JSON": text("{"),
    "facts that are a list": text("[]"),
    "facts that are null": text("null"),
    "facts nested without end": text(DEEP),
    "facts nested within": text(JSON[:-1] + f', "more": {DEEP}}}'),
    "facts with a number of a million digits": text(JSON[:-1] + ', "x": ' + "9" * 10**5 + "}"),
    "facts without a checksum": text(JSON),
    "facts with another checksum": text(json.dumps({CHECKSUM: checksum({})} | FACTS)),
    "facts with a checksum that is a list": text(json.dumps({CHECKSUM: []} | FACTS)),
    "more facts than the checksum covers": text(json.dumps(with_checksum(FACTS, ARRAYS) | {"more": 1})),
    "an array that the checksum does not name": safetensors(
        json.dumps(with_checksum(FACTS, ARRAYS)), ARRAYS | {"more": B}
    ),
    "an array less than the checksum names": safetensors(
        json.dumps(with_checksum(FACTS, ARRAYS | {"more": B})), ARRAYS
    ),
    "another format": facts(format=3),
    "a key too many": facts(extra=1),
    "a key too few": facts(needs="gone"),
    "an unknown activation": facts(activation="exp"),
    "steps that are text": facts(steps="many"),
    "needs that are a list": facts(needs=[]),
    "entries that are no triples": needs(entries=["force"]),
    "entries that are infinite": needs(entries=[["x", 0.0, float("inf")]] * len(FACTS["needs"]["entries"])),
    "other entries than the network": needs(entries=FACTS["needs"]["entries"][1:]),
    "channels that no actuator has": needs(channels=[5]),
    "more channels than the network": needs(channels=[0, 1]),
    "no channels": needs(channels=[]),
    "a share that is no number": facts(residual_share=float("nan")),
    "a washout of something else": facts(washout={"colour": 1}),
    "no bias in a layer": changed(bias_0=None),
    "no weight in a layer": changed(weight_0=None),
    "no last layer's bias": changed(**{f"bias_{LAST}": None}),
    "a layer too many": changed(weight_7=W, bias_7=B),
    "layers by other names": (FACTS, {f"actor/layer_{k}": each for k, each in enumerate(ARRAYS.values())}),
    "layers that do not fit": changed(weight_1=np.zeros((3, 3), np.float32), bias_1=np.zeros(3, np.float32)),
    "a weight turned": changed(weight_0=np.ascontiguousarray(W.T)),
    "a bias of another length": changed(bias_0=B[:-1]),
    "a bias that is a matrix": changed(bias_0=B[:, None]),
    "a weight that is one number": changed(weight_0=np.array(1.0, np.float32)),
    "a weight of three axes": changed(weight_0=W[None]),
    "weights that are complex": changed(weight_0=W.astype(np.complex64)),
    "weights that are whole numbers": changed(weight_0=np.ones(W.shape, np.int64)),
    "weights that are truth values": changed(weight_0=np.ones(W.shape, bool)),
    "weights that are not a number": with_nan("weight_0"),
    "biases that are not a number": with_nan(f"bias_{LAST}"),
    "weights of another type": header("I32", W.shape),
    "weights of a type that NumPy has not": header("BF16", (*W.shape, 2)),
    "weights of eight bits": header("F8_E4M3", (*W.shape, 4)),
    "weights of a type that nobody has": header("pickle", W.shape),
    "weights of no type": header(None, W.shape),
    "a shape turned": header("F32", W.shape[::-1]),
    "a shape that is negative": header("F32", (-1, 5)),
    "a shape that is text": header("F32", "many"),
    "a shape that says more than there is": header("F32", (1_000_000, 1_000_000)),
    "a shape that says more than any machine has": header("F32", (2**40, 2**40)),
    "a shape that says less than there is": header("F32", (1, 1)),
    "a header that is empty": struct.pack("<Q", 0),
    "a header that is longer than the file": struct.pack("<Q", 10**6) + b"{}",
    "a header that is longer than any file": struct.pack("<Q", 2**62) + b"{}",
    "a header that is code": struct.pack("<Q", 30) + b"__import__('os').system('true')",
    "a header nested without end": struct.pack("<Q", len(DEEP)) + DEEP.encode(),
    "a header cut off": WHOLE[:100],
    "a network cut off": WHOLE[: len(WHOLE) // 2],
    "a network with more behind it": WHOLE + bytes(100),
    "nothing": b"",
    "zeros": bytes(10**6),
    "a zip": b"PK\x03\x04" * 100,
}


def crafted(content, path):
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        write_arrays(path, *content)
    return path


def test_there_are_many():
    assert len(CRAFTED) >= 60


def test_what_they_are_made_of_is_whole(tmp_path):
    for k, whole in enumerate(((FACTS, ARRAYS), text(json.dumps(with_checksum(FACTS, ARRAYS))))):
        found, _ = read_model(crafted(whole, tmp_path / f"{k}.safetensors"))
        assert found.seed == FACTS["seed"]


@pytest.mark.parametrize("name", CRAFTED)
def test_a_crafted_model_is_refused_in_one_sentence(name, tmp_path):
    path = crafted(CRAFTED[name], tmp_path / "crafted.safetensors")
    begin = time.perf_counter()
    tracemalloc.start()
    try:
        with pytest.raises(
            InputError, match=r"crafted\.safetensors is not a whole model file \(.+\); take another"
        ) as caught:
            find_policy(str(path))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600
    assert peak < 60e6
    assert time.perf_counter() - begin < 5


def test_a_model_that_is_added_to_itself_is_refused(tmp_path):
    path = tmp_path / "itself.safetensors"
    crafted(facts(residual_of=str(path)), path)
    with pytest.raises(InputError, match=r"is, through its base policies, added to itself") as caught:
        load(path)
    assert "\n" not in str(caught.value)


def test_a_folder_is_no_model(tmp_path):
    (tmp_path / "folder.safetensors").mkdir()
    with pytest.raises(InputError, match=r"folder\.safetensors is not a whole model file"):
        read_model(tmp_path / "folder.safetensors")
