"""Threads over outputs, with one BLAS thread each.

The matrices of this package are small: a BLAS that spreads each of them over its own threads is
many times slower than one BLAS thread per output, and two layers of threads are worse still.
"""

from __future__ import annotations

import itertools
import math
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
from threadpoolctl import ThreadpoolController

from irlpilco_ros.learning.gaussian import Array

Item = TypeVar("Item")
Result = TypeVar("Result")


class _BlasLimit:
    """Counts who wants BLAS limited; the first one limits it, the last one gives it back."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users = 0
        self._limit: Any = None
        self._controller: Any = None

    def acquire(self) -> None:
        with self._lock:
            self._users += 1
            if self._users == 1:
                self._controller = self._controller or ThreadpoolController()
                self._limit = self._controller.limit(limits=1, user_api="blas")
                self._limit.__enter__()

    def release(self) -> None:
        with self._lock:
            self._users -= 1
            if self._users == 0:
                self._limit.__exit__(None, None, None)


_blas_limit = _BlasLimit()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Limit BLAS to one thread, in the whole process, for the duration of a `with` block.

    Nested and concurrent uses are fine and cost almost nothing, so a search wraps all of its
    evaluations in one block and each evaluation may use it again.
    """
    _blas_limit.acquire()
    try:
        yield
    finally:
        _blas_limit.release()


_pools: dict[int, ThreadPoolExecutor] = {}
_pools_lock = threading.Lock()
os.register_at_fork(after_in_child=_pools.clear)  # a forked child has none of the threads


def _pool(threads: int) -> ThreadPoolExecutor:
    with _pools_lock:
        if threads not in _pools:
            _pools[threads] = ThreadPoolExecutor(threads, thread_name_prefix="irlpilco")
        return _pools[threads]


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

    pool = _pool(threads - 1)
    futures: list[Future[None]] = [pool.submit(work) for _ in range(helpers)]
    try:
        work()
    finally:
        # A helper that has not begun (the pool is busy elsewhere) has nothing left to do.
        waiting = [future for future in futures if not future.cancel()]
        errors = [error for future in waiting if (error := future.exception())]
    if errors:
        raise errors[0]
    return results


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
