"""Threads over outputs, with one BLAS thread each.

The matrices of this package are small: a BLAS that spreads each of them over its own threads is
many times slower than one BLAS thread per output, and two layers of threads are worse still.
"""

from __future__ import annotations

import itertools
import math
import os
import sys
import threading
import weakref
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

import numpy as np
from threadpoolctl import OpenBLASController, ThreadpoolController

from irlpilco_ros.learning.numerics.arrays import Array

Item = TypeVar("Item")
Result = TypeVar("Result")


class _BlasLimit:
    """Counts who wants BLAS limited; the first one limits it, the last one gives it back.

    threadpoolctl lets one thread set the limits of OpenBLAS, for as long as that thread lives, and
    ignores all others. Here any thread may be first or last, so that right is taken over each time.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users = 0
        self._limit: Any = None
        self._controller: Any = None
        self._with_scipy = False

    def __enter__(self) -> None:
        with self._lock:
            self._users += 1
            if self._users == 1:
                # scipy is imported late, and brings a BLAS of its own.
                with_scipy = "scipy.linalg" in sys.modules
                if self._controller is None or with_scipy != self._with_scipy:
                    self._controller, self._with_scipy = ThreadpoolController(), with_scipy
                OpenBLASController.clear_controlling_thread(force=True)
                self._limit = self._controller.limit(limits=1, user_api="blas")
                self._limit.__enter__()

    def __exit__(self, *error: object) -> None:
        with self._lock:
            self._users -= 1
            if self._users == 0:
                OpenBLASController.clear_controlling_thread(force=True)
                self._limit.__exit__(None, None, None)
                OpenBLASController.clear_controlling_thread(force=True)


_blas_limit = _BlasLimit()


def one_blas_thread() -> AbstractContextManager[None]:
    """Limit BLAS to one thread, in the whole process, for the duration of a `with` block.

    Nested and concurrent uses are fine and cost almost nothing, so a search wraps all of its
    evaluations in one block and each evaluation may use it again.
    """
    return _blas_limit


class Task(Generic[Result]):
    """A call that is made once, by whoever comes first: a helper, or who needs its result."""

    def __init__(self, function: Callable[[], Result]) -> None:
        self._function: Callable[[], Result] | None = function
        self._claim = threading.Lock()
        self._unfinished = threading.Lock()
        self._unfinished.acquire()
        self._value: Any = None
        self._error: BaseException | None = None

    @property
    def done(self) -> bool:
        """Whether the call has been made."""
        return not self._unfinished.locked()

    def run(self) -> None:
        """Make the call, unless somebody has begun it."""
        if self._function is None or not self._claim.acquire(blocking=False):
            return
        try:
            self._value = self._function()
        except BaseException as error:
            self._error = error
        finally:
            self._function = None  # lets go of what it holds
            self._unfinished.release()

    def result(self) -> Result:
        """Return the result, after making the call or waiting for whoever makes it.

        Raises:
            Exception: whatever the call raised.
        """
        self.run()
        with self._unfinished:
            pass
        if self._error is not None:
            raise self._error
        value: Result = self._value
        return value


class _Crew:
    """Helper threads, and two queues: what somebody waits for, and what can be done any time.

    What can be done any time is held weakly: nobody needs the derivatives of an evaluation that was
    dropped, and no helper is to go on with them.
    """

    def __init__(self, helpers: int) -> None:
        self._urgent: deque[Callable[[], Task[Any] | None]] = deque()
        self._spare: deque[Callable[[], Task[Any] | None]] = deque()
        self._tokens: SimpleQueue[None] = SimpleQueue()  # one for each task of either queue
        for _ in range(helpers):
            threading.Thread(target=self._work, name="irlpilco", daemon=True).start()

    def add(self, task: Task[Any], urgent: bool) -> None:
        """Let a helper make a call as soon as one is free."""
        if urgent:
            self._urgent.append(lambda: task)
        else:
            self._spare.append(weakref.ref(task))
        self._tokens.put(None)

    def _work(self) -> None:
        while True:
            self._tokens.get()
            _ = _run_first(self._urgent) or _run_first(self._spare)

    def fill_in(self, task: Task[Any]) -> None:
        """Do spare tasks, if there are any, until a task that others have begun is done."""
        while not task.done and _run_first(self._spare):
            pass


def _run_first(tasks: deque[Callable[[], Task[Any] | None]]) -> bool:
    """Run the oldest of some tasks, if it is wanted yet; return False if there is none."""
    try:
        task = tasks.popleft()()
    except IndexError:
        return False
    if task is not None:
        task.run()
    return True


_crews: dict[int, _Crew] = {}
_crews_lock = threading.Lock()
os.register_at_fork(after_in_child=_crews.clear)  # a forked child has none of the threads


def _crew(threads: int) -> _Crew:
    with _crews_lock:
        if threads not in _crews:
            _crews[threads] = _Crew(threads - 1)
        return _crews[threads]


def run_parallel(
    function: Callable[[Item], Result], items: Sequence[Item], threads: int
) -> list[Result]:
    """Return [function(item) for item in items], computed by up to `threads` threads.

    The caller's thread takes its share of the work. Which thread computes an item has no
    influence on its result, so results do not depend on the number of threads.

    Args:
        function: Must release the GIL most of the time (numpy does) to gain from threads.
        items: The items of work.
        threads: How many threads may work, at least 1.

    Raises:
        Exception: whatever `function` raised first; no further item is begun then.
    """
    helpers = min(threads, len(items)) - 1
    if helpers < 1:
        return [function(item) for item in items]
    results: list[Any] = [None] * len(items)
    tickets = itertools.count()
    stop = threading.Event()

    def work() -> None:
        while not stop.is_set() and (index := next(tickets)) < len(items):
            try:
                results[index] = function(items[index])
            except BaseException:
                stop.set()
                raise

    crew = _crew(threads)
    tasks = [Task(work) for _ in range(helpers + 1)]
    for task in tasks[1:]:
        crew.add(task, urgent=True)
    for task in tasks:  # the first is the caller's; others that nobody has begun find nothing left
        task.run()
        crew.fill_in(task)
    for task in tasks:
        task.result()
    return results


def run_later(function: Callable[[], Result], threads: int) -> Task[Result]:
    """Return a call that helpers make when they have nothing better to do.

    Whoever asks for its result first makes it himself. On one thread it is made at once, while
    what it needs is still in the cache.
    """
    task = Task(function)
    if threads > 1:
        _crew(threads).add(task, urgent=False)
    else:
        task.run()
    return task


def _keep_freed_memory() -> None:
    """Make glibc keep memory that is freed, instead of fetching it anew page by page every time.

    Its allocator does so, for up to twice the size, once it has seen a large block come and go.
    """
    np.empty(2_000_000)  # 16 MB that are never written to


_keep_freed_memory()

_scratch = threading.local()


def scratch(name: str, shape: tuple[int, ...]) -> Array:
    """Return this thread's own uninitialised array of that name, reused from call to call.

    Big temporaries cost more in page faults than in arithmetic when they are allocated anew.
    The contents are valid until the same thread asks for the same name again.
    """
    size = math.prod(shape)
    buffer: Array | None = getattr(_scratch, name, None)
    if buffer is None or buffer.size < size:
        buffer = np.empty(size)
        setattr(_scratch, name, buffer)
    return buffer[:size].reshape(shape)
