"""What a user of `supple explore` sees and can do, and how fast."""

import json
import os
import re
import shutil
import socket
import statistics
import subprocess
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select, WebDriverWait

from conftest import ROOT, SUPPLE, keep, start

LONG = 180
TASKS = ROOT / "tasks"


class Served:
    """`supple explore` in a process of its own."""

    def __init__(self, task, folder, *options):
        self.log = open(folder / "log.txt", "w+")
        command = [SUPPLE, "explore", task, "--no-browser", *options]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self.log, text=True, cwd=folder)
        self.address = self.process.stdout.readline().strip()
        assert self.address.startswith("http://127.0.0.1:"), (folder / "log.txt").read_text()
        self.base, self.token = re.fullmatch(r"(http://127\.0\.0\.1:\d+)/\?token=(\w+)", self.address).groups()

    def resident(self):
        """Bytes of memory in use."""
        fields = Path(f"/proc/{self.process.pid}/statm").read_text().split()
        return int(fields[1]) * os.sysconf("SC_PAGE_SIZE")

    def processor(self):
        """Seconds of processor time so far."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def close(self):
        self.process.kill()
        self.process.wait()
        self.log.close()


@pytest.fixture
def served(tmp_path):
    """Starts explorers that end with the test."""
    running = []

    def serve(task, *options):
        running.append(Served(task, tmp_path, *options))
        return running[-1]

    yield serve
    for one in running:
        one.close()


@pytest.fixture
def browsers():
    drivers = []

    def open_at(address, width=1400, height=1000, **media):
        driver = start(width, height, **media)
        drivers.append(driver)
        driver.get(address)
        settled(driver)
        return driver

    yield open_at
    for driver in drivers:
        driver.quit()


def run(driver, script, *arguments):
    return driver.execute_script(script, *arguments)


def until(driver, what, *arguments, why=None):
    return WebDriverWait(driver, LONG, 0.05).until(lambda d: run(d, f"return {what}", *arguments), why or what)


def settled(driver):
    """Waits until the design on screen is the one that is drawn."""
    root = "document.documentElement.dataset"
    until(driver, f"{root}.ready === 'yes' && {root}.latest !== undefined && {root}.shown === {root}.latest")


def quiet(driver):
    """Nothing failed in the console but what the tests provoke."""
    assert [entry for entry in driver.get_log("browser") if entry["level"] == "SEVERE"] == []


def slide(driver, index, share):
    """Moves a slider as a hand does, and waits for nothing."""
    run(
        driver,
        """const range = document.getElementById(`knob-${arguments[0]}`);
           range.value = String(Math.round(1000 * arguments[1]));
           range.dispatchEvent(new Event("input", { bubbles: true }));
           range.dispatchEvent(new Event("change", { bubbles: true }));""",
        index,
        share,
    )


def values(driver):
    return run(driver, "return Explore.design.values")


def numbers(driver):
    return run(driver, "return Explore.now.numbers")


def knob(driver, name):
    return run(driver, "return Explore.design.knobs.findIndex((one) => one.name === arguments[0])", name)


def click(driver, name):
    run(driver, "document.getElementById(arguments[0]).click()", name)


CONTACT = {"two_mass.toml": True, "iiwa_door.toml": False, "soft_gripper.toml": True}


@pytest.mark.parametrize("task", CONTACT)
def test_every_control_does_what_it_says(served, browsers, task):
    explorer = served(TASKS / task)
    driver = browsers(explorer.address, prefers_color_scheme="light", prefers_reduced_motion="reduce")
    first, before = values(driver), numbers(driver)
    # Every slider moves its own value; the answer is of that design.
    for index in range(len(first)):
        group = run(driver, "return Explore.design.knobs[arguments[0]].group", index)
        if index and group in ("Noise", "Other parameters") and task != "two_mass.toml" and index % 3:
            continue
        slide(driver, index, 0.6)
        settled(driver)
        now = values(driver)
        assert now[index] != first[index], index
        assert run(driver, "return Explore.now.values") == now
    assert numbers(driver)["measured"] != before["measured"]
    # Numbers are typed; what is none is refused with what is valid.
    text = driver.find_element(By.CSS_SELECTOR, ".knob input[type=text]")
    text.clear()
    text.send_keys("nonsense", Keys.ENTER)
    assert text.get_attribute("aria-invalid") == "true"
    assert "must be a number from" in driver.find_element(By.ID, "notices").text
    middle = run(driver, "return Explore.valueAt(Explore.design.knobs[0], 0.5)")
    text.clear()
    text.send_keys(f"{middle:.6g}", Keys.ENTER)
    settled(driver)
    assert values(driver)[0] == pytest.approx(middle, rel=1e-4)
    # The keyboard moves a slider.
    at = values(driver)[0]
    driver.find_element(By.ID, "knob-0").send_keys(Keys.ARROW_RIGHT)
    settled(driver)
    assert values(driver)[0] > at
    # Undo and redo.
    moved = values(driver)
    click(driver, "undo")
    settled(driver)
    assert values(driver) != moved
    click(driver, "redo")
    settled(driver)
    assert values(driver) == moved
    click(driver, "reset")
    settled(driver)
    assert values(driver) == first and numbers(driver)["measured"] == before["measured"]
    # Pins: three, compared in the tables; then none.
    for name, share in [("A", 0.3), ("B", 0.6), ("C", 0.8)]:
        slide(driver, 0, share)
        settled(driver)
        click(driver, "pin")
        until(driver, "Explore.design.pins.some((pin) => pin.name === arguments[0] && pin.answer)", name)
    # At once: later answers draw the tables anew.
    heads = run(driver, "return [...document.querySelectorAll('#tables table:first-of-type thead th')].map((cell) => cell.innerText.trim())")
    assert heads[1:5] == ["now", "A", "B", "C"]
    keep(driver, f"explore_pins_{Path(task).stem}")
    click(driver, "pin")
    assert "pinned already" in driver.find_element(By.ID, "notices").text
    run(driver, "document.querySelector('[data-pin=A] button').click()")
    settled(driver)
    assert values(driver)[0] == pytest.approx(run(driver, "return Explore.valueAt(Explore.design.knobs[0], 0.3)"))
    for name in "ABC":
        run(driver, f"document.querySelector('[data-pin={name}] button:last-child').click()")
    assert run(driver, "return document.querySelectorAll('.pin').length") == 0
    # Sensitivities, and the information needed, come after.
    until(driver, "document.documentElement.dataset.details === document.documentElement.dataset.latest")
    assert len(driver.find_elements(By.CSS_SELECTOR, "#slopes tbody tr")) == len(run(driver, "return Explore.design.parameters"))
    # Curves of every quantity can be added, and removed.
    keys = run(driver, "return Explore.design.tasks[0].quantities.map((one) => one.key)")
    kinds = {key.split(":")[0]: key for key in keys}
    run(driver, "document.querySelectorAll('.panel .close').forEach((close) => close.click())")
    for key in kinds.values():
        Select(driver.find_element(By.ID, "curve-add")).select_by_value(key)
    settled(driver)
    until(driver, "document.querySelectorAll('.panel canvas').length === arguments[0]", len(kinds))
    filled = run(
        driver,
        """return Explore.now.curves.curves.map(({ key, series }) =>
             [key, series.some(({ y }) => Explore.curves.unpack(y).some((value) => value !== null))])""",
    )
    assert dict(filled) == {key: True for key in kinds.values()}
    assert ("contact" in kinds) == CONTACT[task]
    # Other tasks of the file.
    if run(driver, "return Explore.design.tasks.length") > 1:
        Select(driver.find_element(By.ID, "task")).select_by_value("1")
        settled(driver)
        assert run(driver, "return Explore.now.curves.curves.length") > 0
    quiet(driver)


def test_the_map_fills_and_takes_one_where_it_is_clicked(served, browsers):
    explorer = served(TASKS / "two_mass.toml")
    driver = browsers(explorer.address, prefers_reduced_motion="reduce")
    done = "document.getElementById('map-note').dataset.done === 'true'"
    until(driver, done)
    assert run(driver, "return Explore.map.state.grid.size") == 33 * 33
    canvas = driver.find_element(By.ID, "map-canvas")
    run(driver, "arguments[0].scrollIntoView({ block: 'center' })", canvas)
    before = values(driver)
    ActionChains(driver).move_to_element_with_offset(canvas, -40, 30).click().perform()
    settled(driver)
    after = values(driver)
    assert after[0] != before[0] and after[1] != before[1] and after[2:] == before[2:]
    canvas.send_keys(Keys.ARROW_RIGHT)
    settled(driver)
    assert values(driver)[0] > after[0] and values(driver)[1] == pytest.approx(after[1])
    colours = """const c = document.getElementById('map-canvas'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
                 const seen = new Set(); for (let i = 0; i < d.length; i += 4) seen.add(d[i] << 16 | d[i + 1] << 8 | d[i + 2]);
                 return seen.size;"""
    assert run(driver, colours) > 50
    keep(driver, "explore_map")
    for of in ["used", "cost", "excess"]:
        Select(driver.find_element(By.ID, "map-of")).select_by_value(of)
        until(driver, f"{done} && document.getElementById('map-note').textContent.length > 0")
    # Prices take gradients: another map.
    Select(driver.find_element(By.ID, "map-of")).select_by_value("price")
    until(driver, "document.getElementById('map-note').dataset.done === 'false'")
    until(driver, done)
    # A point of the front is a design to show.
    here = values(driver)
    front = driver.find_element(By.ID, "front-canvas")
    front.send_keys(Keys.ARROW_RIGHT)
    settled(driver)
    assert values(driver) != here
    # Another axis.
    Select(driver.find_element(By.ID, "map-x")).select_by_visible_text("drive_variance")
    until(driver, "Explore.map.state.axes[0] === arguments[0]", knob(driver, "drive_variance"))
    quiet(driver)


def test_a_search_starts_from_the_design_on_screen_and_ends_on_it(served, browsers):
    explorer = served(TASKS / "two_mass.toml")
    driver = browsers(explorer.address, prefers_reduced_motion="reduce")
    click(driver, "design")
    until(driver, "!Explore.tools.search.running")
    text = driver.find_element(By.ID, "search-text").text
    assert "converged" in text and "saves" in text, text
    settled(driver)
    assert numbers(driver)["feasible"]
    # As the README says of this task.
    assert numbers(driver)["measured"] == pytest.approx(242.8, abs=0.1)
    keep(driver, "explore_search")
    click(driver, "undo")
    settled(driver)
    assert not numbers(driver)["feasible"] or numbers(driver)["measured"] > 250
    quiet(driver)


def test_a_search_is_stopped_by_its_button_and_by_closing_the_page(served, browsers):
    explorer = served(TASKS / "iiwa_door.toml")
    driver = browsers(explorer.address, prefers_reduced_motion="reduce")
    start = values(driver)
    # While the first design is still being planned, or just after it on a busy machine.
    click(driver, "design")
    text = driver.find_element(By.ID, "search-text").text
    assert text.startswith("Evaluating the design on screen") or "designs evaluated" in text, text
    clock = time.time()
    click(driver, "search-stop")
    until(driver, "!Explore.tools.search.running")
    assert time.time() - clock < 10
    assert "stopped" in driver.find_element(By.ID, "search-text").text
    click(driver, "design")
    until(driver, "Explore.map.state.path.length > 0")
    maps = run(driver, "return Explore.counts.map")
    click(driver, "search-stop")
    until(driver, "!Explore.tools.search.running")
    settled(driver)
    if values(driver) != start:
        # The map is another one, as other parameters moved too; the way of the search stays on it.
        until(driver, "Explore.counts.map > arguments[0]", maps)
    assert run(driver, "return Explore.map.state.path.length") > 0
    click(driver, "design")
    until(driver, "Explore.map.state.path.length > 0")
    driver.get("about:blank")
    # All work for the page ends soon: the process uses the processor no more.
    deadline = time.time() + LONG
    while True:
        before = explorer.processor()
        time.sleep(2)
        if explorer.processor() - before < 0.2:
            break
        assert time.time() < deadline, "it goes on computing for a page that was closed"
    # And a new page works.
    driver.get(explorer.address)
    settled(driver)


def test_roll_outs_are_threads_and_a_histogram(served, browsers):
    explorer = served(TASKS / "soft_gripper.toml")
    driver = browsers(explorer.address, prefers_reduced_motion="reduce")
    click(driver, "roll")
    until(driver, "Explore.tools.roll.costs.length + Explore.tools.roll.lost === 50")
    note = driver.find_element(By.ID, "rollouts-note").text
    assert note.startswith("50 of 50 roll-outs"), note
    keep(driver, "explore_rollouts")
    slide(driver, 0, 0.4)
    settled(driver)
    assert not driver.find_element(By.ID, "rollouts").is_displayed(), "roll-outs of another design stay on screen"
    quiet(driver)


def test_what_is_saved_is_read_by_the_program(served, browsers, tmp_path):
    task = tmp_path / "task.toml"
    shutil.copy(TASKS / "two_mass.toml", task)
    explorer = served(task)
    driver = browsers(explorer.address, prefers_reduced_motion="reduce")
    slide(driver, 0, 0.37)
    settled(driver)
    k1 = values(driver)[0]

    def saved(what):
        Select(driver.find_element(By.ID, "save")).select_by_value(what)
        notice = "document.querySelector('[data-kind=saved]')?.textContent"
        until(driver, f"!/Saving/.test({notice} ?? 'Saving')")
        text = run(driver, f"return {notice}")
        run(driver, "document.querySelector('[data-kind=saved] button').click()")
        return text.removesuffix("×").strip()

    option = saved("set").split(":")[1].split()
    assert option[0] == "--set" and float(option[1].removeprefix("k1=")) == k1
    new = Path(saved("task").removeprefix("Saved: "))
    assert new.parent == tmp_path and "# N/m: a number or a parameter's name" in new.read_text()
    folder = tmp_path / saved("result").removeprefix("Saved: ")
    report = tmp_path / saved("report").removeprefix("Saved: ")
    assert report.suffix == ".html" and report.stat().st_size > 100_000
    shown = subprocess.run([SUPPLE, "show", folder, "--json"], capture_output=True, text=True, check=False)
    found = json.loads(shown.stdout)
    assert found["parameters"]["k1"] == k1
    assert found["objective"]["information_bits"] == pytest.approx(numbers(driver)["measured"], rel=1e-9)
    # Noise that is turned goes along, and comments stay.
    slide(driver, knob(driver, "process noise"), 0.7)
    slide(driver, knob(driver, "cost limit"), 0.6)
    settled(driver)
    noisy = Path(saved("task").removeprefix("Saved: "))
    assert noisy != new and "# N/m: a number or a parameter's name" in noisy.read_text()
    done = subprocess.run([SUPPLE, "evaluate", noisy, "--json"], capture_output=True, text=True, check=False)
    (read,), (shown,) = json.loads(done.stdout)["tasks"], numbers(driver)["tasks"]
    assert read["cost"]["expected"] == pytest.approx(shown["expected"], rel=1e-9)
    assert read["information"]["total_bits"] == pytest.approx(shown["measured"], rel=1e-9)
    assert read["cost"]["bound"] == shown["bound"]
    assert "no options set cost limit = " in saved("set")
    # The result is explored again, at its design.
    again = browsers(served(folder).address)
    assert values(again)[0] == k1
    quiet(driver)


def percentile(list_, share):
    return sorted(list_)[min(len(list_) - 1, int(share * len(list_)))]


#: By how much a machine that does other things too may miss a goal.
BUSY = 20


def slack():
    """2 where nine tenths of the processors are idle before the test begins, as goals are for one machine that does nothing else."""

    def counters():
        fields = [int(field) for field in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
        return sum(fields), fields[3] + fields[4]

    all_before, idle_before = counters()
    time.sleep(2)
    all_after, idle_after = counters()
    idle = (idle_after - idle_before) / (all_after - all_before)
    return (2, "the machine is idle") if idle > 0.9 else (BUSY, f"the machine is {1 - idle:.0%} busy: {BUSY} times as much will do")


def stated(goals):
    """The goals, in the words of docs/explore.md."""
    page = (ROOT / "docs/explore.md").read_text()
    for goal in goals:
        assert goal in page, goal


@pytest.mark.parametrize("task, name, goal", [("two_mass.toml", "two masses", 50), ("iiwa_door.toml", "door", 250)])
def test_latency_from_slider_to_picture(served, browsers, task, name, goal, capsys):
    stated([f"| {name}: slider to picture, 95 % of moves | at most {goal} ms |"])
    factor, why = slack()
    explorer = served(TASKS / task)
    driver = browsers(explorer.address, prefers_reduced_motion="reduce")
    # Without a map beside it, which has a test of its own.
    run(driver, "document.getElementById('map').hidden = true; Explore.link.ask('stop', { what: 'map' })")
    for index in range(40):
        slide(driver, 0, 0.2 + 0.015 * index)
        settled(driver)
    times = run(driver, "return Explore.times")[5:]
    totals, computed = [one["total"] for one in times], [one["computed"] for one in times]
    line = (
        f"{task}: from slider to picture {statistics.median(totals):.0f} ms (median), {percentile(totals, 0.95):.0f} ms"
        f" (p95), of which computed {statistics.median(computed):.0f} ms; goal {goal} ms; {why}"
    )
    with capsys.disabled():
        print(f"\n{line}")
    assert len(totals) >= 30
    assert percentile(totals, 0.95) <= factor * goal, line


def test_the_page_stays_at_thirty_frames_a_second_while_a_map_fills(served, browsers, capsys):
    stated(["| door: frames while a map fills | at least 30 per second |"])
    factor, why = slack()
    explorer = served(TASKS / "iiwa_door.toml")
    driver = browsers(explorer.address)
    filled = "Explore.map.state.grid.size"
    until(driver, f"{filled} > 0 && document.getElementById('map-note').dataset.done === 'false'")
    before = run(driver, f"return {filled}")
    stamps = driver.execute_async_script("""
        const done = arguments[0], stamps = [];
        const frame = (now) => { stamps.push(now); now - stamps[0] < 3000 ? requestAnimationFrame(frame) : done(stamps); };
        requestAnimationFrame(frame);""")
    assert run(driver, f"return {filled}") > before, "the map did not fill meanwhile"
    gaps = [after - before for before, after in zip(stamps, stamps[1:], strict=False)]
    rate = 1000 * len(gaps) / (stamps[-1] - stamps[0])
    line = f"{rate:.0f} frames a second while a map fills, the longest {max(gaps):.0f} ms; goal 30 a second; {why}"
    with capsys.disabled():
        print(f"\n{line}")
    assert rate >= 30 / min(factor, 6), line


def test_ten_thousand_moves_leave_memory_bounded(served, browsers):
    explorer = served(TASKS / "two_mass_small.toml")
    driver = browsers(explorer.address, prefers_reduced_motion="reduce")
    run(driver, "document.getElementById('map').hidden = true")
    moves = """const done = arguments[arguments.length - 1];
      let n = 0;
      const some = () => {
        for (let k = 0; k < 100; k += 1, n += 1) Explore.design.move({ 0: Explore.valueAt(Explore.design.knobs[0], (n % 977) / 977) });
        if (n < 10000) setTimeout(some, 0); else done(n);
      };
      some();"""
    driver.set_script_timeout(LONG)
    settled(driver)
    before = explorer.resident()
    assert driver.execute_async_script(moves) == 10_000
    settled(driver)
    assert explorer.resident() - before < 100 << 20
    kept = run(driver, "const D = Explore.design; return D.trail.length + D.done.length + D.undone.length + Explore.times.length")
    assert kept < 5000
    quiet(driver)


def refused(url, **headers):
    request = urllib.request.Request(url, headers=headers)
    with pytest.raises(urllib.error.HTTPError) as caught:
        urllib.request.urlopen(request, timeout=60)
    return caught.value.code


def test_strangers_get_nothing(served):
    explorer = served(TASKS / "two_mass_small.toml")
    assert refused(explorer.base + "/") == 403
    assert refused(explorer.base + "/?token=0") == 403
    assert refused(explorer.base + "/file/main.js") == 403
    assert refused(explorer.address, Host="example.org") == 403
    assert refused(explorer.address, Origin="http://example.org") == 403
    assert refused(explorer.base + f"/channel?token={explorer.token}", Origin="http://example.org") == 403
    with urllib.request.urlopen(explorer.address, timeout=60) as page:
        assert page.status == 200


def test_nothing_is_fetched_from_elsewhere(served, browsers):
    explorer = served(TASKS / "two_mass_small.toml")
    driver = browsers(explorer.address)
    urls = [
        message["params"]["request"]["url"]
        for message in (json.loads(entry["message"])["message"] for entry in driver.get_log("performance"))
        if message["method"] == "Network.requestWillBeSent"
    ]
    own = (explorer.base, explorer.base.replace("http", "ws"), "data:", "blob:", "about:", "chrome")
    assert urls and [url for url in urls if not url.startswith(own)] == []


def test_a_page_without_its_program_is_dimmed_until_it_is_back(served, browsers):
    explorer = served(TASKS / "two_mass.toml")
    driver = start(1400, 1000, prefers_reduced_motion="reduce")
    try:
        # Keeps the page's channel, to break it.
        hold = """const Plain = WebSocket;
          window.WebSocket = class extends Plain { constructor(...given) { super(...given); window.channel = this; } };"""
        driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": hold})
        driver.get(explorer.address)
        settled(driver)
        dimmed = "return Number(getComputedStyle(document.getElementById('numbers').parentElement).opacity)"
        inert = "return [...document.querySelectorAll('.bar, #sliders, #map')].map((one) => one.inert)"
        notice = "return document.querySelector('[data-kind=lost]')?.textContent ?? ''"
        slide(driver, 0, 0.3)
        settled(driver)
        there = values(driver)
        assert run(driver, dimmed) == 1.0 and run(driver, inert) == [False] * 3
        run(driver, "window.channel.close()")
        until(driver, "document.body.classList.contains('lost')")
        assert run(driver, dimmed) < 0.6 and run(driver, inert) == [True] * 3
        assert "the dimmed values are outdated" in run(driver, notice)
        until(driver, "!document.body.classList.contains('lost')")
        settled(driver)
        assert values(driver) == there and run(driver, notice) == ""
        assert run(driver, dimmed) == 1.0 and run(driver, inert) == [False] * 3
        slide(driver, 0, 0.6)
        settled(driver)
        assert run(driver, "return Explore.now.values") == values(driver) != there
        # Short tasks are searched in less time than a call takes.
        assert run(driver, "document.getElementById('design').click(); return Explore.tools.search.running")
        explorer.process.kill()
        until(driver, "document.body.classList.contains('lost')")
        assert run(driver, dimmed) < 0.6 and "open the address that it prints" in run(driver, notice)
        assert not run(driver, "return Explore.tools.search.running")
        time.sleep(2)
        assert run(driver, "return document.body.classList.contains('lost')")
        keep(driver, "explore_lost")
    finally:
        driver.quit()


def test_a_run_that_diverges_does_not_flatten_its_panel(served, browsers):
    driver = browsers(served(TASKS / "two_mass.toml").address, prefers_reduced_motion="reduce")
    key = run(driver, "return Explore.design.tasks[0].quantities.find(({ group }) => group === 'States').key")
    panel = f"document.querySelector('.panel[data-key=\"{key}\"]')"
    until(driver, f"{panel}?.querySelector('canvas')")
    before = run(driver, f"return {panel}.querySelector('figcaption').textContent")
    assert "clipped" not in before
    # One point of the run far away, as where a closed loop loses its plan.
    run(
        driver,
        """const of = Explore.now.curves.curves.find(({ key }) => key === arguments[0]).series.find(({ role }) => role === 'truth');
           const values = new Float32Array(Explore.curves.unpack(of.y));
           values[values.length - 3] = 1e27;
           of.y = btoa(String.fromCharCode(...new Uint8Array(values.buffer)));
           Explore.curves.show();""",
        key,
    )
    assert "clipped: a run reaches 1e27" in run(driver, f"return {panel}.querySelector('figcaption').textContent")
    shown = run(driver, "return Explore.curves.range(arguments[0])", key)
    assert abs(shown[0]) < 100 and abs(shown[1]) < 100
    keep(driver, "explore_clipped")
    quiet(driver)


def test_arrows_of_forces_are_drawn_over_walls(served, browsers):
    driver = browsers(served(TASKS / "wiping_arm.toml").address, prefers_reduced_motion="reduce")
    until(driver, "document.querySelector('#scene .supple-scene-view')?.data !== undefined")
    traces = run(
        driver,
        """return document.querySelector('#scene .supple-scene-view').data.map(({ type, opacity, color, line }) =>
             [type, opacity ?? 1, color ?? line?.color ?? ''])""",
    )
    walls = [place for place, (kind, opacity, _) in enumerate(traces) if kind == "mesh3d" and opacity < 1]
    arrows = [place for place, (kind, _, color) in enumerate(traces) if kind == "scatter3d" and color.endswith(",0.99)")]
    # What is not opaque is drawn last, in this order and without hiding what follows.
    assert len(arrows) == 2 and walls and min(walls) < min(arrows)
    # The arm that presses is seen through wall and band.
    assert all(traces[place][1] <= 0.25 for place in walls), traces
    quiet(driver)


def test_marks_on_the_map_are_whole_at_the_ends_of_ranges(served, browsers):
    driver = browsers(served(TASKS / "two_mass_small.toml").address, prefers_reduced_motion="reduce")
    for index in (0, 1):
        slide(driver, index, 1.0)
    settled(driver)
    # The corner of the map is 12 pixels from the right edge and 9 from the top: what is seen there is outside of it.
    red = """(() => { const canvas = document.getElementById('map-canvas'), ratio = canvas.width / canvas.clientWidth;
      const at = [canvas.clientWidth - 12 + 3, 9 - 3].map((place) => Math.round(place * ratio));
      return [...canvas.getContext('2d').getImageData(...at, 1, 1).data]; })()"""
    until(driver, f"{red}.join() === '214,39,40,255'", why=run(driver, f"return {red}"))
    quiet(driver)


def test_the_view_fits_the_robot_and_tells_forces_apart(served, browsers):
    """Rails, by which the fingers could go much farther than they do, made the gripper tiny."""
    driver = browsers(served(TASKS / "soft_gripper.toml").address, prefers_reduced_motion="reduce")
    until(driver, "document.querySelector('#scene .supple-scene-view')?.data !== undefined")
    view = "document.querySelector('#scene .supple-scene-view')"
    scene = run(driver, f"return ['xaxis', 'yaxis', 'zaxis'].map((axis) => {view}._fullLayout.scene[axis].range)")
    bodies = run(
        driver,
        """const parts = { inside: [Infinity, -Infinity], all: [Infinity, -Infinity] };
           for (const body of Explore.now.scene.bodies) {
             const mesh = Explore.motion.surface(body.mesh), count = mesh.vertices.length / 3;
             const out = SuppleScene.geometry.coordinates(count);
             SuppleScene.geometry.place(mesh.vertices, body.position[0], body.rotation[0], out, 0);
             out.y.forEach((y, n) => {
               for (const part of n < count - (body.guides ?? 0) ? [parts.inside, parts.all] : [parts.all]) {
                 part[0] = Math.min(part[0], y);
                 part[1] = Math.max(part[1], y);
               }
             });
           }
           return parts;""",
    )
    (low, high), (inner, outer) = bodies["all"], bodies["inside"]
    assert low < scene[1][0] or high > scene[1][1], "the rails are within the box"
    assert scene[1][0] <= inner and outer <= scene[1][1], "the robot is not"
    colours = run(
        driver,
        f"""return {view}.data.filter(({{ type, line }}) => type === 'scatter3d' && line.color.endsWith(',0.99)'))
             .map(({{ line }}) => line.color)""",
    )
    assert len(colours) == 2 and len(set(colours)) == 2, colours
    legend = "document.querySelector('#scene .supple-scene-legend').textContent"
    for entry in ["moving bodies", "fixed bodies", "walls", "springs", "contact force on the robot", "spring force", "times as large"]:
        assert entry in run(driver, f"return {legend}"), entry
    # What is not shown is not in the legend.
    run(driver, "[...document.querySelectorAll('#scene label')].find((l) => l.textContent === 'Spring forces').click()")
    until(driver, f"!{legend}.includes('spring force')")
    quiet(driver)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_lines_of_robots_stand_out_from_the_page(served, browsers, scheme):
    driver = browsers(served(TASKS / "wiping_arm.toml").address, prefers_color_scheme=scheme, prefers_reduced_motion="reduce")
    until(driver, "document.querySelector('#scene .supple-scene-view')?.data !== undefined")
    colours, paper = run(
        driver,
        """const [bodies] = document.querySelector('#scene .supple-scene-view').data;
           return [[...new Set(bodies.facecolor)], getComputedStyle(document.body).backgroundColor];""",
    )

    def luminance(parts):
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (part / 255 for part in parts)]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    behind = luminance([int(part) for part in re.findall(r"\d+", paper)[:3]])
    for colour in colours:
        own = luminance([int(colour[n : n + 2], 16) for n in (1, 3, 5)])
        low, high = sorted([behind, own])
        # What WCAG asks of graphics.
        assert (high + 0.05) / (low + 0.05) >= 3, (colour, paper)


def test_a_taken_port_and_a_missing_browser_are_told(served, tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = subprocess.run(
            [SUPPLE, "explore", TASKS / "two_mass_small.toml", "--port", str(port), "--no-browser"],
            capture_output=True, text=True, timeout=LONG, check=False,
        )
    assert done.returncode == 2 and f"port {port}" in done.stderr and "--port" in done.stderr
    # Without anything that opens a browser, the address is printed and served all the same.
    environment = {"PATH": str(tmp_path), "HOME": str(tmp_path)}
    command = [SUPPLE, "explore", TASKS / "two_mass_small.toml"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    try:
        address = process.stdout.readline().strip()
        with urllib.request.urlopen(address, timeout=60) as page:
            assert page.status == 200
        assert "no browser could be started" in process.stderr.readline()
    finally:
        process.kill()
        process.wait()


def test_two_pages_do_not_disturb_each_other(served, browsers):
    explorer = served(TASKS / "two_mass.toml")
    one, other = browsers(explorer.address), browsers(explorer.address)
    slide(one, 0, 0.2)
    slide(other, 0, 0.9)
    settled(one)
    settled(other)
    assert values(one)[0] < values(other)[0]
    assert run(one, "return Explore.now.values[0]") == values(one)[0]
    assert run(other, "return Explore.now.values[0]") == values(other)[0]


def test_a_changed_task_file_is_offered_to_be_read_again(served, browsers, tmp_path):
    task = tmp_path / "task.toml"
    text = (TASKS / "two_mass_small.toml").read_text()
    task.write_text(text)
    driver = browsers(served(task).address)
    task.write_text(text.replace("bound = 25.0", "bound = oops"))
    button = "document.querySelector('[data-kind=changed] button')"
    until(driver, f"{button} !== null")
    run(driver, f"{button}.click()")
    until(driver, "document.querySelector('[data-kind=changed]')?.textContent.includes('cannot be read')")
    assert numbers(driver)["tasks"][0]["bound"] == 25.0
    task.write_text(text.replace("bound = 25.0", "bound = 31.0"))
    until(driver, "document.querySelector('[data-kind=changed]')?.textContent.startsWith('The task file was changed')")
    run(driver, f"{button}.click()")
    until(driver, "Explore.design.generation === 1")
    settled(driver)
    assert numbers(driver)["tasks"][0]["bound"] == 31.0


def test_a_design_that_cannot_be_planned_says_why_and_keeps_the_picture(served, browsers, tmp_path):
    text = (TASKS / "two_mass_small.toml").read_text()
    # A time step for which stiff springs are too fast.
    text = text.replace("time_step = 0.02 ", 'time_step = "dt" ')
    text += '\n[parameters.dt]\ninitial = 0.02\nbounds = [0.01, 10.0]\nscale = "log"\nrole = "study"\nunit = "s"\n'
    task = tmp_path / "task.toml"
    task.write_text(text)
    driver = browsers(served(task).address)
    curves = run(driver, "return JSON.stringify(Explore.now.curves)")
    slide(driver, knob(driver, "dt"), 1.0)
    settled(driver)
    verdict = driver.find_element(By.ID, "verdict")
    assert "did not converge" in verdict.text or "cannot be evaluated" in verdict.text, verdict.text
    assert driver.find_element(By.ID, "still").is_displayed()
    assert run(driver, "return JSON.stringify(Explore.now.curves)") == curves
    keep(driver, "explore_unplanned")
    click(driver, "reset")
    settled(driver)
    assert not driver.find_element(By.ID, "still").is_displayed()
    quiet(driver)


def chain(joints, parameters):
    """A planar arm of many joints, some of whose springs are parameters, and its task."""
    links = "".join(
        f'<link name="l{i}"><inertial><origin xyz="0.05 0 0"/><mass value="0.1"/>'
        f'<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        f'<joint name="j{i}" type="revolute"><parent link="{"base" if i == 0 else f"l{i - 1}"}"/><child link="l{i}"/>'
        f'<origin xyz="{0 if i == 0 else 0.1} 0 0"/><axis xyz="0 0 1"/><limit effort="10" velocity="10" lower="-3" upper="3"/>'
        f'<dynamics damping="0.5"/></joint>'
        for i in range(joints)
    )
    names = [f'"j{i}"' for i in range(joints)]
    springs = "".join(
        f'\n[[model.compliance]]\nkind = "spring"\nname = "s{i}"\njoint = "j{i}"\nstiffness = "k{i}"\ndamping = 0.1\n'
        f"\n[parameters.k{i}]\ninitial = 5.0\nbounds = [1.0, 50.0]\nscale = \"log\"\nunit = \"N m/rad\"\n"
        for i in range(parameters)
    )
    task = f"""
title = "A chain of {joints} joints"
[model]
kind = "robot"
file = "chain.urdf"
gravity = [0.0, 0.0, 0.0]
actuated = [{", ".join(names)}]
{springs}
[[model.sensors]]
kind = "joint_position"
select = [{", ".join(names)}]
variance = 1e-3
[[tasks]]
name = "bend"
steps = 20
time_step = 0.01
bound = 100.0
initial_state = {{ "q.j0" = 0.0 }}
[tasks.noise]
initial = {{ "q.*" = 1e-4, "v.*" = 1e-4 }}
process = {{ "q.*" = 1e-6, "v.*" = 1e-6 }}
[[tasks.costs]]
kind = "joint_position"
select = [{", ".join(names)}]
target = {json.dumps([0.1] * joints)}
weight = 1.0
[[tasks.costs]]
kind = "control"
weight = 1e-2
"""
    return f'<robot name="chain"><link name="base"/>{links}</robot>', task


@pytest.mark.parametrize("joints, parameters", [(40, 2), (30, 30)])
def test_many_joints_and_many_parameters(served, browsers, tmp_path, joints, parameters):
    urdf, task = chain(joints, parameters)
    (tmp_path / "chain.urdf").write_text(urdf)
    (tmp_path / "task.toml").write_text(task)
    driver = browsers(served(tmp_path / "task.toml").address, prefers_reduced_motion="reduce")
    assert len(driver.find_elements(By.CSS_SELECTOR, ".knob")) >= parameters
    slide(driver, parameters - 1, 0.9)
    settled(driver)
    assert numbers(driver)["planned"] and len(numbers(driver)["tasks"]) == 1
    keep(driver, f"explore_chain_{joints}_{parameters}")
    quiet(driver)


@pytest.mark.parametrize("width, height", [(360, 740), (800, 1000), (1400, 1000), (3840, 2160)])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_layout_and_names(served, browsers, width, height, scheme):
    driver = browsers(served(TASKS / "two_mass.toml").address, width, height, prefers_color_scheme=scheme)
    until(driver, "document.querySelectorAll('.panel canvas').length > 3")
    assert run(driver, "return document.documentElement.scrollWidth") <= width
    wider = run(
        driver,
        """return [...document.querySelectorAll("main section, main canvas, main select, main button, main input")]
             .filter((e) => e.getClientRects().length && e.getBoundingClientRect().right > innerWidth + 1).map((e) => e.id || e.className)""",
    )
    assert wider == []
    nameless = run(
        driver,
        """return [...document.querySelectorAll("select, button, input, canvas[tabindex], progress")].filter((one) =>
             one.getClientRects().length && !one.labels?.length && !one.getAttribute("aria-label") && !one.textContent.trim())
             .map((one) => one.outerHTML)""",
    )
    assert nameless == []
    paper = run(driver, "return getComputedStyle(document.body).backgroundColor")
    assert (paper == "rgb(255, 255, 255)") == (scheme == "light")
    keep(driver, f"explore_{width}_{scheme}")
    quiet(driver)


def test_reduced_motion_is_respected_and_the_robot_moves_when_asked(served, browsers):
    driver = browsers(served(TASKS / "two_mass.toml").address, prefers_reduced_motion="reduce")
    button = "document.querySelector('#scene .supple-scene-play')"
    until(driver, f"{button} !== null")
    time.sleep(1)
    assert run(driver, f"return {button}.textContent") == "Play"
    run(driver, f"{button}.click()")
    until(driver, "Number(document.querySelector('#scene').dataset.frame) > 0")
    run(driver, f"{button}.click()")
    drawn = run(driver, "return Number(document.querySelector('#scene').dataset.shown)")
    slide(driver, 0, 0.3)
    until(driver, f"Number(document.querySelector('#scene').dataset.shown) > {drawn}")
    quiet(driver)
