"""``task.explore()``: the page of ``supple explore``, served from the interpreter."""

from __future__ import annotations

import base64
import json
import os
import signal
import socket
import subprocess
import sys
import textwrap
import time
import types
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supple
from supple import explorer as module

ROOT = Path(__file__).parents[2]
SMALL = ROOT / "tasks/two_mass_small.toml"
LONG = 120


class Page:
    """An open page: what a browser does, without one."""

    def __init__(self, url: str) -> None:
        self.base, self.token = url.split("/?token=")
        host = self.base.removeprefix("http://")
        address, port = host.split(":")
        self.socket = socket.create_connection((address, int(port)), timeout=LONG)
        key = base64.b64encode(os.urandom(16)).decode()
        head = {"Host": host, "Origin": self.base, "Upgrade": "websocket", "Connection": "Upgrade"}
        head |= {"Sec-WebSocket-Key": key, "Sec-WebSocket-Version": "13"}
        lines = [f"GET /channel?token={self.token} HTTP/1.1", *(f"{name}: {value}" for name, value in head.items())]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self.stream = self.socket.makefile("rb")
        assert b"101" in self.stream.readline()
        while self.stream.readline().strip():
            pass
        self.hello = self.next("hello")
        self.values = [knob["start"] for knob in self.hello["knobs"]]

    def next(self, kind: str) -> dict[str, Any]:
        """The next message of a kind."""
        while True:
            first, length = self.stream.read(2)
            if length in (126, 127):
                length = int.from_bytes(self.stream.read(2 if length == 126 else 8), "big")
            text = self.stream.read(length)
            if first & 15 == 1:
                message: dict[str, Any] = json.loads(text)
                if message["kind"] == kind:
                    return message

    def turn(self, **knobs: float) -> dict[str, Any]:
        """Moves sliders, and waits for the design on screen."""
        names = [knob["name"] for knob in self.hello["knobs"]]
        for name, value in knobs.items():
            self.values[names.index(name)] = value
        body = {"view": "evaluate", "id": 1, "generation": self.hello["generation"], "values": self.values}
        request = urllib.request.Request(
            f"{self.base}/ask?page={self.hello['page']}&token={self.token}",
            data=json.dumps(body).encode(),
            headers={"Origin": self.base},
        )
        urllib.request.urlopen(request, timeout=LONG).close()
        return self.next("evaluate")


@pytest.fixture
def small() -> Iterator[supple.Explorer]:
    with supple.load(SMALL).explore(browser=False) as explorer:
        yield explorer


def status(url: str) -> int:
    try:
        with urllib.request.urlopen(url, timeout=LONG) as page:
            return int(page.status)
    except urllib.error.HTTPError as error:
        return error.code


def test_the_page_is_served_until_it_is_closed() -> None:
    task = supple.load(SMALL)
    with task.explore(browser=False, k1=44.0) as explorer:
        assert status(explorer.url) == 200 and status(explorer.url.split("token")[0]) == 403
        assert explorer.design == {**task.values, "k1": 44.0}
        assert (explorer.limits, explorer.noise, explorer.closed) == ({}, {}, False)
        assert explorer.url in repr(explorer) and "k1" in explorer._repr_html_()
    assert explorer.closed and explorer.design["k1"] == 44.0 and "closed" in repr(explorer)
    explorer.close()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(explorer.url, timeout=LONG)


def test_what_is_on_screen_is_a_task_here(small: supple.Explorer) -> None:
    page = Page(small.url)
    answer = page.turn(k1=33.0)["designs"][0]["numbers"]["tasks"][0]
    assert small.design["k1"] == 33.0
    task = small.task()
    assert task.values["k1"] == 33.0 and task._recipe == ("load", str(SMALL))
    assert task.evaluate(rollouts=0).information.bits == answer["measured"]


def test_limits_and_noise_go_along(small: supple.Explorer) -> None:
    page = Page(small.url)
    turned = {"k1": 33.0, "cost limit": 27.0, "process noise": 1.5, "initial uncertainty": 0.5}
    answer = page.turn(**turned)["designs"][0]["numbers"]["tasks"][0]
    assert small.limits == {"cost limit": 27.0}
    assert small.noise == {"initial uncertainty": 0.5, "process noise": 1.5}
    found = small.task().evaluate(rollouts=0).tasks["press"]
    assert (found.cost.bound, answer["bound"]) == (27.0, 27.0)
    np.testing.assert_allclose(found.cost.expected, answer["expected"], rtol=1e-12)
    np.testing.assert_allclose(found.information.total_bits, answer["measured"], rtol=1e-12)
    plain = supple.load(SMALL).evaluate(k1=33.0, rollouts=0).tasks["press"]
    assert abs(found.cost.expected / plain.cost.expected - 1.0) > 1e-3


