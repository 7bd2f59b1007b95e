"""Start a node, spin it, and end it in good order: exit 0 on SIGINT and SIGTERM."""

from __future__ import annotations

import faulthandler
import os
import sys
import threading
import time
import traceback
from collections.abc import Callable, Sequence

import rclpy
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
)
from rclpy.executors import (
    Executor,
    ExternalShutdownException,
    MultiThreadedExecutor,
    SingleThreadedExecutor,
)
from rclpy.node import Node

from irlpilco_ros.learning.errors import IrlPilcoError
from irlpilco_ros.ros import discovery
from irlpilco_ros.ros.context import RosStartError, begin
from irlpilco_ros.ros.ending import Ending

GRACE = 0.1
"""How long callbacks go on after wind_down() [s]."""

LEAVING = 10.0
"""How long the middleware may take to let a node go [s]; some hundredths are usual."""

_STDERR = 2  # not sys.stderr, which is None for a process that is started without one

_BAD_START = (
    IrlPilcoError,
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
)


def run_node(
    make_node: Callable[[], Node], argv: Sequence[str] | None = None, executor_threads: int = 1
) -> int:
    """Run a node until SIGINT, SIGTERM or an error ends it.

    Two methods of the node are called if it has them. `wind_down()` comes first, like a callback,
    and callbacks go on for GRACE: the place to break off what others wait for, so that they get
    their answers. `shutdown()` comes after the last callback has ended and while publishers still
    work: the place for a last zero velocity.

    Args:
        make_node: Makes the node; called after rclpy is initialised.
        argv: Command line with the program's name; None takes sys.argv.
        executor_threads: Number of threads that run callbacks.

    Returns:
        Exit code: 0 after a signal, 1 if the node could not be made or a callback failed; the
        reason is on stderr then. A middleware that does not let the node go ends the process with
        1 after LEAVING, and where it was is on stderr.
    """
    ending = Ending()
    ending.take_signals()
    try:
        # rclpy's own handlers would end the context before shutdown() could publish anything.
        narrowed = begin(argv)
    except RosStartError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    try:
        node = make_node()
    except _BAD_START as error:
        print(f"error: {error}", file=sys.stderr)
        rclpy.try_shutdown()
        return 1
    _greet(node, narrowed)
    try:
        succeeded = _spin_until(ending, node, executor_threads)
    finally:
        shutdown = getattr(node, "shutdown", None)
        if shutdown is not None:
            shutdown()
        _leave(node)
    return 0 if succeeded else 1


def _greet(node: Node, narrowed: bool) -> None:
    """Say that the node runs, and who finds it."""
    node.get_logger().info("running; Ctrl-C ends it")
    if narrowed:
        node.get_logger().info(discovery.NARROWED)
    if danger := discovery.warning(os.environ):
        node.get_logger().warning(danger)


def _leave(node: Node) -> None:
    """Leave the middleware; the process ends, whatever that does.

    When all nodes of a computer end at once, Fast DDS was seen to go round in destroy_node() for
    ever, about once in a thousand times, and with Python's lock held: no thread of Python could
    end it. All that counts is said and done by now.
    """
    faulthandler.dump_traceback_later(LEAVING, exit=True, file=_STDERR)
    node.destroy_node()
    rclpy.try_shutdown()
    faulthandler.cancel_dump_traceback_later()


def _spin_until(ending: Ending, node: Node, threads: int) -> bool:
    """Spin in a thread, so that the main thread takes signals at once; True if all went well."""
    stop = threading.Event()
    executor: Executor = (
        SingleThreadedExecutor() if threads == 1 else MultiThreadedExecutor(num_threads=threads)
    )
    executor.add_node(node)
    failures: list[BaseException] = []

    def spin() -> None:
        try:
            while not stop.is_set():
                executor.spin_once(timeout_sec=1.0)
            _wind_down(executor, node)
        except ExternalShutdownException:
            pass
        except BaseException as error:
            failures.append(error)
        finally:
            ending.ask()

    spinner = threading.Thread(target=spin, name="executor")
    spinner.start()
    ending.wait()
    stop.set()
    executor.wake()
    spinner.join()
    executor.shutdown(timeout_sec=5.0)
    for failure in failures:
        traceback.print_exception(failure)
    return not failures


def _wind_down(executor: Executor, node: Node) -> None:
    wind_down = getattr(node, "wind_down", None)
    if wind_down is None:
        return
    wind_down()
    deadline = time.monotonic() + GRACE
    while (left := deadline - time.monotonic()) > 0.0:
        executor.spin_once(timeout_sec=left)
