"""Threads over outputs, and BLAS kept to one thread."""

import subprocess
import sys
import threading
from functools import partial

import numpy as np
import pytest

from irlpilco_ros.learning.numerics.threads import run_later, run_parallel, scratch


def run_alone(source):
    """Run code in a process whose BLAS nobody else limits.

    Here, helpers may be at work yet on evaluations that other tests keep.
    """
    prelude = """
from threadpoolctl import threadpool_info, threadpool_limits
from irlpilco_ros.learning.numerics.threads import one_blas_thread

def blas_threads():
    return {info["num_threads"] for info in threadpool_info() if info["user_api"] == "blas"}
"""
    ran = subprocess.run([sys.executable, "-c", prelude + source], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr


def test_blas_is_limited_and_given_back():
    run_alone("""
with threadpool_limits(2, "blas"):
    before = blas_threads()
    assert before != {1}
    with one_blas_thread():
        assert blas_threads() == {1}
        with one_blas_thread():
            assert blas_threads() == {1}
        assert blas_threads() == {1}
    assert blas_threads() == before
    try:
        with one_blas_thread():
            raise KeyError
    except KeyError:
        assert blas_threads() == before
""")


def test_any_thread_may_limit_blas_first_and_give_it_back_last():
    run_alone("""
import threading

def turn(entered, leave):
    with one_blas_thread():
        entered.set()
        leave.wait(20.0)
    left.set()
    end.wait(20.0)  # alive, as helpers are

entered, leave, left, end = (threading.Event() for _ in range(4))
before = blas_threads()
helper = threading.Thread(target=turn, args=(entered, leave))
helper.start()
entered.wait(20.0)
assert blas_threads() == {1}
with one_blas_thread():
    leave.set()
    left.wait(20.0)
    assert blas_threads() == {1}
assert blas_threads() == before
with threadpool_limits(2, "blas"):
    assert blas_threads() == {2}
with one_blas_thread():
    assert blas_threads() == {1}
end.set()
""")


def test_the_blas_that_scipy_brings_later_is_limited_too():
    run_alone("""
with one_blas_thread():
    pass
import scipy.linalg
with threadpool_limits(2, "blas"), one_blas_thread():
    assert blas_threads() == {1}
""")


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_results_are_in_order(threads):
    assert run_parallel(lambda i: i * i, range(40), threads) == [i * i for i in range(40)]
    assert run_parallel(lambda i: i, [], threads) == []


def test_the_threads_really_work_at_the_same_time():
    meeting = threading.Barrier(3, timeout=20.0)
    assert len(set(run_parallel(lambda i: meeting.wait(), range(3), 3))) == 3


@pytest.mark.parametrize("threads", [1, 3])
def test_an_error_stops_the_work(threads):
    done = []

    def work(i):
        if i == 3:
            raise ValueError("three")
        done.append(i)

    with pytest.raises(ValueError, match="three"):
        run_parallel(work, range(10_000), threads)
    assert len(done) < 10_000


def test_parallel_work_may_be_nested():
    def outer(i):
        return sum(run_parallel(lambda j: i * j, range(5), 2))

    assert run_parallel(outer, range(6), 2) == [10 * i for i in range(6)]


@pytest.mark.parametrize("threads", [1, 2])
def test_a_call_for_later_is_made_once(threads):
    calls = []

    def call(i):
        calls.append(i)
        return i

    later = [run_later(partial(call, i), threads) for i in range(200)]
    assert [call.result() for call in reversed(later)] == list(range(199, -1, -1))
    assert [call.result() for call in later] == list(range(200))
    assert sorted(calls) == list(range(200))


@pytest.mark.parametrize("threads", [1, 2])
def test_the_error_of_a_call_for_later_is_raised_to_who_asks(threads):
    def fail():
        raise ValueError("late")

    with pytest.raises(ValueError, match="late"):
        run_later(fail, threads).result()
    assert run_parallel(lambda i: i, range(4), threads) == [0, 1, 2, 3]


def test_what_nobody_can_ask_for_any_more_is_not_computed():
    calls, begun, queued = [], threading.Event(), threading.Event()

    def work(i):
        if threading.current_thread() is threading.main_thread():
            begun.wait(20.0)
            run_later(lambda: calls.append("dropped"), 2)
            kept = run_later(lambda: calls.append("kept"), 2)
            queued.set()
            return kept.result()
        begun.set()
        return queued.wait(20.0)  # the only helper, while both calls are queued

    run_parallel(work, range(2), 2)
    run_parallel(lambda i: i, range(2), 2)  # the helper goes through what is left
    assert calls == ["kept"]


def test_a_forked_process_has_helpers_of_its_own():
    run_alone("""
import os
from irlpilco_ros.learning.numerics.threads import run_later, run_parallel

assert run_parallel(abs, range(8), 2) == list(range(8))
child = os.fork()
if child == 0:
    works = run_parallel(abs, range(8), 2) == list(range(8))
    os._exit(0 if works and run_later(lambda: 7, 2).result() == 7 else 1)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
""")


def test_scratch_belongs_to_its_thread():
    mine = scratch("test", (3, 4))
    assert mine.shape == (3, 4)
    mine[:] = 1.0
    other = threading.Thread(target=lambda: scratch("test", (3, 4)).fill(2.0))
    other.start()
    other.join()
    np.testing.assert_array_equal(mine, 1.0)
    assert np.shares_memory(scratch("test", (2, 2)), mine)
