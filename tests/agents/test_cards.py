"""Cards of the stored agents are those that `make cards` writes."""

import pytest

pytest.importorskip("huggingface_hub")

from huggingface_hub import ModelCard

from panto_agents.stored import FOLDER

from ..cards import agents, card


@pytest.mark.parametrize("name", agents())
def test_a_card_is_of_today_and_a_hub_can_read_it(name):
    text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    assert text == card(name), "run `make cards`"
    data = ModelCard(text).data
    assert data.license == "mit"
    assert data.eval_results
    assert all(each.metric_value < 0 for each in data.eval_results)
    for told in ("What it is", "Where it fails", "Limits"):
        assert told in text


def test_every_agent_has_a_card():
    assert sorted(path.stem for path in FOLDER.glob("*.md")) == agents()
