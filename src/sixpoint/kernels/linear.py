"""Linear algebra of prioritized tasks: rows of one scratch array, orthonormal bases, small damped solutions.

All long vectors are rows of one array, addressed by row number; small matrices are corners of another.
"""

from math import sqrt

from sixpoint.kernels.jit import algebra, helper


@algebra
def dot(rows, i, k):
    total = 0.0
    for c in range(rows.shape[1]):
        total += rows[i, c] * rows[k, c]
    return total


@algebra
def add(rows, i, factor, k):
    """Row i += factor * row k."""
    for c in range(rows.shape[1]):
        rows[i, c] += factor * rows[k, c]


@algebra
def scale(rows, i, factor):
    for c in range(rows.shape[1]):
        rows[i, c] *= factor


@helper
def clear(rows, i):
    for c in range(rows.shape[1]):
        rows[i, c] = 0.0


@helper
def copy(rows, i, k):
    """Row i = row k."""
    for c in range(rows.shape[1]):
        rows[i, c] = rows[k, c]


@algebra
def _reject_four(rows, i, k):
    """Remove from row i its parts along the four orthonormal rows from k on."""
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    for c in range(rows.shape[1]):
        x = rows[i, c]
        s0 += x * rows[k, c]
        s1 += x * rows[k + 1, c]
        s2 += x * rows[k + 2, c]
        s3 += x * rows[k + 3, c]
    for c in range(rows.shape[1]):
        rows[i, c] -= s0 * rows[k, c] + s1 * rows[k + 1, c] + s2 * rows[k + 2, c] + s3 * rows[k + 3, c]


@helper
def reject(rows, i, first, last, before):
    """Remove from row i its part in the span of the orthonormal rows first ... last - 1.

    Where most of ``before``, its squared norm once, cancels, it is done again against rounding errors.
    Returns the squared norm of what is left.
    """
    after = before
    for _ in range(2):
        k = first
        while k + 4 <= last:
            _reject_four(rows, i, k)
            k += 4
        while k < last:
            add(rows, i, -dot(rows, i, k), k)
            k += 1
        after = dot(rows, i, i)
        if after > 0.25 * before or after == 0.0:
            break
        before = after
    return after


@helper
def extend_basis(rows, first, count, basis, size, small, threshold):
    """Split the rows first ... first + count - 1 = L V + (something in the span of the basis).

    V are orthonormal rows appended to the ``size`` rows that start at ``basis``, by Gram-Schmidt with row
    pivoting; it stops where what is left is shorter than ``threshold``. L is small[:count, :rank].

    Returns the rank. The given rows are destroyed. The last row of ``small`` is used, the one before it takes
    the order of the pivots.
    """
    left = small.shape[0] - 1  # its row holds the squared norms of what is left
    order = left - 1
    for i in range(count):
        square = dot(rows, first + i, first + i)
        if size:
            square = reject(rows, first + i, basis, basis + size, square)
        small[left, i] = square
    rank = 0
    while rank < count:
        largest, pivot = threshold * threshold, -1
        for i in range(count):
            if small[left, i] > largest:
                largest, pivot = small[left, i], i
        if pivot < 0:
            break
        new = basis + size + rank
        copy(rows, new, first + pivot)
        if rank:  # it is orthogonal already, but for the rounding errors of small differences
            largest = reject(rows, new, basis, new, largest)
        scale(rows, new, 1.0 / sqrt(largest))
        for i in range(count):
            if small[left, i] == 0.0:
                small[i, rank] = 0.0
                continue
            part = dot(rows, first + i, new)
            small[i, rank] = part
            add(rows, first + i, -part, new)
            small[left, i] = dot(rows, first + i, first + i)
        small[left, pivot] = 0.0
        small[order, rank] = pivot
        rank += 1
    return rank


@helper
def damping(sigma, wanted):
    """Damping factor that bounds the norm of the damped solution.

    Args:
        sigma: Smallest retained singular value.
        wanted: Norm of the task over the largest norm of the solution.

    Reference: Maciejewski 1990.
    """
    if sigma >= wanted:
        return 0.0
    if sigma >= 0.5 * wanted:
        return sqrt(sigma * (wanted - sigma))
    return 0.5 * wanted


