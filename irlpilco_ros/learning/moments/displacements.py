"""Displacements of the supporting points from the input's mean, and sums over them.

Quadratic forms z_i'M z_i and second moments sum_i w_i z_i z_i' for many M and w at once are one
matrix product each with the products z_ik z_il of each pair, which do not depend on the output:
half the arithmetic of going through M z_i, at a matrix product's full speed, without temporaries
of shape (outputs, n, P).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from irlpilco_ros.learning.numerics.arrays import Array


@dataclass(frozen=True)
class Displacements:
    """z_i = x_i - m of n supporting points, shared by all outputs (G = 1) or not (G = E).

    Attributes:
        z: Displacements in columns, with a last row of ones, of shape (G, P + 1, n).
        rows: The same in rows, of shape (G, n, P), in memory too: a product whose second factor is
            a transposed view takes BLAS half as long again.
        products: z_ik z_il for all pairs of k and l, of shape (G, P (P + 1) / 2, n): first those
            with l = k, then l = k + 1, l = k + 2 and so on, counted modulo P.
    """

    z: Array
    rows: Array
    products: Array

    @staticmethod
    def of(points: Array, mean: Array) -> Displacements:
        """Return the displacements of points (G, P, n) from a mean (P,)."""
        groups, size, n = points.shape
        shifts = size // 2 + 1
        z = np.empty((groups, size + shifts, n))
        np.subtract(points, mean[:, None], out=z[:, :size])
        z[:, size:] = z[:, :shifts]
        outer, row, column = z.strides
        shifted: Array = np.ndarray(
            (groups, shifts, size, n), z.dtype, z, 0, (outer, row, row, column)
        )
        products = (shifted * z[:, None, :size]).reshape(groups, shifts * size, n)
        rows = np.ascontiguousarray(np.swapaxes(z[:, :size], 1, 2))
        z[:, size] = 1.0
        return Displacements(z[:, : size + 1], rows, products[:, : size * (size + 1) // 2])

    @property
    def size(self) -> int:
        """Input dimensions P."""
        return int(self.z.shape[1]) - 1

    def select(self, outputs: slice | NDArray[np.intp]) -> Displacements:
        """Return those of some outputs (the very same if all outputs share the points)."""
        if len(self.z) == 1:
            return self
        return Displacements(self.z[outputs], self.rows[outputs], self.products[outputs])

    def linear_forms(self, vectors: Array) -> Array:
        """Return v'z_i, of shape (b, n), for vectors of shape (b, P)."""
        return _product(vectors, self.z[:, : self.size])

    def first_moments(self, weights: Array) -> Array:
        """Return sum_i w_i z_i, of shape (b, P), for weights of shape (b, n)."""
        return _product(weights, self.rows)

    def scaled_distances(self, inverse_squares: Array) -> Array:
        """Return sum_k z_ik^2 / l_k^2, of shape (b, n), for 1 / l^2 of shape (b, P)."""
        z = self.z[:, : self.size]
        return _product(inverse_squares, z * z)

    def quadratic_forms(self, matrices: Array) -> Array:
        """Return z_i'M z_i, of shape (b, n), for symmetric matrices of shape (b, P, P)."""
        return self.packed_forms(pack(matrices))

    def packed_forms(self, packed: Array) -> Array:
        """Return z_i'M z_i, of shape (b, n), for packed matrices of shape (b, P (P + 1) / 2)."""
        return _product(packed * _triangle(self.size)[2], self.products)

    def second_moments(self, weights: Array) -> Array:
        """Return sum_i w_i z_i z_i', of shape (b, P, P), for weights of shape (b, n)."""
        return unpack(self.packed_moments(weights), self.size)

    def packed_moments(self, weights: Array) -> Array:
        """Return sum_i w_i z_i z_i', packed, of shape (b, P (P + 1) / 2)."""
        return _product(weights, np.swapaxes(self.products, 1, 2))


def pack(matrices: Array) -> Array:
    """Return the upper triangles of symmetric matrices (b, P, P), in the order of `products`."""
    count, size, _ = matrices.shape
    return matrices.reshape(count, -1).take(_triangle(size)[0], axis=1)


def unpack(packed: Array, size: int) -> Array:
    """Return the symmetric matrices (b, P, P) of packed ones (b, P (P + 1) / 2)."""
    return packed.take(_triangle(size)[1], axis=1)


def _product(rows: Array, columns: Array) -> Array:
    """Return rows (b, k) times columns (G, k, n): those that all share (G = 1) or each its own.

    With b a multiple of G the rows are several stacks of G.
    """
    groups, size, n = columns.shape
    result: Array
    if groups == 1:
        result = rows @ columns[0]
    else:
        result = (rows.reshape(-1, groups, 1, size) @ columns).reshape(-1, n)
    return result


@lru_cache(maxsize=16)
def _triangle(size: int) -> tuple[NDArray[Any], NDArray[Any], Array]:
    """Return how to pack a symmetric matrix, how to unpack it, and the weights of a packed one."""
    pairs = np.arange(size * (size + 1) // 2)
    rows = pairs % size
    columns = (rows + pairs // size) % size
    unpacking = np.empty((size, size), dtype=np.intp)
    unpacking[rows, columns] = unpacking[columns, rows] = pairs
    return rows * size + columns, unpacking, np.where(rows == columns, 1.0, 2.0)
