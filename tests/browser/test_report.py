"""What a reader of a report sees and can do."""

import base64
import json
import os
import time
from pathlib import Path

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select, WebDriverWait

from conftest import PATIENCE, SECTIONS, keep


def wait(driver, what):
    return WebDriverWait(driver, PATIENCE).until(lambda d: d.execute_script(f"return {what}"))


def draw_all(driver):
    """Scrolls by all plots, so that each is drawn."""
    for figure in driver.find_elements(By.CSS_SELECTOR, "figure.plot"):
        driver.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", figure)
        WebDriverWait(driver, PATIENCE).until(
            lambda d, f=figure: d.execute_script("return arguments[0].querySelector('.canvas')._fullLayout != null", f)
        )


def test_every_section_is_there_and_linked(wide):
    found = [s.get_attribute("aria-labelledby") for s in wide.find_elements(By.CSS_SELECTOR, "main section")]
    assert found == SECTIONS
    links = [a.get_attribute("href").split("#")[1] for a in wide.find_elements(By.CSS_SELECTOR, "nav a")]
    assert links == SECTIONS


def test_headings_are_in_order(wide):
    levels = wide.execute_script("return [...document.querySelectorAll('h1,h2,h3,h4')].map(h => +h.tagName[1])")
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after <= before + 1 for before, after in zip(levels, levels[1:]))


def drawn(driver):
    """Title, number of traces, whether they have data, label, number of pictures and of legend entries, of each view."""
    draw_all(driver)
    return driver.execute_script("""
      const filled = (value) => Array.isArray(value) || ArrayBuffer.isView(value)
        ? [...value].some((v) => (Array.isArray(v) ? v.some(Number.isFinite) : v !== null && v !== undefined)) : false;
      const out = [];
      for (const figure of document.querySelectorAll('figure.plot')) {
        const canvas = figure.querySelector('.canvas'), select = figure.querySelector('select');
        for (let view = 0; view < (select ? select.options.length : 1); view += 1) {
          if (select) { select.value = String(view); select.dispatchEvent(new Event('change')); }
          const title = figure.querySelector('.title').textContent + ' / ' + (select?.selectedOptions[0].text ?? '');
          out.push([title, canvas.data.length, canvas.data.some((t) => filled(t.z ?? t.y)),
                    canvas.getAttribute('aria-label'), canvas.querySelectorAll('svg').length,
                    canvas.querySelectorAll('.legend .traces').length]);
        }
        if (select) { select.value = '0'; select.dispatchEvent(new Event('change')); }
      }
      return out;""")


def assert_drawn(driver):
    views = drawn(driver)
    for title, traces, has_data, label, pictures, entries in views:
        assert entries <= 8, (title, entries)
        assert traces > 0 and has_data and pictures > 0, title
        assert any(letter.isdigit() for letter in label) and label.endswith("."), (title, label)
    return [title for title, *_ in views]


def test_every_plot_is_drawn_with_its_data_in_every_view(wide):
    assert len(assert_drawn(wide)) > 20


def test_choices_from_catalogues_are_told_and_drawn(open_page, choices):
    driver = open_page(page=choices)
    sections = {s.get_attribute("aria-labelledby"): s for s in driver.find_elements(By.CSS_SELECTOR, "main section")}
    assert len(assert_drawn(driver)) > 10
    for kind, told in [("sensors", "position of m1"), ("catalogue", "3 of 3 combinations")]:
        section = next(section for name, section in sections.items() if name.endswith(kind))
        driver.execute_script("arguments[0].scrollIntoView({behavior: 'instant'})", section)
        keep(driver, kind)
        assert told in section.text, section.text
    assert [entry for entry in driver.get_log("browser") if entry["level"] == "SEVERE"] == []


