"""Intervals and exact tests of counts."""

from __future__ import annotations

import math

Z95 = 1.959963984540054  # of a normal variable, two-sided 95 %


def wilson(successes: int, count: int, z: float = Z95) -> tuple[float, float]:
    """Wilson's interval of a proportion (E. B. Wilson, JASA 22, 1927)."""
    if count == 0:
        return 0.0, 1.0
    p, square = successes / count, z * z
    middle = (p + square / (2 * count)) / (1 + square / count)
    half = z / (1 + square / count) * math.sqrt(p * (1 - p) / count + square / (4 * count * count))
    return max(0.0, middle - half), min(1.0, middle + half)


def mcnemar(worse: int, better: int) -> float:
    """The exact two-sided p of McNemar's test: of pairs that differ, so many got worse and so many
    better.
    """
    count = worse + better
    if count == 0:
        return 1.0
    tail = sum(math.comb(count, k) for k in range(min(worse, better) + 1)) / 2**count
    return min(1.0, 2 * tail)


def paired_difference(
    both: int, worse: int, better: int, neither: int
) -> tuple[float, float, float]:
    """The change of a success rate over pairs, with its 95 % interval.

    Newcombe's method 10 (R. G. Newcombe, Statistics in Medicine 17, 1998, 2635-2650). worse: pairs
    that succeeded before and not after; better: the other way round.
    """
    count = both + worse + better + neither
    if count == 0:
        return 0.0, -1.0, 1.0
    before, after = (both + worse) / count, (both + better) / count
    (l1, u1), (l2, u2) = wilson(both + better, count), wilson(both + worse, count)
    product = (both + worse) * (better + neither) * (both + better) * (worse + neither)
    numerator = float(both * neither - worse * better)
    if numerator > 0:
        numerator = max(numerator - count / 2, 0.0)  # the paper's correction for continuity
    phi = numerator / math.sqrt(product) if product else 0.0
    difference = after - before
    d1, d2 = after - l1, u2 - before
    e1, e2 = u1 - after, before - l2
    low = difference - math.sqrt(max(d1 * d1 - 2 * phi * d1 * d2 + d2 * d2, 0.0))
    high = difference + math.sqrt(max(e1 * e1 - 2 * phi * e1 * e2 + e2 * e2, 0.0))
    return difference, max(low, -1.0), min(high, 1.0)