def own(fails: list[bool]) -> supple.Task:
    def step(x: Any, u: Any, p: Any) -> Any:
        if fails[0]:
            raise ValueError("the spring is broken")
        return np.stack([x[:, 0] + 0.1 * x[:, 1], x[:, 1] - 0.1 * p.k * x[:, 0] + 0.1 * u[:, 0]], axis=1)

    model = supple.Model(
        states=["x", "v"],
        controls=["u"],
        measurements=["y"],
        parameters={"k": supple.Parameter(1.0, (0.1, 10.0))},
        step=step,
        observe=lambda x, p: x[:, :1],
        cost=lambda x, u, p: 0.5 * (x**2).sum(axis=1) + 0.5 * (u**2).sum(axis=1),
        final_cost=lambda x, p: 5.0 * (x**2).sum(axis=1),
        backend="numpy",
    )
    noise = supple.Noise(initial=[1e-2, 1e-2], process=[1e-4, 1e-4], measurement=[1e-3])
    return model.task(steps=10, time_step=0.1, initial_state=[1.0, 0.0], initial_control=[0.0], noise=noise, bound=50.0)


def test_models_in_python_are_explored_and_their_exceptions_told() -> None:
    fails = [False]
    with own(fails).explore(browser=False) as explorer:
        page = Page(explorer.url)
        answer = page.turn(k=2.0)["designs"][0]["numbers"]["tasks"][0]
        assert explorer.task().evaluate(rollouts=0).information.bits == pytest.approx(answer["measured"], rel=1e-9)
        fails[0] = True
        assert "the spring is broken" in page.turn(k=3.0)["error"]
        fails[0] = False
        assert page.turn(k=4.0)["designs"][0]["numbers"]["planned"]
        page.turn(**{"process noise": 2.0})
        with pytest.raises(supple.UsageError, match="process noise"):
            explorer.task()


def test_a_taken_port_and_one_that_is_none() -> None:
    task = supple.load(SMALL)
    with task.explore(browser=False) as first:
        port = int(first.url.split(":")[2].split("/")[0])
        with pytest.raises(supple.UsageError, match=rf"port {port} cannot be used: .*port="):
            task.explore(port=port, browser=False)
    with pytest.raises(supple.UsageError, match="from 1 to 65535"):
        task.explore(port=70000)


def test_without_a_display_the_address_is_printed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with supple.load(SMALL).explore() as explorer:
        said = capsys.readouterr()
        assert said.out == f"{explorer.url}\n" and "there is no display" in said.err
        monkeypatch.setenv("DISPLAY", ":0")
        opened: list[str] = []
        monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) is None)
        module._open(explorer.url)
        assert opened == [explorer.url] and capsys.readouterr().err == ""
        with pytest.raises(supple.UsageError, match="no notebook"):
            explorer.show()


def test_in_notebooks_it_is_a_frame(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    shown: list[tuple[Any, ...]] = []
    display = types.ModuleType("IPython.display")
    display.__dict__.update(IFrame=lambda *given, **_: given, display=shown.append)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    monkeypatch.setattr(module, "_in_notebook", lambda: True)
    with supple.load(SMALL).explore() as explorer:
        explorer.show(height=300)
        assert shown == [(explorer.url, "100%", 900), (explorer.url, "100%", 300)] and capsys.readouterr().out == ""


@pytest.mark.timeout(LONG)
def test_a_real_notebook_shows_it() -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    source = f"import supple\nexplorer = supple.load({str(SMALL)!r}).explore()"
    cells = [nbformat.v4.new_code_cell(source), nbformat.v4.new_code_cell("explorer.close(); explorer.closed")]
    notebook = nbformat.v4.new_notebook(cells=cells)
    nbclient.NotebookClient(notebook, timeout=LONG, kernel_name="python3").execute()
    shown = [output["data"]["text/html"] for output in notebook.cells[0].outputs if "data" in output]
    (found,) = notebook.cells[0].outputs
    assert len(shown) == 1 and "<iframe" in shown[0] and 'src="http://127.0.0.1:' in shown[0], found
    assert notebook.cells[1].outputs[0]["data"]["text/plain"] == "True"


def run(script: str) -> subprocess.Popen[str]:
    text = f"import supple\nexplorer = supple.load({str(SMALL)!r}).explore(browser=False)\n" + textwrap.dedent(script)
    return subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_it_ends_with_the_interpreter() -> None:
    process = run("print(explorer.url)")
    out, err = process.communicate(timeout=LONG)
    assert process.returncode == 0 and out.startswith("http://127.0.0.1:") and err == ""


@pytest.mark.skipif(os.name == "nt", reason="sends SIGINT")
def test_ctrl_c_ends_the_waiting_and_nothing_else() -> None:
    script = """
    import signal, time, urllib.request
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        print("ready", flush=True)
        time.sleep(100)
    except KeyboardInterrupt:
        print(urllib.request.urlopen(explorer.url).status, flush=True)
    explorer.wait()
    print(explorer.closed, explorer.design["k1"])
    """
    process = run(script)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    assert process.stdout.readline() == "200\n"
    # It may not wait yet.
    time.sleep(1)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=LONG)
    assert process.returncode == 0 and out.startswith("True ") and err == ""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_child_leaves_the_page_alone(small: supple.Explorer) -> None:
    child = os.fork()
    if child == 0:
        code = 1
        try:
            small.close()
            supple.load(SMALL).explore(browser=False)
        except supple.UsageError as error:
            code = 0 if "forked" in str(error) else 2
        finally:
            os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert not small.closed and status(small.url) == 200
