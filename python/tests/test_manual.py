"""Python of the manual and of the notebooks, run; `python/check` puts both beside these tests."""

import base64
import os
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
PAGES = sorted(HERE.parent.glob("pages/**/*.md"))
NOTEBOOKS = sorted(HERE.parent.glob("notebooks/*.ipynb"))


def blocks(page):
    """Its blocks of Python, with the lines that they begin at."""
    found, lines = [], page.read_text().splitlines()
    for number, line in enumerate(lines):
        if line == "```python":
            end = next(i for i in range(number, len(lines)) if lines[i] == "```")
            found.append((number + 2, "\n".join(lines[number + 1 : end])))
    return found


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p)], ids=lambda p: p.name)
def test_python_of_the_manual_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "manual"}
    for line, text in blocks(page):
        # So that an error names the page and its line.
        exec(compile("\n" * (line - 1) + text, str(page), "exec"), names)


def test_there_are_pages_and_notebooks():
    if not PAGES:
        pytest.skip("not run by python/check")
    assert {"python.md", "README.md"} <= {p.name for p in PAGES if blocks(p)}
    assert len(NOTEBOOKS) > 1


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebooks_run_and_show_pictures(path, tmp_path):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    # Kernels keep their files apart from the user's.
    os.environ["IPYTHONDIR"] = os.environ["JUPYTER_RUNTIME_DIR"] = str(tmp_path / "jupyter")
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert all(not cell.get("outputs") for cell in notebook.cells), "outputs do not belong into the repository"
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    pages = [output.data["text/html"] for output in outputs if "text/html" in output.get("data", {})]
    drawn = [page for page in pages if "<svg" in page or "image/svg+xml" in page]
    assert drawn, f"no pictures among {len(outputs)} outputs"
    for page in drawn:
        for part in page.split("base64,")[1:]:
            assert base64.b64decode(part.split('"')[0]).lstrip().startswith(b"<svg")
