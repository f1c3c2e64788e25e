"""Every example of the documentation runs, and prints what is shown.

Fences of `python` are run and those of `pycon` compared with what they show, in one namespace by page; `python no-run`
marks what needs a machine that is not here.
"""

from __future__ import annotations

import doctest
import re
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCE = re.compile(r"^```(python|pycon)( no-run)?[ ]*\n(.*?)^```", re.MULTILINE | re.DOTALL)
#: What some pages import.
NEEDS = ("jax", "mujoco", "distributed", "scipy", "control")


def fences(page: Path) -> list[tuple[str, str, int]]:
    """Language, text and line of each fence to run."""
    text = page.read_text()
    found = []
    for match in FENCE.finditer(text):
        if not match.group(2):
            found.append((match.group(1), match.group(3), text[: match.start()].count("\n") + 2))
    return found


@pytest.mark.parametrize("page", [page for page in PAGES if fences(page)], ids=lambda page: page.name)
def test_examples_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("tasks", "models", "studies"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    monkeypatch.chdir(tmp_path)
    whole = "".join(text for _, text, _ in fences(page))
    for module in NEEDS:
        if re.search(rf"\b(import|from) {module}\b", whole):
            pytest.importorskip(module)
    space: dict[str, object] = {"__name__": "__main__"}
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    for language, text, line in fences(page):
        if language == "python":
            exec(compile("\n" * (line - 1) + text, str(page), "exec"), space)  # noqa: S102
        else:
            examples = doctest.DocTestParser().get_examples(text)
            test = doctest.DocTest(examples, {}, page.name, str(page), line, text)
            test.globs = space
            report: list[str] = []
            runner.run(test, out=report.append, clear_globs=False)
            assert not runner.failures, "".join(report)


def test_there_are_examples() -> None:
    assert sum(len(fences(page)) for page in PAGES) >= 10
