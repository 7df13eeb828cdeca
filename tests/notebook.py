"""The notebook of the examples: `make notebook` runs it anew and stores what it prints and draws."""

import re
from pathlib import Path

import nbformat
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parents[1] / "examples" / "first_three.ipynb"
SECONDS = 900.0
"""After which a cell is given up: some train."""


def executed(before=None):
    """The notebook, run anew in a process of its own; before: the heading at which to stop."""
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    if before is not None:
        headings = [cell.source.partition("\n")[0] for cell in notebook.cells]
        notebook.cells = notebook.cells[: headings.index(before)]
    resources = {"metadata": {"path": str(NOTEBOOK.parent)}}
    NotebookClient(notebook, timeout=SECONDS, resources=resources, record_timing=False).execute()
    return notebook


def told(notebook):
    """What its cells print."""
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return "".join(output["text"] for output in outputs if output["output_type"] == "stream")


def changes(notebook):
    """Changes of sigma (%) that it prints at last, by policy."""
    return {name: float(value) for name, value in re.findall(r"^(\w+): sigma (\S+) %", told(notebook), re.M)}


def main():
    """Run it and store it with its outputs."""
    notebook = executed()
    for cell in notebook.cells:
        cell.metadata = {}
    notebook.metadata["language_info"] = {"name": "python"}  # and not which version ran it
    nbformat.write(notebook, NOTEBOOK)


if __name__ == "__main__":
    main()
