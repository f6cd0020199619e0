"""The notebooks, whose last cells check their results."""

import json
import time
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


def test_there_are_notebooks():
    assert len(NOTEBOOKS) == 5


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(notebook, monkeypatch):
    """Runs the code cells in one namespace, in the notebook's folder as Jupyter does, without windows."""
    monkeypatch.setenv("MPLBACKEND", "Agg")
    plt = pytest.importorskip("matplotlib.pyplot", reason="the notebooks draw with Matplotlib")
    plt.switch_backend("Agg")
    monkeypatch.chdir(notebook.parent)
    cells = [cell for cell in json.loads(notebook.read_text("utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in cells), "stored with outputs"
    assert "assert " in "".join(cells[-1]["source"]), "its last cell checks nothing"
    begin, namespace = time.perf_counter(), {"__name__": "__main__"}
    try:
        for index, cell in enumerate(cells, start=1):
            code = compile("".join(cell["source"]), f"{notebook.name}, code cell {index}", "exec")
            exec(code, namespace)
    finally:
        plt.close("all")
    print(f"{notebook.stem}: {time.perf_counter() - begin:.1f} s")
