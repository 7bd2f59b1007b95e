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
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import AbstractContextManager
from functools import lru_cache
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


@lru_cache(maxsize=8)
def _pool(helpers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(helpers, "irlpilco")


os.register_at_fork(after_in_child=_pool.cache_clear)  # a forked child has none of the threads


class Deferred(Generic[Result]):
    """A call that is made once, by whoever comes first: a helper, or who needs its result."""

    def __init__(self, function: Callable[[], Result]) -> None:
        self._function: Callable[[], Result] | None = function
        self._lock = threading.Lock()
        self._result: Any = None

    def result(self) -> Result:
        """Return the result, after making the call or waiting for whoever makes it.

        Raises:
            Exception: whatever the call raises.
        """
        with self._lock:
            return self._made()

    def begin(self) -> None:
        """Make the call, unless somebody is at it."""
        if self._lock.acquire(blocking=False):
            try:
                self._made()
            finally:
                self._lock.release()

    def _made(self) -> Result:
        if self._function is not None:
            self._result = self._function()
            self._function = None  # lets go of what it holds
        result: Result = self._result
        return result


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

    futures = [_pool(threads - 1).submit(work) for _ in range(helpers)]
    try:
        work()
    finally:
        begun = [future for future in futures if not future.cancel()]
        wait(begun)
    for future in begun:
        future.result()
    return results


def _begin_if_wanted(reference: Callable[[], Deferred[Any] | None]) -> None:
    deferred = reference()
    if deferred is not None:
        deferred.begin()


def run_later(function: Callable[[], Result], threads: int) -> Deferred[Result]:
    """Return a call that a helper makes when it is free, if somebody can still ask for the result.

    Whoever asks first makes the call himself. On one thread it is made at once, while what it needs
    is still in the cache.
    """
    deferred = Deferred(function)
    if threads > 1:
        _pool(threads - 1).submit(_begin_if_wanted, weakref.ref(deferred))
    else:
        deferred.begin()
    return deferred


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