def test_nothing_fails_and_nothing_is_fetched(wide):
    draw_all(wide)
    # Other levels are the browser's advice on speed.
    assert [entry for entry in wide.get_log("browser") if entry["level"] == "SEVERE"] == []
    requests = [
        message["params"]["request"]["url"]
        for message in (json.loads(entry["message"])["message"] for entry in wide.get_log("performance"))
        if message["method"] == "Network.requestWillBeSent"
    ]
    assert [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []


def test_controls_work_by_keyboard_alone(wide):
    wide.execute_script("document.activeElement.blur(); window.scrollTo(0, 0)")
    figure = wide.find_element(By.XPATH, "//figure[contains(., 'Plan, true state and estimate')]")
    canvas, select = figure.find_element(By.CSS_SELECTOR, ".canvas"), figure.find_element(By.TAG_NAME, "select")
    before = canvas.get_attribute("aria-label")
    for _ in range(300):
        ActionChains(wide).send_keys(Keys.TAB).perform()
        active = wide.switch_to.active_element
        outline = active.value_of_css_property("outline-style")
        # Before the first control and after the last one, the page itself has the focus.
        assert outline != "none" or active.tag_name == "body", f"no focus to be seen on {active.get_attribute('outerHTML')[:200]}"
        if active == select:
            break
    assert wide.switch_to.active_element == select
    ActionChains(wide).send_keys(Keys.ARROW_DOWN).send_keys(Keys.ENTER).perform()
    WebDriverWait(wide, 60).until(lambda _: canvas.get_attribute("aria-label") != before)
    assert Select(select).first_selected_option.text in canvas.get_attribute("aria-label")


def test_every_control_has_a_name(wide):
    nameless = wide.execute_script("""
      return [...document.querySelectorAll('select, button, input')].filter((control) =>
        !control.labels?.length && !control.getAttribute('aria-label') && !control.textContent.trim()).length""")
    assert nameless == 0


def picture(driver, element):
    return base64.b64decode(element.screenshot_as_base64)


def test_the_robot_is_drawn_and_moves(wide):
    view = wide.find_element(By.CSS_SELECTOR, "[data-scene]")
    wide.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", view)
    wait(wide, "document.querySelector('[data-scene] canvas') !== null")
    button, slider = view.find_element(By.TAG_NAME, "button"), view.find_element(By.CSS_SELECTOR, "input[type=range]")
    frame = lambda: view.get_attribute("data-frame")
    becomes = lambda text: WebDriverWait(wide, PATIENCE).until(lambda _: button.text == text, f"it does not say {text}")
    # It plays by itself as soon as it is seen: a press before that would stop it.
    becomes("Pause")
    button.send_keys(Keys.SPACE)
    becomes("Play")
    rest = frame()
    time.sleep(1.0)
    assert frame() == rest, "it does not stop"
    button.send_keys(Keys.SPACE)
    WebDriverWait(wide, PATIENCE).until(lambda _: frame() != rest, "it does not go on")
    # Pictures are taken at rest: a browser without a graphics card that draws all the time may be late with them.
    slider.send_keys(Keys.HOME)
    becomes("Play")
    assert frame() == "0"
    first = picture(wide, view)
    slider.send_keys(Keys.END)
    assert frame() == slider.get_attribute("max")
    WebDriverWait(wide, PATIENCE).until(lambda _: picture(wide, view) != first, "nothing moves")
    keep(wide, "motion")
    colours = wide.execute_script("""
      const plot = document.querySelector('[data-scene] .js-plotly-plot, [data-scene].js-plotly-plot');
      return Plotly.toImage(plot, {format: 'png', width: 300, height: 200}).then((url) => new Promise((done) => {
        const image = new Image();
        image.onload = () => {
          const canvas = document.createElement('canvas');
          [canvas.width, canvas.height] = [300, 200];
          const context = canvas.getContext('2d');
          context.drawImage(image, 0, 0, 300, 200);
          const seen = new Set();
          const { data } = context.getImageData(0, 0, 300, 200);
          for (let i = 0; i < data.length; i += 4) seen.add(data.slice(i, i + 4).join());
          done(seen.size);
        };
        image.src = url;
      }));""")
    assert colours > 50, "the picture is empty"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_colours_follow_the_system_and_the_reader(open_page, scheme):
    driver = open_page(prefers_color_scheme=scheme)
    paper = lambda: driver.execute_script("return getComputedStyle(document.body).backgroundColor")
    draw_all(driver)
    plots = lambda: driver.execute_script(
        "return [...new Set([...document.querySelectorAll('.canvas')].map((c) => c._fullLayout.paper_bgcolor))]"
    )
    first = (paper(), plots())
    assert len(first[1]) == 1
    keep(driver, scheme)
    other = "dark" if scheme == "light" else "light"
    Select(driver.find_element(By.ID, "theme")).select_by_value(other)
    wait(driver, f"document.querySelector('.canvas')._fullLayout.paper_bgcolor !== '{first[1][0]}'")
    draw_all(driver)
    assert paper() != first[0] and len(plots()) == 1 and plots() != first[1]


def test_a_phone_needs_no_scrolling_sideways(open_page):
    driver = open_page(360, 740)
    draw_all(driver)
    width = driver.execute_script("return document.documentElement.scrollWidth")
    keep(driver, "phone")
    assert width <= 360
    wider = driver.execute_script("""
      return [...document.querySelectorAll('main svg.main-svg, main select, main button')]
        .filter((e) => e.getBoundingClientRect().right > 361).length""")
    assert wider == 0
    assert driver.execute_script("return document.querySelector('nav details').open") is False


def test_a_print_has_all_plots_in_light_colours(open_page):
    driver = open_page(prefers_color_scheme="dark")
    driver.execute_script("addEventListener('afterprint', () => { window.printed = true; })")
    driver.execute_script("""
      const kept = window.kept = [];
      addEventListener('beforeprint', () => {
        for (const c of document.querySelectorAll('.canvas')) kept.push([c._fullLayout?.paper_bgcolor, c._fullLayout?.width]);
        kept.push([document.querySelectorAll('main details:not([open])').length]);
      });""")
    pages = base64.b64decode(driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})["data"])
    if os.environ.get("SCREENSHOTS"):
        Path(os.environ["SCREENSHOTS"], "print.pdf").write_bytes(pages)
    assert pages.startswith(b"%PDF") and pages.count(b"/Type /Page\n") + pages.count(b"/Type /Page ") > 5
    *plots, (closed,) = driver.execute_script("return window.kept")
    assert closed == 0 and len(plots) > 5
    assert all(colour == "#ffffff" and width <= 700 for colour, width in plots)


