"""Tables and lists that were damaged, or never were what they should be: one sentence each."""

import json

import numpy as np
import pytest

from panto_agents.settings import parse_training
from panto_agents.trainings import RunFolder
from panto_baselines.dataset.make import LIST, verify
from panto_env import InputError
from panto_env.cluster import IDENTITY, open_parts
from panto_env.estimation.motion import read_motion
from panto_env.identification.record import read_record

TRAINING = {
    "algorithm": "ppo",
    "total_steps": 512,
    "lanes": 2,
    "checkpoint_steps": 128,
    "environment": {"id": "PantographStiffness-v0", "distance": 80.0},
    "evaluation": {"interval_steps": 128},
    "hyperparameters": {"n_steps": 64, "batch_size": 64},
}
EVALUATIONS = "steps,speed_kmh,seed\n128,300,1\n256,300,1\n"
DAMAGED = {
    "steps that are no number": EVALUATIONS.replace("256", "2x6"),
    "steps that are missing": EVALUATIONS.replace("256", ""),
    "no column of steps": EVALUATIONS.replace("steps", "step"),
    "a row cut off": EVALUATIONS[:-4],
    "a row too long": EVALUATIONS.replace("256,", "256,1,"),
    "a quotation mark without its second one": EVALUATIONS.replace("300", '"300', 1),
    "a quotation mark in the header": EVALUATIONS.replace("steps", '"steps'),
    "a cell without end": EVALUATIONS.replace("256", "2" * 200_000),
    "bytes that are no text": b"steps,seed\n\xff\xfe,1\n",
    "zeros": b"\0" * 500,
    "digits without end": EVALUATIONS.replace("256", "2" * 6000),
}


@pytest.fixture
def folder(tmp_path):
    run = RunFolder(tmp_path / "run")
    run.path.mkdir()
    run.write_settings(parse_training(TRAINING, "test"))
    return run


@pytest.mark.parametrize("damage", DAMAGED)
def test_a_damaged_table_of_evaluations_is_refused_on_resume(damage, folder):
    content = DAMAGED[damage]
    folder.evaluations.write_bytes(content if isinstance(content, bytes) else content.encode())
    before = folder.evaluations.read_bytes()
    for resume in (
        lambda: folder.check_resumable(parse_training(TRAINING, "test")),  # before any work begins
        lambda: folder.drop_evaluations_after(128),
    ):
        with pytest.raises(
            InputError, match=r"evaluations\.csv is damaged after \d whole rows; correct"
        ) as caught:
            resume()
        assert "\n" not in str(caught.value)
    assert folder.evaluations.read_bytes() == before


def test_a_whole_table_of_evaluations_is_taken(folder):
    folder.evaluations.write_text(EVALUATIONS)
    folder.check_resumable(parse_training(TRAINING, "test"))
    folder.drop_evaluations_after(128)
    assert folder.evaluations.read_text().split() == ["steps,speed_kmh,seed", "128,300,1"]


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"\xff", b"null", b"[" * 100_000])
def test_damaged_settings_of_a_training_are_refused_on_resume(content, folder):
    folder.settings.write_bytes(content)
    with pytest.raises(InputError, match=r"settings\.json"):
        folder.check_resumable(parse_training(TRAINING, "test"))


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[]", b"\xff", b"null", b"3", b'{"settings": 3}', b"[" * 100_000]
)
def test_a_damaged_identity_of_parts_is_refused(content, tmp_path):
    (tmp_path / IDENTITY).write_bytes(content)
    with pytest.raises(InputError, match=r"identity\.json (is not JSON|could not be read)") as caught:
        open_parts(tmp_path, {"kind": "designs", "settings": {"count": 8}})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"\xff\xfe", b"abc", b"\0\0\0", b"../../etc/passwd"])
def test_a_damaged_list_of_checksums_is_refused(content, tmp_path):
    (tmp_path / LIST).write_bytes(content)
    (tmp_path / "data").write_text("1")
    with pytest.raises(InputError) as caught:
        verify(tmp_path)
    assert "\n" not in str(caught.value)


def record(samples=40):
    rows = ["time (s),force (N),y_p1 (mm),y_p2 (mm),y_p3 (mm)"]
    for k in range(samples):
        t = 0.01 * k
        rows.append(f"{t:.2f},{100 + np.sin(t):.4f},{np.sin(t):.4f},{np.cos(t):.4f},{np.sin(2 * t):.4f}")
    return rows


def with_line(number, change):
    rows = record()
    rows[number] = change(rows[number])
    return "\n".join(rows).encode()


RECORDS = {
    "a quotation mark in the header": with_line(0, lambda row: '"' + row),
    "a quotation mark in a row": with_line(5, lambda row: '"' + row),
    "a quotation mark before a cell": with_line(5, lambda row: row.replace(",", ',"', 1)),
    "a quotation mark in the last row": with_line(40, lambda row: '"' + row),
    "quotation marks over two lines": with_line(0, lambda row: row.replace("force (N)", '"force\n(N)"')),
    "a cell without end": with_line(5, lambda row: row + "0" * 200_000),
    "text in a row": with_line(5, lambda row: row.replace(",", ",x", 1)),
    "a row cut off": with_line(5, lambda row: row[:8]),
    "a comma for a point": with_line(5, lambda row: row.replace(".", ",")),
    "zeros in a row": with_line(5, lambda row: row.replace("0", "\0")),
    "infinity in a row": with_line(5, lambda row: "inf" + row[4:]),
    "bytes that are no text": with_line(5, str).replace(b"(N)", b"(\xff)"),
    "half a letter of UTF-16": "\n".join(record()).encode("utf-16")[:-1],
    "nothing": b"",
    "nothing but line ends": b"\n\r\n\n",
    "nothing but zeros": bytes(1000),
    "a header alone": record()[0].encode(),
    "no unit": with_line(0, lambda row: row.replace("time (s)", "time")),
    "a column twice": with_line(0, lambda row: row.replace("force (N)", "y_p1 (mm)")),
    "a picture": b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 20,
}


@pytest.mark.parametrize("damage", RECORDS)
@pytest.mark.parametrize("read", [read_record, lambda path: read_motion(path, 100.0)])
def test_a_damaged_record_is_refused_in_one_sentence(read, damage, tmp_path):
    path = tmp_path / "record.csv"
    path.write_bytes(RECORDS[damage])
    with pytest.raises(InputError) as caught:
        read(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("line", [0, 5, 20, 39])
def test_the_line_of_an_open_quotation_mark_is_told(line, tmp_path):
    path = tmp_path / "record.csv"
    path.write_bytes(with_line(line, lambda row: '"' + row))
    with pytest.raises(InputError, match=f"^Line {line + 1} of .*record.csv has a quotation mark without"):
        read_record(path)


def test_quotation_marks_in_pairs_are_read(tmp_path):
    path = tmp_path / "record.csv"
    path.write_bytes("\n".join(record()).encode())
    plain = read_record(path)
    path.write_bytes("\n".join(",".join(f'"{cell}"' for cell in row.split(",")) for row in record()).encode())
    assert json.dumps(read_record(path).plate.tolist()) == json.dumps(plain.plate.tolist())
