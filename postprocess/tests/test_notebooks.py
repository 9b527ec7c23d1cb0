# SPDX-License-Identifier: MIT
"""The notebooks run from their first to their last cell."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXTENSION = Path(os.environ.get("ROCKDDA_EXTENSION", ROOT / "build/python"))
NOTEBOOKS = sorted((ROOT / "docs/notebooks").glob("*.ipynb"))


def test_there_are_notebooks():
    assert {path.stem for path in NOTEBOOKS} >= {"incline", "batch"}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs(path, tmp_path, monkeypatch):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    if not list(EXTENSION.glob("_rockdda*")):
        pytest.skip("the extension is not built")
    # the package as it is in the source folder, with the extension of the build folder
    start = tmp_path / "start"
    start.mkdir()
    (start / "sitecustomize.py").write_text(f"import rockdda\n\nrockdda.__path__.append({str(EXTENSION)!r})\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(start), str(ROOT / "postprocess")]))
    work = tmp_path / "work"
    work.mkdir()
    notebook = nbformat.read(path, as_version=4)
    client = nbclient.NotebookClient(
        notebook, timeout=600, startup_timeout=300, resources={"metadata": {"path": str(work)}}
    )  # a busy machine starts no kernel within the minute that is the default
    client.execute()
    for cell in notebook.cells:
        if cell.cell_type == "code" and cell.source.rstrip().endswith(";"):  # a picture
            assert any("image/png" in output.get("data", {}) for output in cell.outputs), cell.source
    assert list(work.rglob("*.h5"))
