"""The work of a worker process: units of a study, many per call, each from bytes to bytes."""

from __future__ import annotations

import hashlib
import pickle
import signal
import socket
import threading
import time
import zlib
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ._supple import Units, __version__, instructions, use_instructions
from .errors import UsageError

if TYPE_CHECKING:
    from .task import Task

__all__ = ["Answer", "Context", "context", "deaf", "hello", "work"]

#: Number of studies that a worker caches.
KEPT = 8

_READY: OrderedDict[str, Units] = OrderedDict()
_LOCK = threading.Lock()


@dataclass(frozen=True)
class Context:
    """Data that all units of a study share.

    Attributes:
        version: The version of supple in the calling process.
        instructions: Its vector instructions; other instructions round differently.
        key: Identifies the study.
        payload: The packed task and study.
    """

    version: str
    instructions: str
    key: str
    payload: bytes


@dataclass(frozen=True)
class Answer:
    """The outcome of units.

    Attributes:
        refusal: Why this worker cannot run units of the study; empty if it can.
        missing: Whether the study has to be sent to it.
        found: The bytes of the result of each unit.
        seconds: Their duration, s.
        busy: Core time that they took, s; less than ``seconds`` if the core had other work.
    """

    refusal: str = ""
    missing: bool = False
    found: tuple[bytes, ...] = ()
    seconds: float = 0.0
    busy: float = 0.0


def context(task: Task, shared: bytes) -> Context:
    """The data that the units of a study share; ``shared`` is the study in the form of its collector.

    Raises:
        UsageError: If the task cannot be pickled.
    """
    packed = zlib.compress(pickle.dumps((_pickled(task), shared)))
    return Context(__version__, instructions(), hashlib.sha256(packed).hexdigest(), packed)


def _pickled(task: Task) -> bytes:
    dumps = pickle.dumps
    if task._recipe[0] == "own":
        try:
            # Functions of scripts and notebooks, and lambdas, are sent by value.
            import cloudpickle

            dumps = cloudpickle.dumps
        except ImportError:
            pass
    try:
        return dumps(task)
    except Exception as error:
        raise UsageError(
            f"the task cannot be sent to workers: {type(error).__name__}: {error}; let its functions use only what can "
            "be pickled, define them in a module that workers can import, or install cloudpickle for those of scripts "
            "and notebooks"
        ) from error


def hello(version: str, wanted: str) -> str:
    """Why this worker cannot work for a process with this version and these instructions; empty if it can."""
    where = f"the worker on {socket.gethostname()}"
    if version != __version__:
        return f"{where} has supple {__version__}, this process {version}: install the same version on both"
    if not use_instructions(wanted):
        return (
            f"{where} computes with {instructions()} instructions, this process with {wanted}: numbers would differ "
            f'by rounding; call supple.executors.use_instructions("{instructions()}") before, or use workers of one '
            "kind"
        )
    return ""


def deaf() -> None:
    """Leaves Ctrl-C to the calling process, which ends this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def work(version: str, wanted: str, key: str, payload: bytes | None, units: list[bytes], nonce: str) -> Answer:
    """Runs units of the study with this key.

    Args:
        version: The version of supple in the calling process.
        wanted: The instructions that it uses.
        key: Identifies the study.
        payload: The study; ``None`` if the worker may already have it.
        units: The units.
        nonce: Makes calls distinct for schedulers that merge equal calls.
    """
    refusal = hello(version, wanted)
    if refusal:
        return Answer(refusal=refusal)
    ready = _ready(key, payload)
    if ready is None:
        return Answer(missing=True)
    clock, core = time.perf_counter(), time.process_time()
    found = tuple(ready.work(units))
    seconds, busy = time.perf_counter() - clock, time.process_time() - core
    return Answer(found=found, seconds=seconds, busy=min(seconds, busy))


def _ready(key: str, payload: bytes | None) -> Units | None:
    with _LOCK:
        ready = _READY.get(key)
        if ready is None and payload is not None:
            pickled, shared = pickle.loads(zlib.decompress(payload))
            ready = _READY[key] = Units(pickle.loads(pickled)._native, shared)
            while len(_READY) > KEPT:
                _READY.popitem(last=False)
        if ready is not None:
            _READY.move_to_end(key)
        return ready
