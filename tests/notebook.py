"""The notebooks of the examples: `make notebook` runs them anew and stores what they print and draw."""

import re
from pathlib import Path

import nbformat
from nbclient import NotebookClient

EXAMPLES = Path(__file__).parents[1] / "examples"
LEARNING, UNSEEN_LINE, FIRST = (
    EXAMPLES / f"{name}.ipynb" for name in ("first_three", "unseen_line", "learn")
)
NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))
SECONDS = 900.0
"""After which a cell is given up: some train."""


def executed(path, before=None, folder=EXAMPLES):
    """A notebook, run anew in a process of its own; before: the heading at which to stop."""
    notebook = nbformat.read(path, as_version=4)
    if before is not None:
        headings = [cell.source.partition("\n")[0] for cell in notebook.cells]
        notebook.cells = notebook.cells[: headings.index(before)]
    resources = {"metadata": {"path": str(folder)}}
    NotebookClient(notebook, timeout=SECONDS, resources=resources, record_timing=False).execute()
    return notebook


def told(notebook):
    """What its cells print."""
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return "".join(output["text"] for output in outputs if output["output_type"] == "stream")


def changes(notebook):
    """Changes of sigma (%) that it prints at last, by policy."""
    return {
        name: float(value) for name, value in re.findall(r"^([\w-]+): sigma (\S+) %", told(notebook), re.M)
    }


def main():
    """Run them and store them with their outputs."""
    for path in NOTEBOOKS:
        notebook = executed(path)
        for k, cell in enumerate(notebook.cells):
            cell.id, cell.metadata = f"cell-{k}", {}
        notebook.metadata["language_info"] = {"name": "python"}  # and not which version ran it
        nbformat.write(notebook, path)


if __name__ == "__main__":
    main()
