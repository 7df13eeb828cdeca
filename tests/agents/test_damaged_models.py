"""Model files that are damaged, or say what cannot be: refused in one sentence."""

import numpy as np
import pytest
from safetensors.numpy import save_file

from panto_agents.model_file import read_model
from panto_agents.stored import FOLDER
from panto_env import InputError
from panto_env.base.checksums import read_arrays, write_arrays
from panto_env.policies import find_policy

MODEL = FOLDER / "head.safetensors"
FACTS, ARRAYS = read_arrays(MODEL)
LAST = len(ARRAYS) // 2 - 1


def changed(**arrays):
    """Other layers, and the checksum that fits them; None: without that one."""
    named = {f"actor/{name}": array for name, array in arrays.items()}
    return FACTS, {name: each for name, each in (ARRAYS | named).items() if each is not None}


def facts(**values):
    """Other facts, and the checksum that fits them."""
    return {key: each for key, each in (FACTS | values).items() if each != "gone"}, ARRAYS


def needs(**values):
    return facts(needs=FACTS["needs"] | values)


def with_nan(name):
    array = ARRAYS[f"actor/{name}"].copy()
    array.flat[0] = np.nan
    return changed(**{name: array})


W, B = ARRAYS["actor/weight_0"], ARRAYS["actor/bias_0"]
WHOLE = MODEL.read_bytes()
CRAFTED = {
    "no network": (FACTS, {}),
    "steps that do not fit": facts(steps_before=[{"frames": 2}, {"centre": [0.0], "scale": [1.0]}]),
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
    "a share that is no number": facts(residual_share=float("nan")),
    "a washout of something else": facts(washout={"colour": 1}),
    "no bias in a layer": changed(bias_0=None),
    "no last layer's bias": changed(**{f"bias_{LAST}": None}),
    "a layer too many": changed(weight_7=W, bias_7=B),
    "layers by other names": (FACTS, {f"actor/layer_{k}": each for k, each in enumerate(ARRAYS.values())}),
    "layers that do not fit": changed(weight_1=np.zeros((3, 3), np.float32), bias_1=np.zeros(3, np.float32)),
    "a weight turned": changed(weight_0=np.ascontiguousarray(W.T)),
    "a bias of another length": changed(bias_0=B[:-1]),
    "a bias that is a matrix": changed(bias_0=B[:, None]),
    "a weight that is one number": changed(weight_0=np.array(1.0, np.float32)),
    "weights that are whole numbers": changed(weight_0=np.ones(W.shape, np.int64)),
    "weights that are not a number": with_nan("weight_0"),
    "biases that are not a number": with_nan(f"bias_{LAST}"),
    "a network cut off": WHOLE[: len(WHOLE) // 2],
    "a network with more behind it": WHOLE + bytes(100),
    "nothing": b"",
}


def crafted(content, path):
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        write_arrays(path, *content)
    return path


@pytest.mark.parametrize("name", CRAFTED)
def test_a_crafted_model_is_refused_in_one_sentence(name, tmp_path):
    path = crafted(CRAFTED[name], tmp_path / "crafted.safetensors")
    with pytest.raises(
        InputError, match=r"crafted\.safetensors is not a whole model file \(.+\); take another"
    ) as caught:
        find_policy(str(path))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


def test_what_is_no_model_file_is_refused(tmp_path):
    (tmp_path / "folder.safetensors").mkdir()
    save_file({"notes": np.zeros(3)}, tmp_path / "other.safetensors")
    for name, reason in {
        "folder": r"folder\.safetensors is not a whole model file",
        "other": "it was not written by panto-env",
        "none": r"none\.safetensors does not exist",
    }.items():
        with pytest.raises(InputError, match=reason):
            read_model(tmp_path / f"{name}.safetensors")
