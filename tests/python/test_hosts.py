"""A cluster of several hosts, each a network namespace of this machine: nothing is shared but the network."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import supple

pytestmark = pytest.mark.timeout(240)

HOSTS = 2


def run(*words: str) -> None:
    subprocess.run(words, check=True, capture_output=True)


@pytest.fixture
def hosts() -> Iterator[tuple[str, list[str]]]:
    """The address of this host, and the names of others that it has a link to each."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0 or shutil.which("ip") is None:
        pytest.skip("network namespaces need root and the program ip")
    mark = f"{os.getpid() % 100000:x}"
    names = [f"supple{mark}h{number}" for number in range(HOSTS)]
    bridge = f"sb{mark}"
    try:
        run("ip", "link", "add", bridge, "type", "bridge")
    except subprocess.CalledProcessError as error:
        pytest.skip(f"network namespaces cannot be made here: {error.stderr.decode()}")
    try:
        run("ip", "addr", "add", "10.213.7.1/24", "dev", bridge)
        run("ip", "link", "set", bridge, "up")
        for number, name in enumerate(names):
            here, there = f"sv{mark}{number}", f"sw{mark}{number}"
            run("ip", "netns", "add", name)
            run("ip", "link", "add", here, "type", "veth", "peer", "name", there)
            run("ip", "link", "set", here, "master", bridge, "up")
            run("ip", "link", "set", there, "netns", name)
            run("ip", "-n", name, "addr", "add", f"10.213.7.{number + 2}/24", "dev", there)
            run("ip", "-n", name, "link", "set", there, "up")
            run("ip", "-n", name, "link", "set", "lo", "up")
        yield "10.213.7.1", names
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "del", name], capture_output=True)
        subprocess.run(["ip", "link", "del", bridge], capture_output=True)


def test_a_host_may_be_lost(hosts: tuple[str, list[str]], tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    address, names = hosts
    task = supple.load("tasks/two_mass.toml")
    grid = {"k1": "log:60:600:20", "k2": "log:100:600:40"}
    serial = task.sweep(grid).to_json()
    workers: list[subprocess.Popen[bytes]] = []
    options = {"n_workers": 0, "host": address, "dashboard_address": None}
    try:
        with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
            for number, name in enumerate(names):
                folder = tmp_path / name
                folder.mkdir()
                worker = [sys.executable, "-m", "distributed.cli.dask_worker", cluster.scheduler_address]
                worker += ["--nthreads", "1", "--host", f"10.213.7.{number + 2}", "--no-dashboard"]
                command = ["ip", "netns", "exec", name, *worker]
                path = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
                said = subprocess.DEVNULL
                workers.append(subprocess.Popen(command, cwd=folder, env=path, start_new_session=True, stderr=said))
            client.wait_for_workers(HOSTS, timeout=60)
            addresses = sorted(client.scheduler_info(n_workers=-1)["workers"])
            assert [address.split(":")[1] for address in addresses] == ["//10.213.7.2", "//10.213.7.3"]

            class Losing:
                done, lost = 0, False

                def begin(self, what: str, done: int, total: int) -> None:
                    assert (done, total) == (0, 800)

                def advance(self, parts: int) -> None:
                    self.done += parts
                    if self.done >= 200 and not self.lost:
                        self.lost = True
                        os.killpg(workers[0].pid, signal.SIGKILL)

                def say(self, message: str) -> None:
                    pass

            seen = Losing()
            with client.get_executor() as pool:
                # Hosts know neither the task's files nor the folder that it was named from.
                found = task.sweep(grid, executor=pool, out=tmp_path / "out", progress=seen)
            assert found.to_json() == serial and seen.lost and seen.done == 800
    finally:
        for process in workers:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            process.wait()
        time.sleep(0.1)
