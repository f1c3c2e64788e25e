"""How to cite the package."""

from __future__ import annotations

from ._supple import __version__

__all__ = ["cite"]

#: The paper whose principle the package implements.
PAPER = """@misc{haninger2021minimum,
  author = {Haninger, Kevin},
  title = {Minimum directed information: A design principle for compliant robots},
  year = {2021},
  eprint = {2103.14830},
  archivePrefix = {arXiv},
  doi = {10.48550/arXiv.2103.14830}
}
"""


def cite() -> str:
    """BibTeX entries for the installed version of the package, and for the paper whose principle it implements."""
    software = f"""@software{{supple,
  author = {{{{The supple authors}}}},
  title = {{supple: design of compliant robots that need little information to be controlled}},
  version = {{{__version__}}},
  license = {{MIT OR Apache-2.0}}
}}
"""
    return f"{software}\n{PAPER}"
