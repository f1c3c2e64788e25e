"""The documentation as one site: guides, theory, both programming interfaces."""

from __future__ import annotations

import shutil
from pathlib import Path

ROOT = Path(__file__).parents[1]

project = "supple"
author = "the supple authors"
copyright = "the supple authors"
html_title = "supple"

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx-mathjax-offline",
    "sphinx_copybutton",
]
exclude_patterns = ["requirements.txt"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 4
# Formulas carry their own numbers, (P.1), by which code cites them.
myst_dmath_double_inline = True
suppress_warnings = ["myst.header", "myst.xref_missing"]
nb_execution_mode = "off"

autodoc_typehints = "description"
autodoc_member_order = "bysource"
# How results are made is the package's own affair.
autodoc_class_signature = "separated"
napoleon_google_docstring = True


html_theme = "furo"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["site.css"]

# The Rust interface, where `cargo doc` has made it.
rustdoc = ROOT / "target" / "doc"
html_extra_path = []
if (rustdoc / "supple" / "index.html").exists():
    staged = ROOT / "target" / "rustdoc"
    shutil.rmtree(staged, ignore_errors=True)
    shutil.copytree(rustdoc, staged / "rust")
    html_extra_path.append(str(staged))


def run_notebooks(source: Path, target: Path) -> None:
    """Runs the notebooks where they live, as readers do, and puts what they show among the pages."""
    import nbformat
    from nbclient import NotebookClient

    target.mkdir(exist_ok=True)
    for path in sorted(source.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(source)}}).execute()
        for cell in notebook.cells:
            if cell.cell_type == "markdown":
                cell.source = cell.source.replace("](../docs/", "](../")
        nbformat.write(notebook, target / path.name)


run_notebooks(ROOT / "notebooks", Path(__file__).parent / "notebooks")
