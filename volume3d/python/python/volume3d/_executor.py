"""Work in other processes and on other machines, through executors of `concurrent.futures`.

Tasks of one `map` share a worker: an object with a method `run`, such as a scene with what is done to it. It is
pickled, and travels once to each process: a task carries its name only, a process that does not know it says so,
and the task is then sent again together with it.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import platform
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from typing import Any, Protocol

from ._core import Error, __version__, set_num_threads

#: How often a task is submitted again after the process that ran it has died.
RETRIES = 5

#: Workers that a process keeps, the last used.
KEPT = 4

#: Exceptions that say that a process died or that its task was dropped, by the names of their classes and base
#: classes: of the standard library, Dask and Ray.
_DEATHS = {"BrokenExecutor", "CancelledError", "KilledWorker", "CommClosedError", "WorkerCrashedError"}


class Worker(Protocol):
    """What the tasks of one `map` have in common."""

    def prepare(self) -> None:
        """Called in every process before the first task."""

    def run(self, task: Any, /) -> Any:
        """The result of a task."""


class Shared:
    """A worker, which is pickled when it is first sent.

    `token` names it in other processes; by default it is the hash of the pickle.
    """

    def __init__(self, worker: Worker, token: str | None = None) -> None:
        self.worker, self._token = worker, token
        self.process = _process()
        self._payload: bytes | None = None

    @property
    def payload(self) -> bytes:
        """The pickle."""
        if self._payload is None:
            self._payload = pickle.dumps(self.worker, protocol=5)
        return self._payload

    @property
    def token(self) -> str:
        """The name."""
        if self._token is None:
            self._token = hashlib.sha256(self.payload).hexdigest()
        return self._token


#: Workers that are ready in this process, by token, and those that it sends itself.
_ready: OrderedDict[str, Worker] = OrderedDict()
_own: weakref.WeakValueDictionary[str, Shared] = weakref.WeakValueDictionary()
_lock = threading.Lock()
_id = os.urandom(8).hex()


def _unlock() -> None:
    global _lock
    _lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    # A thread of the parent may hold the lock, and does not exist in the child.
    os.register_at_fork(after_in_child=_unlock)


def _process() -> str:
    """A name of this process that no other one has, on any machine."""
    return f"{_id}-{os.getpid()}"


def _find(token: str, payload: bytes | None) -> Worker | None:
    with _lock:
        worker = _ready.pop(token, None)
        if worker is None:
            own = _own.get(token)
            if own is not None and own.process == _process():
                worker = own.worker
            elif payload is not None:
                worker = pickle.loads(payload)
            else:
                return None
            worker.prepare()
        _ready[token] = worker
        while len(_ready) > KEPT:
            _ready.popitem(last=False)
        return worker


def run_task(version: str, home: str, threads: int | None, token: str, payload: bytes | None, task: Any) -> Any:
    """Runs a task in this process. Returns ("done", result); ("lacks", process) if the worker is unknown; or
    ("version", description of this process) if the package has another version."""
    if version != __version__:
        return "version", f"process {os.getpid()} on {platform.node()} has volume3d {__version__}"
    if _process() != home and threads is not None:
        set_num_threads(threads)
    worker = _find(token, payload)
    if worker is None:
        return "lacks", _process()
    return "done", worker.run(task)


class Crew:
    """Runs tasks on an executor.

    Processes of workers use `threads` threads each (0: one per core; None: as many as they use anyway). `error`
    is the class of exceptions.
    """

    def __init__(self, executor: Executor, shared: Shared, threads: int | None, error: type[Error]) -> None:
        if not callable(getattr(executor, "submit", None)):
            kind = type(executor).__name__
            raise TypeError(f"executor must be an executor of concurrent.futures, not {kind}")
        self._executor, self._shared, self._threads, self._error = executor, shared, threads, error

    def map(self, tasks: Sequence[Any], report: Callable[[int, int], Any] | None = None) -> list[Any]:
        """The results of all tasks, in their order, whatever the order in which they end. `report` is called with
        the number of those that have ended, and of all.

        Raises `error` if processes die again and again, or have another version, and what a task raises.
        """
        _own[self._shared.token] = self._shared
        return _Round(self._executor, self._shared, self._threads, self._error, tasks).results(report)


class _Round:
    """Tasks that are being run."""

    def __init__(
        self, executor: Executor, shared: Shared, threads: int | None, error: type[Error], tasks: Sequence[Any]
    ) -> None:
        self._executor, self._shared, self._threads, self._error = executor, shared, threads, error
        self._tasks = tasks
        self._results: list[Any] = [None] * len(tasks)
        self._deaths = [0] * len(tasks)
        #: Tasks under way, and whether they bring the worker.
        self._pending: dict[Future[Any], tuple[int, bool]] = {}
        #: Processes to which the worker is under way; tasks that wait until it has arrived somewhere.
        self._supplied: set[str] = set()
        self._held: list[int] = []

    def results(self, report: Callable[[int, int], Any] | None) -> list[Any]:
        """The results, in the order of the tasks."""
        try:
            for index in range(len(self._tasks)):
                self._submit(index, brings=False)
            while self._pending:
                for future in wait(self._pending, return_when=FIRST_COMPLETED).done:
                    self._receive(future)
                    if report is not None:
                        report(len(self._tasks) - len(self._pending) - len(self._held), len(self._tasks))
        finally:
            for future in self._pending:
                future.cancel()
        return self._results

    def _submit(self, index: int, *, brings: bool) -> None:
        token, payload = self._shared.token, self._shared.payload if brings else None
        arguments = (__version__, _process(), self._threads, token, payload, self._tasks[index])
        try:
            future = self._executor.submit(run_task, *arguments)
        except Exception as error:
            raise self._error(f"the executor takes no more tasks: {_words(error)}") from error
        self._pending[future] = index, brings

    def _receive(self, future: Future[Any]) -> None:
        index, brings = self._pending.pop(future)
        try:
            status, value = future.result()
        except BaseException as error:
            if not any(base.__name__ in _DEATHS for base in type(error).__mro__):
                raise
            self._deaths[index] += 1
            if self._deaths[index] > RETRIES:
                text = f"task {index} was given up: its process died or dropped it {self._deaths[index]} times"
                raise self._error(f"{text}; at last: {_words(error)}") from error
            status, value = "died", None
        if brings:
            self._arrived()
        if status == "done":
            self._results[index] = value
        elif status == "version":
            raise self._error(f"{value}, but this one has {__version__}: install the same version everywhere")
        elif status == "died":
            self._submit(index, brings=brings)
        elif value in self._supplied:
            self._held.append(index)
        else:
            self._supplied.add(value)
            self._submit(index, brings=True)

    def _arrived(self) -> None:
        if not any(brings for _, brings in self._pending.values()):
            self._supplied.clear()
        held, self._held = self._held, []
        for index in held:
            self._submit(index, brings=False)


def _words(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"