#: Colours of a picture that is the source of an image, by how many of its pixels have them.
COLOURS_OF = """
  const image = arguments[0], canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [300, 200];
  const context = canvas.getContext('2d'), seen = new Map();
  context.fillStyle = '#ffffff';
  context.fillRect(0, 0, 300, 200);
  context.drawImage(image, 0, 0, 300, 200);
  const { data } = context.getImageData(0, 0, 300, 200);
  for (let i = 0; i < data.length; i += 4) {
    const key = data.slice(i, i + 3).join();
    seen.set(key, (seen.get(key) ?? 0) + 1);
  }
  return [...seen];"""


def test_a_print_has_a_picture_of_the_robot_in_light_colours(open_page):
    """The view was blank in print: browsers do not keep what WebGL has drawn."""
    driver = open_page(prefers_color_scheme="dark", prefers_reduced_motion="reduce")
    wait(driver, "document.querySelector('[data-scene]')?.dataset.drawn >= 1")
    driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})
    pictures = driver.find_elements(By.CSS_SELECTOR, "[data-scene] .supple-scene-print img")
    assert pictures
    for image in pictures:
        # The moment of the greatest force, where the reader has not chosen another one.
        assert " at 0.00 s" not in image.get_attribute("alt")
        WebDriverWait(driver, PATIENCE).until(lambda d, i=image: d.execute_script("return arguments[0].naturalWidth > 0", i))
        colours = driver.execute_script(COLOURS_OF, image)
        assert len(colours) > 50, "the picture is empty"
        assert max(colours, key=lambda one: one[1])[0] == "255,255,255"
    # Seen in print only, where the view and its controls are not.
    shown = "return getComputedStyle(document.querySelector(arguments[0])).display !== 'none'"
    parts = ["[data-scene] .supple-scene-print", "[data-scene] .supple-scene-view", "[data-scene] .supple-scene-controls"]
    assert [driver.execute_script(shown, part) for part in parts] == [False, True, True]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert [driver.execute_script(shown, part) for part in parts] == [True, False, False]


def test_the_view_of_the_robot_follows_the_theme_and_has_a_legend(open_page):
    driver = open_page(prefers_color_scheme="light", prefers_reduced_motion="reduce")
    wait(driver, "document.querySelector('[data-scene]')?.dataset.drawn >= 1")
    legend = lambda: driver.find_element(By.CSS_SELECTOR, "[data-scene] .supple-scene-legend").get_attribute("textContent")
    for entry in ["bodies of start", "walls", "springs (coils)", "contact force on the robot (thick arrows): ", "standard deviations"]:
        assert entry in legend(), legend()
    text = "document.querySelector('[data-scene] .supple-scene-view')._fullLayout.scene.xaxis.color"
    light = driver.execute_script(f"return {text}")
    Select(driver.find_element(By.ID, "theme")).select_by_value("dark")
    wait(driver, f"{text} !== '{light}'")


def test_those_who_want_less_motion_get_a_robot_at_rest(open_page):
    driver = open_page(prefers_reduced_motion="reduce")
    view = driver.find_element(By.CSS_SELECTOR, "[data-scene]")
    driver.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", view)
    wait(driver, "document.querySelector('[data-scene] canvas') !== null")
    time.sleep(2)
    frame = view.get_attribute("data-frame")
    time.sleep(2)
    assert view.get_attribute("data-frame") == frame