@helper
def orthogonalise(small, count, rank):
    """One-sided Jacobi: turn the columns of B = small[:count, :rank] to be orthogonal, B = L W.

    W is written to small[count:count + rank, :rank]; the norms of the columns are the singular values.
    """
    for i in range(rank):
        for k in range(rank):
            small[count + i, k] = 1.0 if i == k else 0.0
    for _ in range(30):
        turned = False
        for i in range(rank - 1):
            for k in range(i + 1, rank):
                aa, bb, ab = 0.0, 0.0, 0.0
                for c in range(count):
                    aa += small[c, i] * small[c, i]
                    bb += small[c, k] * small[c, k]
                    ab += small[c, i] * small[c, k]
                if ab * ab <= 1e-28 * aa * bb:
                    continue
                turned = True
                zeta = (bb - aa) / (2.0 * ab)
                t = (1.0 if zeta >= 0.0 else -1.0) / (abs(zeta) + sqrt(1.0 + zeta * zeta))
                cosine = 1.0 / sqrt(1.0 + t * t)
                sine = cosine * t
                for c in range(count + rank):
                    x, y = small[c, i], small[c, k]
                    small[c, i] = cosine * x - sine * y
                    small[c, k] = sine * x + cosine * y
        if not turned:
            return


@helper
def solve_triangular(small, count, right, answer, largest):
    """The undamped solution of L y = right, where it needs no damping for sure.

    With its rows in the order of the pivots L is triangular; 1 / |inv(L)| (Frobenius) is a lower bound of its
    smallest singular value. Returns whether that alone rules damping out; then ``answer`` is written.
    """
    order = small.shape[0] - 2
    norm, inverse = 0.0, 0.0
    for c in range(count):
        norm += small[right, c] * small[right, c]
    for j in range(count):  # column j of the inverse into the rows below L
        for k in range(j, count):
            p = int(small[order, k])
            total = 1.0 if k == j else 0.0
            for i in range(j, k):
                total -= small[p, i] * small[count + i, j]
            total /= small[p, k]
            small[count + k, j] = total
            inverse += total * total
    if norm * inverse > largest * largest:  # |right| / largest > 1 / |inv(L)|
        return False
    for k in range(count):
        total = 0.0
        for j in range(k + 1):
            total += small[count + k, j] * small[right, int(small[order, j])]
        small[answer, k] = total
    return True


@helper
def solve_damped(small, count, rank, right, answer, largest, threshold):
    """Damped least squares: answer (rank,) minimises |L y - right|^2 + lambda^2 |y|^2.

    L = small[:count, :rank] is destroyed; small[right, :count] is the right side, the answer is written to
    small[answer, :rank]. Lambda bounds the norm of the answer by ``largest`` (``damping``). The last row but
    one of ``small`` holds the order of the pivots that ``extend_basis`` wrote.
    """
    if rank == count and solve_triangular(small, count, right, answer, largest):
        return
    orthogonalise(small, count, rank)
    norm = 0.0
    for c in range(count):
        norm += small[right, c] * small[right, c]
    least = 1e300
    for k in range(rank):
        square = 0.0
        for c in range(count):
            square += small[c, k] * small[c, k]
        if square > threshold * threshold:
            least = min(least, square)
        small[answer, k] = 0.0
    if least > 1e299:
        return
    shrink = damping(sqrt(least), sqrt(norm) / largest)
    for k in range(rank):
        square, along = 0.0, 0.0
        for c in range(count):
            square += small[c, k] * small[c, k]
            along += small[c, k] * small[right, c]
        if square > threshold * threshold:
            along /= square + shrink * shrink
            for i in range(rank):
                small[answer, i] += small[count + i, k] * along


@helper
def solve_normal(small, count, rank, right, answer, damping):
    """Least squares by Cholesky: answer (rank,) minimises |L y - right|^2 + damping^2 |y|^2.

    L = small[:count, :rank] is kept; the rows below it, up to ``2 count``, are used. ``damping`` must not be
    zero where L may be short of rank.
    """
    for i in range(rank):
        for k in range(i + 1):
            total = damping * damping if i == k else 0.0
            for c in range(count):
                total += small[c, i] * small[c, k]
            small[count + i, k] = total
        total = 0.0
        for c in range(count):
            total += small[c, i] * small[right, c]
        small[answer, i] = total
    for i in range(rank):
        for k in range(i + 1):
            total = small[count + i, k]
            for c in range(k):
                total -= small[count + i, c] * small[count + k, c]
            if i == k:
                small[count + i, i] = sqrt(max(total, 1e-30))
            else:
                small[count + i, k] = total / small[count + k, k]
    for i in range(rank):
        total = small[answer, i]
        for c in range(i):
            total -= small[count + i, c] * small[answer, c]
        small[answer, i] = total / small[count + i, i]
    for i in range(rank - 1, -1, -1):
        total = small[answer, i]
        for c in range(i + 1, rank):
            total -= small[count + c, i] * small[answer, c]
        small[answer, i] = total / small[count + i, i]
