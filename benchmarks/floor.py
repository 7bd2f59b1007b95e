"""The floor: the arithmetic that moment matching cannot do without, and nothing else.

Per step and output, from the formulas of `irlpilco_ros/learning/output_moments.py`: the products
that make the n x n exponents (n x P times P x n) and use the result (P x n times n x n), the
n x n exponential in between, and five products of n x P with P x P or of P x n with n x P (z'P1 z,
z'G z, the second moments for Hess and for dv/dS, and the one for the pullback of V). Per pair of
outputs, for `exact`: the same with four. The full n x n matrices, although a variance's is
symmetric. Preallocated arrays, numpy's own kernels, one BLAS thread per thread of ours.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from threadpoolctl import threadpool_limits


class _Share:
    """One thread's share: `count` matrices at a time, `repeats` times."""

    def __init__(self, count: int, repeats: int, n: int, size: int, small: int) -> None:
        random = np.random.default_rng(0)
        self.repeats, self.small = repeats, small
        self.rows = random.standard_normal((count, n, size))
        self.columns = 0.01 * random.standard_normal((count, size, n))
        self.square = np.eye(size)
        self.pairs = np.empty((count, n, n))
        self.products = np.empty((count, size, n))
        self.turned = np.empty((count, n, size))

    def run(self) -> None:
        for _ in range(self.repeats):
            np.matmul(self.rows, self.columns, out=self.pairs)
            np.exp(self.pairs, out=self.pairs)
            np.matmul(self.columns, self.pairs, out=self.products)
            for _ in range(self.small):
                np.matmul(self.rows, self.square, out=self.turned)


def floor_seconds(
    outputs: int, size: int, n: int, steps: int, exact: bool, threads: int, repetitions: int = 3
) -> float:
    """Return the best time [s] of several runs, for whichever stacking of matrices is faster."""
    best = np.inf
    work = [(outputs * steps, 5)]
    if exact:
        work.append((outputs * (outputs - 1) // 2 * steps, 4))
    for stack in (1, 4, 14):
        shares = [
            [_Share(stack, -(-total // (threads * stack)), n, size, small) for total, small in work]
            for _ in range(threads)
        ]
        with threadpool_limits(1), ThreadPoolExecutor(threads) as pool:
            for _ in range(repetitions):
                start = time.perf_counter()
                list(pool.map(lambda mine: [share.run() for share in mine], shares))
                best = min(best, time.perf_counter() - start)
    return float(best)
