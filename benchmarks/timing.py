"""Times of several functions in one run, taken in turns so that all see the same machine."""

from __future__ import annotations

import os
import platform
import time
import tracemalloc
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import scipy
from threadpoolctl import threadpool_info

from irlpilco_ros.learning.numerics.threads import one_blas_thread

Seconds = dict[str, np.ndarray]


def in_turns(functions: Mapping[str, Callable[[], object]], rounds: int) -> Seconds:
    """Return the wall times [s] of every function, one for each round, BLAS on one thread."""
    seconds: dict[str, list[float]] = {name: [] for name in functions}
    with one_blas_thread():
        for function in functions.values():
            function()
        for _ in range(rounds):
            for name, function in functions.items():
                start = time.perf_counter()
                function()
                seconds[name].append(time.perf_counter() - start)
    return {name: np.array(times) for name, times in seconds.items()}


def ratio(seconds: Seconds, name: str, other: str) -> float:
    """Return how much longer one function takes than another: the median over the rounds."""
    return float(np.median(seconds[name] / seconds[other]))


def peak_megabytes(function: Callable[[], object]) -> float:
    """Return how much memory a call holds at its peak [MB]."""
    tracemalloc.start()
    function()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / 1e6


def conditions() -> str:
    """Say what was measured on."""
    blas = ", ".join(
        f"{info['internal_api']} {info['version']}"
        for info in threadpool_info()
        if info["user_api"] == "blas"
    )
    return (
        f"{os.cpu_count()} x {_processor()}, load {os.getloadavg()[0]:.1f} at the start; "
        f"Python {platform.python_version()}, numpy {np.__version__}, scipy {scipy.__version__} "
        f"({blas}, one thread per thread of ours)\n"
        "Medians of rounds in which everything takes its turn. Other work on the machine distorts "
        "the seconds and the gain from threads, and hardly the ratios."
    )


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
