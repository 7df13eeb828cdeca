"""Model files that are damaged, or made to do harm: refused in one sentence, without time or memory."""

import io
import json
import struct
import time
import tracemalloc
import zipfile

import numpy as np
import pytest

from panto_agents.model_file import read_model
from panto_agents.model_parts import CHECKSUMS
from panto_agents.policy import load
from panto_agents.stored import FOLDER
from panto_env import InputError
from panto_env.policies import find_policy

with zipfile.ZipFile(FOLDER / "head.zip") as _archive:
    WHOLE = {name: _archive.read(name) for name in _archive.namelist() if name != CHECKSUMS}
FACTS, ACTOR = json.loads(WHOLE["panto.json"]), WHOLE["actor.npz"]
with np.load(io.BytesIO(ACTOR)) as _arrays:
    ARRAYS = dict(_arrays)
LAST = len(ARRAYS) // 2 - 1


def npz(arrays, compression=zipfile.ZIP_STORED):
    """Arrays as numpy writes them; bytes stand for a part that it would not write."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression) as archive:
        for name, array in arrays.items():
            if isinstance(array, bytes):
                archive.writestr(f"{name}.npy", array)
                continue
            part = io.BytesIO()
            np.lib.format.write_array(part, np.asarray(array), allow_pickle=True)
            archive.writestr(f"{name}.npy", part.getvalue())
    return file.getvalue()


def npy(header, data=b"", version=1):
    """An array whose header says anything."""
    text = header.encode()
    size = struct.pack("<H" if version == 1 else "<I", len(text))
    return b"\x93NUMPY" + bytes([version, 0]) + size + text + data


def changed(**arrays):
    return {"actor.npz": npz({name: each for name, each in (ARRAYS | arrays).items() if each is not None})}


def facts(**values):
    return {"panto.json": json.dumps({key: each for key, each in (FACTS | values).items() if each != "gone"})}


def needs(**values):
    return facts(needs=FACTS["needs"] | values)


def huge(shape, data=b""):
    return npy(f"{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n", data)


def with_nan(name):
    array = ARRAYS[name].copy()
    array.flat[0] = np.nan
    return changed(**{name: array})


class Bomb:
    """What runs code where it is unpickled."""

    def __reduce__(self):
        return (pytest.fail, ("code of a model file was run",))


W, B = ARRAYS["weight_0"], ARRAYS["bias_0"]
NAMED = {f"layer_{k}": each for k, each in enumerate(ARRAYS.values())}
LONG_NUMBER = json.dumps(FACTS)[:-1] + ', "x": ' + "9" * 10**5 + "}"
DEEP = "[" * 100_000 + "]" * 100_000
CRAFTED = {
    "no facts": {"panto.json": None},
    "no network": {"actor.npz": None},
    "facts that are no JSON": {"panto.json": "{"},
    "facts that are no text": {"panto.json": b"\xff\xfe\x00"},
    "facts that are a list": {"panto.json": "[]"},
    "facts that are null": {"panto.json": "null"},
    "facts nested without end": {"panto.json": DEEP},
    "facts nested within": {"panto.json": json.dumps(FACTS)[:-1] + f', "more": {DEEP}}}'},
    "facts with a number of a million digits": {
        "panto.json": json.dumps(FACTS)[:-1] + ', "x": ' + "9" * 10**5 + "}"
    },
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
    "a network that is no zip": {"actor.npz": b"no zip"},
    "a network that is empty": {"actor.npz": npz({})},
    "a network cut off": {"actor.npz": ACTOR[: len(ACTOR) // 2]},
    "no bias in a layer": changed(bias_0=None),
    "no weight in a layer": changed(weight_0=None),
    "no last layer's bias": changed(**{f"bias_{LAST}": None}),
    "a layer too many": changed(weight_7=W, bias_7=B),
    "layers by other names": {
        "actor.npz": npz({f"layer_{k}": each for k, each in enumerate(ARRAYS.values())})
    },
    "layers that do not fit": changed(weight_1=np.zeros((3, 3), np.float32), bias_1=np.zeros(3, np.float32)),
    "a weight turned": changed(weight_0=np.ascontiguousarray(W.T)),
    "a bias of another length": changed(bias_0=B[:-1]),
    "a bias that is a matrix": changed(bias_0=B[:, None]),
    "a weight that is one number": changed(weight_0=np.float32(1.0)),
    "a weight of three axes": changed(weight_0=W[None]),
    "weights that are strings": changed(weight_0=np.full(W.shape, "1.0")),
    "weights that are bytes": changed(weight_0=np.full(W.shape, b"1")),
    "weights that are complex": changed(weight_0=W.astype(np.complex64)),
    "weights that are whole numbers": changed(weight_0=np.ones(W.shape, np.int64)),
    "weights that are truth values": changed(weight_0=np.ones(W.shape, bool)),
    "weights that are dates": changed(weight_0=np.zeros(W.shape, "datetime64[s]")),
    "weights that are records": changed(weight_0=np.zeros(W.shape, [("a", "<f4")])),
    "weights that are pickled": changed(weight_0=np.full(W.shape, Bomb(), dtype=object)),
    "weights that are not a number": with_nan("weight_0"),
    "biases that are not a number": with_nan(f"bias_{LAST}"),
    "a header of another magic": changed(weight_0=b"\x93NUMPX" + bytes(100)),
    "a header of an unknown version": changed(weight_0=b"\x93NUMPY\x09\x00" + bytes(100)),
    "a header that is empty": changed(weight_0=b""),
    "a header cut off": changed(weight_0=npy("{'descr': '<f4'")),
    "a header that is code": changed(weight_0=npy("__import__('os').system('true')\n")),
    "a header nested without end": changed(weight_0=npy("(" * 9000 + ")" * 9000)),
    "a header of 60,000 spaces": changed(weight_0=npy(" " * 60_000)),
    "a header of wrong keys": changed(weight_0=npy("{'shape': (1,)}\n")),
    "a header of a negative size": changed(weight_0=huge("(-1, 5)")),
    "a header that says more than there is": changed(weight_0=huge("(1000000, 1000000)")),
    "a header that says more than any machine has": changed(weight_0=huge(f"({2**40}, {2**40})")),
    "a header that says less than there is": changed(weight_0=huge("(1, 1)", bytes(400))),
    "facts that unpack to 2 MB": {"panto.json": json.dumps(FACTS) + " " * 2**21},
    "a network that unpacks to 300 MB": {"actor.npz": bytes(300 * 2**20)},
    "a network within that unpacks to 300 MB": {
        "actor.npz": npz({"weight_0": huge("(1,)", bytes(300 * 2**20))}, zipfile.ZIP_DEFLATED)
    },
    "a part nobody reads that unpacks to 300 MB": {"policy.pth": bytes(300 * 2**20)},
    "checksums that are a list": {CHECKSUMS: "[]"},
    "checksums of other parts": {CHECKSUMS: json.dumps({"panto.json": "0"})},
    "checksums of other values": {CHECKSUMS: json.dumps({"panto.json": "0", "actor.npz": "0"})},
}


def crafted(parts, path):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in (WHOLE | parts).items():
            if data is not None:
                archive.writestr(name, data)
    return path


def test_there_are_many():
    assert len(CRAFTED) >= 60


@pytest.mark.filterwarnings("ignore::panto_env.base.errors.UncheckedWarning")
def test_what_they_are_made_of_is_whole(tmp_path):
    facts, _ = read_model(crafted({}, tmp_path / "whole.zip"))
    assert facts.seed == FACTS["seed"]


@pytest.mark.parametrize("name", CRAFTED)
def test_a_crafted_model_is_refused_in_one_sentence(name, tmp_path):
    path = crafted(CRAFTED[name], tmp_path / "crafted.zip")
    begin = time.perf_counter()
    tracemalloc.start()
    try:
        with pytest.raises(
            InputError, match=r"crafted\.zip is not a whole model file \(.+\); take another"
        ) as caught:
            find_policy(str(path))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600
    assert peak < 60e6
    assert time.perf_counter() - begin < 5


def member(archive_bytes, name, field, value):
    """The same zip whose directory says another size of a part, unpacked (24) or packed (20)."""
    data = bytearray(archive_bytes)
    place = data.rindex(b"PK\x01\x02", 0, data.rindex(name.encode()))
    data[place + field : place + field + 4] = struct.pack("<I", value)
    return bytes(data)


@pytest.mark.parametrize(("field", "value"), [(24, 10), (24, 0xFFFFFFF0), (20, 10)])
def test_a_zip_that_lies_about_its_sizes_is_refused(field, value, tmp_path):
    path = tmp_path / "lies.zip"
    path.write_bytes(member((FOLDER / "head.zip").read_bytes(), "actor.npz", field, value))
    with pytest.raises(InputError, match=r"lies\.zip is not a whole model file"):
        read_model(path)


def test_two_parts_of_one_name_are_refused(tmp_path):
    path = tmp_path / "twice.zip"
    crafted({}, path)
    with zipfile.ZipFile(path, "a") as archive, pytest.warns(UserWarning, match="Duplicate name"):
        archive.writestr("actor.npz", WHOLE["actor.npz"])
    with pytest.raises(InputError, match="two parts of one name"):
        read_model(path)


@pytest.mark.filterwarnings("ignore::panto_env.base.errors.UncheckedWarning")
def test_a_model_that_is_added_to_itself_is_refused(tmp_path):
    path = tmp_path / "itself.zip"
    crafted(facts(residual_of=str(path)), path)
    with pytest.raises(InputError, match=r"added to a policy which is, in the end, itself") as caught:
        load(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "content", [b"", b"PK", b"PK\x05\x06" + bytes(18), b"PK\x03\x04" * 100, bytes(10**6)]
)
def test_what_is_no_zip_is_refused(content, tmp_path):
    path = tmp_path / "none.zip"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"none\.zip is not a whole model file"):
        read_model(path)


def test_a_folder_is_no_model(tmp_path):
    (tmp_path / "folder.zip").mkdir()
    with pytest.raises(InputError, match=r"folder\.zip is not a whole model file"):
        read_model(tmp_path / "folder.zip")
