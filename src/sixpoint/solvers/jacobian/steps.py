"""Five ways from a Jacobian and errors to a step of the joint angles (Buss and Kim 2005).

The Jacobian J (m, n) is the first m rows of a scratch array ``rows``; the SVD methods destroy it. Its rows
come in blocks of three, one per end effector. ``small`` is a scratch array for matrices of m rows:
its row ``ERROR`` holds the errors e (m,), the rest is free; ``step`` (n,) is what is written.

References: Buss, Kim, "Selectively damped least squares for inverse kinematics", Journal of Graphics Tools 10
(2005) 37-49; Wampler 1986 (DLS); Maciejewski 1990 (DLS by SVD); Whitney 1969 (pseudoinverse);
Wolovich and Elliott 1984 (transpose).
"""

from math import pi, sqrt

from sixpoint.kernels import linear
from sixpoint.kernels.jit import algebra, helper

TRANSPOSE, PSEUDOINVERSE, DLS, DLS_SVD, SDLS = range(5)
CAPS = (pi / 6, pi / 36, pi / 4, pi / 4, pi / 4)
"""Largest turn of a joint in one step [rad]: 30, 5, 45, 45, 45 degrees, as in Buss' code."""
CUT = 0.01  # the pseudoinverse drops singular values below this share of the largest (Buss' code)
TINY = 1e-10  # a singular value below this is zero
EXTRA = 4  # rows of ``small`` beyond two square matrices: errors, answer, order of pivots, norms


@helper
def error_row(small):
    """Row of ``small`` that holds the errors."""
    return small.shape[0] - 4


@helper
def answer_row(small):
    """Row of ``small`` that holds the coefficients of a solution."""
    return small.shape[0] - 3


@algebra
def combine(rows, first, count, small, coefficients, step):
    """Step = sum of ``count`` rows from ``first`` on, times the coefficients in a row of ``small``."""
    for c in range(step.shape[0]):
        step[c] = 0.0
    for k in range(count):
        factor = small[coefficients, k]
        if factor != 0.0:
            for c in range(step.shape[0]):
                step[c] += factor * rows[first + k, c]


@helper
def cap(step, largest):
    """Shrink a step so that no joint turns by more than ``largest`` (ClampMaxAbs)."""
    most = 0.0
    for c in range(step.shape[0]):
        most = max(most, abs(step[c]))
    if most > largest:
        for c in range(step.shape[0]):
            step[c] *= largest / most


@helper
def transpose_step(rows, m, small, step):
    """Dq = a J^T e with the a that brings J dq nearest to e."""
    error = error_row(small)
    combine(rows, 0, m, small, error, step)
    along, square = 0.0, 0.0
    for i in range(m):
        moved = 0.0
        for c in range(step.shape[0]):
            moved += rows[i, c] * step[c]
        along += moved * small[error, i]
        square += moved * moved
    factor = along / square if square > 1e-24 else 0.0
    for c in range(step.shape[0]):
        step[c] *= factor


@helper
def solve_normal(rows, m, small, damping):
    """Coefficients y of (J J^T + damping^2 I) y = e by Cholesky, into the answer row."""
    error, answer = error_row(small), answer_row(small)
    for i in range(m):
        for k in range(i + 1):
            total = linear.dot(rows, i, k)
            if i == k:
                total += damping * damping
            for c in range(k):
                total -= small[i, c] * small[k, c]
            if i == k:
                small[i, i] = sqrt(max(total, 1e-300))
            else:
                small[i, k] = total / small[k, k]
    for i in range(m):
        total = small[error, i]
        for c in range(i):
            total -= small[i, c] * small[answer, c]
        small[answer, i] = total / small[i, i]
    for i in range(m - 1, -1, -1):
        total = small[answer, i]
        for c in range(i + 1, m):
            total -= small[c, i] * small[answer, c]
        small[answer, i] = total / small[i, i]


@helper
def decompose(rows, m, small):
    """Singular value decomposition J = U S V^T; returns the rank r.

    V is left as a basis: rows m ... m + r - 1 of ``rows`` are orthonormal and v_i is their combination by the
    column i of small[m:m + r]; the columns of small[:m] are s_i u_i.
    """
    rank = linear.extend_basis(rows, 0, m, m, 0, small, TINY)
    linear.orthogonalise(small, m, rank)
    return rank


@helper
def singular_value(small, m, i):
    square = 0.0
    for k in range(m):
        square += small[k, i] * small[k, i]
    return sqrt(square)


@helper
def filtered_step(rows, m, small, rule, damping, step):
    """Dq = sum of f(s_i) v_i u_i^T e: the pseudoinverse (1 / s) or damped least squares (s / (s^2 + l^2))."""
    rank = decompose(rows, m, small)
    error, answer = error_row(small), answer_row(small)
    largest = 0.0
    for i in range(rank):
        small[answer, i] = 0.0
        largest = max(largest, singular_value(small, m, i))
    for i in range(rank):
        s = singular_value(small, m, i)
        if s <= TINY or (rule == PSEUDOINVERSE and s <= CUT * largest):
            continue
        along = 0.0  # s_i u_i . e
        for k in range(m):
            along += small[k, i] * small[error, k]
        factor = along / (s * s) if rule == PSEUDOINVERSE else along / (s * s + damping * damping)
        for k in range(rank):
            small[answer, k] += factor * small[m + k, i]
    combine(rows, m, rank, small, answer, step)


@helper
def selective_step(rows, m, small, levers, part, largest, step):
    """Selectively damped least squares: each singular direction is clamped by how far it moves the ends.

    ``levers`` (m / 3, n) are the lengths of J's columns, block by block; ``part`` (n,) is scratch.
    """
    rank = decompose(rows, m, small)
    error, answer = error_row(small), answer_row(small)
    n = step.shape[0]
    for c in range(n):
        step[c] = 0.0
    for i in range(rank):
        s = singular_value(small, m, i)
        if s <= TINY:
            continue
        along, share = 0.0, 0.0  # u_i . e, and N_i: the blocks' lengths of u_i
        for block in range(m // 3):
            square = 0.0
            for k in range(3 * block, 3 * block + 3):
                along += small[k, i] * small[error, k] / s
                square += small[k, i] * small[k, i]
            share += sqrt(square) / s
        for k in range(rank):
            small[answer, k] = small[m + k, i]
        combine(rows, m, rank, small, answer, part)  # v_i
        moved, most = 0.0, 0.0  # M_i: how far the ends go if v_i is turned by 1 / s
        for c in range(n):
            most = max(most, abs(part[c]))
            for block in range(m // 3):
                moved += abs(part[c]) * levers[block, c] / s
        limit = largest * min(1.0, share / moved) if moved > 0.0 else largest
        factor = along / s
        if abs(factor) * most > limit:
            factor *= limit / (abs(factor) * most)
        for c in range(n):
            step[c] += factor * part[c]


@helper
def compute_step(rule, rows, m, small, damping, levers, part, step):
    """A step by one of the five rules, capped so that no joint turns too far."""
    largest = CAPS[rule]
    if rule == TRANSPOSE:
        transpose_step(rows, m, small, step)
    elif rule == DLS:
        solve_normal(rows, m, small, damping)
        combine(rows, 0, m, small, answer_row(small), step)
    elif rule == SDLS:
        selective_step(rows, m, small, levers, part, largest, step)
    else:
        filtered_step(rows, m, small, rule, damping, step)
    cap(step, largest)
