"""Coverage of fits: what its table counts, and that the documents have the table of the stored results."""

from ..documents import ROOT
from .coverage import diagnosed, table

STORED = ROOT / "docs" / "records-coverage"


def test_the_documents_have_the_table_of_the_stored_lines():
    text = (ROOT / "docs" / "records.md").read_text(encoding="utf-8")
    for rows in (list(table(STORED)), list(diagnosed(STORED))):
        assert len(rows) > 2
        assert [row for row in rows if row not in text] == []
