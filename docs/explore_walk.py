"""Walks through the explorer with two masses and takes the pictures of docs/explore.md."""

import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/browser"))

from conftest import SUPPLE, start  # noqa: E402
from selenium.webdriver.support.ui import WebDriverWait  # noqa: E402

DONE = "document.getElementById('map-note').dataset.done === 'true'"
SHOWN = "document.documentElement.dataset.shown === document.documentElement.dataset.latest"
DETAILS = "document.documentElement.dataset.details === document.documentElement.dataset.latest"


def walk(folder: Path) -> None:
    command = [SUPPLE, "explore", ROOT / "tasks/two_mass.toml", "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    driver = start(1400, 1000, prefers_color_scheme="light", prefers_reduced_motion="reduce")

    def until(what: str) -> None:
        WebDriverWait(driver, 240).until(lambda d: d.execute_script(f"return {what}"))

    def picture(name: str) -> None:
        until(f"{SHOWN} && {DETAILS} && {DONE}")
        # The motion is drawn last.
        time.sleep(4)
        driver.save_screenshot(str(folder / f"explore_{name}.png"))

    def share(index: int, value: float) -> None:
        driver.execute_script(
            "Explore.design.keep();"
            "Explore.design.move({ [arguments[0]]: Explore.valueAt(Explore.design.knobs[arguments[0]], arguments[1]) })",
            index,
            value,
        )
        until(SHOWN)

    try:
        driver.get(process.stdout.readline().strip())
        until("document.querySelector('#scene').dataset.shown !== undefined")
        for step in range(12):
            share(0, 0.9 - 0.03 * step)
        picture("start")
        driver.execute_script("document.getElementById('pin').click(); document.getElementById('design').click()")
        until("!Explore.tools.search.running")
        picture("search")
        driver.execute_script("document.getElementById('roll').click()")
        until("Explore.tools.roll.costs.length === 50")
        driver.execute_script("document.getElementById('curves').scrollIntoView({ behavior: 'instant' }); scrollBy(0, -110)")
        picture("pins")
    finally:
        driver.quit()
        process.kill()


if __name__ == "__main__":
    walk(Path(sys.argv[1]))
