"""A browser without network, and a report of real results."""

import os
import subprocess
from pathlib import Path

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.ui import WebDriverWait

ROOT = Path(__file__).resolve().parents[2]
#: The program; absolute, as tests run it in folders of their own.
SUPPLE = Path(os.environ.get("SUPPLE", ROOT / "target/release/supple")).resolve()
TASK = ROOT / "tasks/two_mass.toml"
STEPS = {
    "design": ["design"],
    "landscape": ["sweep", "--grid", "k1=log:50:600:12", "--grid", "k2=log:100:600:10"],
    "paper": ["evaluate", "--set", "k1=123", "--set", "k2=240"],
    "trace": ["trace", "--starts", "2"],
    "robustness": ["robustness", "--vary", "drive_variance=log:1e-3:1e-2:3", "--rollouts", "10"],
    "pareto": ["pareto", "--points", "4", "--starts", "1"],
    "bound": ["bound", "--curve"],
}
#: How long is waited for a page, s: without a graphics card, a busy machine takes long to paint.
PATIENCE = 300
SECTIONS = [
    "answer", "landscape", "motion", "contacts", "terms", "quantities", "trajectories", "information", "controller", "robustness",
    "pareto", "bound", "sensitivities", "convergence", "origin",
]


def supple(*arguments, codes=(0,)):
    done = subprocess.run([SUPPLE, *map(str, arguments)], capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode in codes, done.stderr
    return done


def keep(driver, name):
    """Keeps a picture of what a browser shows, where the variable `SCREENSHOTS` names a folder."""
    folder = os.environ.get("SCREENSHOTS")
    if folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        driver.save_screenshot(str(Path(folder) / f"{name}.png"))


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    """The page of a report with every section."""
    folder = tmp_path_factory.mktemp("results")
    for name, (command, *options) in STEPS.items():
        # 1: computed, but not all searches converged, or a bound is missed, as by the paper's design.
        supple(command, TASK, *options, "--out", folder / name, codes=(0, 1))
    page = folder / "report.html"
    supple("report", *(folder / name for name in STEPS), "--out", page)
    return page


def start(width, height, **media):
    options = Options()
    options.binary_location = os.environ.get("CHROMIUM", "/usr/bin/chromium")
    for argument in [
        "--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
        "--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
        "--disable-accelerated-2d-canvas", "--disable-gpu-rasterization",
        "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", f"--window-size={width},{height}",
    ]:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options, Service(os.environ.get("CHROMEDRIVER", "/usr/bin/chromedriver")))
    driver.set_page_load_timeout(PATIENCE)
    driver.set_script_timeout(PATIENCE)
    driver.command_executor.client_config.timeout = PATIENCE + 60
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    features = [{"name": name.replace("_", "-"), "value": value} for name, value in media.items()]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
    return driver


@pytest.fixture(scope="session")
def choices(tmp_path_factory):
    """The page of what is chosen from catalogues: sensors, and springs."""
    folder = tmp_path_factory.mktemp("choices")
    supple("sensors", ROOT / "tasks/two_mass_sensors.toml", "--out", folder / "sensors")
    task, bounds = TASK.read_text(), "bounds = [50.0, 600.0]"
    assert bounds in task
    springs = folder / "springs.toml"
    springs.write_text(task.replace(bounds, bounds + "\ncatalogue = [100, 150, 200]", 1))
    supple("design", springs, "--starts", "1", "--out", folder / "design")
    page = folder / "report.html"
    supple("report", folder / "sensors", folder / "design", "--out", page)
    return page


@pytest.fixture(scope="session")
def open_page(report):
    """Opens the report, or another page, in a browser of its own, and waits until plots can be drawn."""
    drivers = []

    def open_at(width=1300, height=1000, page=report, **media):
        driver = start(width, height, **media)
        drivers.append(driver)
        driver.get(page.as_uri())
        WebDriverWait(driver, PATIENCE).until(lambda d: d.execute_script("return document.documentElement.dataset.ready"))
        return driver

    yield open_at
    for driver in drivers:
        driver.quit()


@pytest.fixture(scope="session")
def wide(open_page):
    return open_page(prefers_color_scheme="light", prefers_reduced_motion="no-preference")
