"""The documentation as one site: guides, theory, both programming interfaces."""

from __future__ import annotations

import shutil
import sys
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
# Notebooks run while the site is built; what raises in them fails the build.
nb_execution_mode = "force"
nb_execution_timeout = 600
nb_execution_raise_on_error = True

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

# The notebooks live beside the code; the site shows copies.
notebooks = ROOT / "notebooks"
if notebooks.exists():
    shutil.copytree(notebooks, Path(__file__).parent / "notebooks", dirs_exist_ok=True)

sys.path.insert(0, str(ROOT / "python"))
