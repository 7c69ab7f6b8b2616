"""Solve D x = b for the symmetric inertia matrix, in real or dual numbers.

D is factored as L Δ Lᵀ with plain transposes: the Hermitian factorisations of the libraries would conjugate
the imaginary part that carries the derivative.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from model.dynamics.compilation import compiled, inlined
from model.dynamics.dual import reciprocal


@inlined
def solve_3(
    d11: complex,
    d12: complex,
    d13: complex,
    d22: complex,
    d23: complex,
    d33: complex,
    b1: complex,
    b2: complex,
    b3: complex,
) -> Any:
    """Returns the solution (x1, x2, x3) of a symmetric 3 × 3 system: one pivot, then a 2 × 2 system by its determinant.

    It has two divisions instead of three; they are its slowest instructions.
    """
    pivot = reciprocal(d11)
    l2 = d12 * pivot
    l3 = d13 * pivot
    e22 = d22 - l2 * d12
    e23 = d23 - l2 * d13
    e33 = d33 - l3 * d13
    c2 = b2 - l2 * b1
    c3 = b3 - l3 * b1
    determinant = reciprocal(e22 * e33 - e23 * e23)
    x2 = (e33 * c2 - e23 * c3) * determinant
    x3 = (e22 * c3 - e23 * c2) * determinant
    x1 = (b1 - d12 * x2 - d13 * x3) * pivot
    return x1, x2, x3


@compiled
def solve_symmetric(matrix: NDArray[Any], vector: NDArray[Any]) -> NDArray[Any]:
    """Solves a symmetric positive definite system by L Δ Lᵀ.

    Args:
        matrix: (n, n); the lower triangle is read, and overwritten by L below the diagonal and by the reciprocals of
            the pivots on it.
        vector: (n,), overwritten by the solution, which is also returned.
    """
    n = vector.shape[0]
    for j in range(n):
        for k in range(j):
            scaled = matrix[j, k]
            matrix[j, k] = scaled * matrix[k, k]
            matrix[j, j] -= scaled * matrix[j, k]
            for i in range(j + 1, n):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
        matrix[j, j] = reciprocal(matrix[j, j])
    for i in range(n):
        for k in range(i):
            vector[i] -= matrix[i, k] * vector[k]
    for i in range(n):
        vector[i] *= matrix[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            vector[i] -= matrix[k, i] * vector[k]
    return vector
