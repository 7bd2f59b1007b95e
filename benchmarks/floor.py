"""The floor: the arithmetic that moment matching cannot do without, and nothing else.

Per step and output, from the formulas of `learning/moments/output_moments.py`: the products
that make the n x n exponents (n x P times P x n) and use the result (P x n times n x n), the
n x n exponential in between, and four products of n x P with P x P or of P x n with n x P (z'P1 z,
z'G z, the second moments for dv/dS, and the one for the pullback of V). Per pair of outputs, for
`exact`: the same. The full n x n matrices, although a variance's is symmetric. Preallocated arrays,
numpy's own kernels, one BLAS thread per thread of ours.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

SMALL_PRODUCTS = 4  # of n x P with P x P
STACKS = (1, 4, 14)  # how many matrices one call of numpy may work on


class _Share:
    """One thread's share: `count` matrices at a time, `repeats` times."""

    def __init__(self, count: int, repeats: int, n: int, size: int) -> None:
        random = np.random.default_rng(0)
        self.repeats = repeats
        self.rows = random.standard_normal((count, n, size))
        self.columns = 0.01 * random.standard_normal((count, size, n))
        self.square = np.eye(size)
        self.pairs = np.empty((count, n, n))
        self.products = np.empty((count, size, n))
        self.row_products = np.empty((count, n, size))

    def run(self) -> None:
        for _ in range(self.repeats):
            np.matmul(self.rows, self.columns, out=self.pairs)
            np.exp(self.pairs, out=self.pairs)
            np.matmul(self.columns, self.pairs, out=self.products)
            for _ in range(SMALL_PRODUCTS):
                np.matmul(self.rows, self.square, out=self.row_products)


class Floor:
    """The floor of one objective with its gradient, ready to be run."""

    def __init__(
        self, outputs: int, size: int, n: int, steps: int, exact: bool, threads: int
    ) -> None:
        """Prepare the arrays, and find out how many matrices to work on at a time.

        Args:
            outputs: E.
            size: P.
            n: Points.
            steps: H.
            exact: Whether the pairs of outputs count too.
            threads: Among which the work is shared.
        """
        count = outputs + (outputs * (outputs - 1) // 2 if exact else 0)

        def shares(stack: int, repeats: int) -> list[_Share]:
            each = -(-count * repeats // (threads * stack))
            return [_Share(stack, each, n, size) for _ in range(threads)]

        self._pool = ThreadPoolExecutor(threads)
        best = np.inf
        for stack in STACKS:
            self._shares = shares(stack, 1)
            self.run()
            start = time.perf_counter()
            self.run()
            seconds = time.perf_counter() - start
            if seconds < best:
                best, chosen = seconds, stack
        self._shares = shares(chosen, steps)

    def run(self) -> None:
        """Do the arithmetic once."""
        list(self._pool.map(_Share.run, self._shares))
