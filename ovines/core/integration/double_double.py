"""Numbers of two doubles (about 32 digits): sums, products, roots, sine, cosine, exponential.

A number is a pair (high, low) with |low| at most half a unit of the high word.  Source: Dekker, Numer. Math. 18, 224
(1971); Knuth, The Art of Computer Programming 2, 4.2.2; Hida, Li and Bailey, ARITH-15 (2001).
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from ovines.core.compiled import compiled

Pair = tuple[float, float]  # high word, low word


def _words(number: Fraction, count: int) -> list[float]:
    """A rational number as a sum of doubles, each correcting those before."""
    words = []
    for _ in range(count):
        words.append(float(number))
        number -= Fraction(words[-1])
    return words


# pi to 50 digits; ln 2 to 50 digits
_HALF_PI = _words(Fraction(314159265358979323846264338327950288419716939937510, 2 * 10**50), 3)
_LN2 = _words(Fraction(69314718055994530941723212145817656807550013436025, 10**50), 3)
HALF_PI_1, HALF_PI_2, HALF_PI_3 = _HALF_PI
LN2_1, LN2_2, LN2_3 = _LN2
INVERSE_FACTORIALS = np.array([_words(Fraction(1, math.factorial(n)), 2) for n in range(30)])


@compiled
def two_sum(a: float, b: float) -> Pair:
    """a + b without error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@compiled
def two_product(a: float, b: float) -> Pair:
    """a b without error (Dekker's splitting)."""
    product = a * b
    c = 134217729.0 * a
    a_high = c - (c - a)
    a_low = a - a_high
    c = 134217729.0 * b
    b_high = c - (c - b)
    b_low = b - b_high
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


@compiled
def add(a: Pair, b: Pair) -> Pair:
    """a + b."""
    high, low = two_sum(a[0], b[0])
    high_2, low_2 = two_sum(a[1], b[1])
    high, low = two_sum(high, low + high_2)
    return two_sum(high, low + low_2)


@compiled
def negative(a: Pair) -> Pair:
    """-a."""
    return -a[0], -a[1]


@compiled
def multiply(a: Pair, b: Pair) -> Pair:
    """a b."""
    high, low = two_product(a[0], b[0])
    return two_sum(high, low + (a[0] * b[1] + a[1] * b[0]))


@compiled
def divide(a: Pair, b: Pair) -> Pair:
    """a / b."""
    first = a[0] / b[0]
    rest = add(a, negative(multiply(b, (first, 0.0))))
    second = rest[0] / b[0]
    rest = add(rest, negative(multiply(b, (second, 0.0))))
    high, low = two_sum(first, second)
    return two_sum(high, low + rest[0] / b[0])


@compiled
def root(a: Pair) -> Pair:
    """Square root; 0 of 0."""
    if a[0] <= 0.0:
        return 0.0, 0.0
    guess = math.sqrt(a[0])
    rest = add(a, negative(multiply((guess, 0.0), (guess, 0.0))))
    return two_sum(guess, 0.5 * rest[0] / guess)


@compiled
def sine_cosine(a: Pair) -> tuple[Pair, Pair]:
    """Sine and cosine: reduced by quarter turns, then Taylor's series."""
    turns = float(round(a[0] / HALF_PI_1))
    x = add(a, negative(two_product(turns, HALF_PI_1)))
    x = add(x, negative(two_product(turns, HALF_PI_2)))
    x = add(x, (-turns * HALF_PI_3, 0.0))
    square = negative(multiply(x, x))
    sine, cosine = (0.0, 0.0), (0.0, 0.0)
    for n in range(14, -1, -1):
        if 2 * n + 1 < 30:
            sine = add(multiply(sine, square), (INVERSE_FACTORIALS[2 * n + 1, 0], INVERSE_FACTORIALS[2 * n + 1, 1]))
        cosine = add(multiply(cosine, square), (INVERSE_FACTORIALS[2 * n, 0], INVERSE_FACTORIALS[2 * n, 1]))
    sine = multiply(sine, x)
    quarter = int(turns) % 4
    if quarter == 0:
        return sine, cosine
    if quarter == 1:
        return cosine, negative(sine)
    if quarter == 2:
        return negative(sine), negative(cosine)
    return negative(cosine), sine


@compiled
def exponential(a: Pair) -> Pair:
    """exp(a) for |a| up to some hundreds."""
    twos = float(round(a[0] / LN2_1))
    x = add(a, negative(two_product(twos, LN2_1)))
    x = add(x, negative(two_product(twos, LN2_2)))
    x = add(x, (-twos * LN2_3, 0.0))
    total = (0.0, 0.0)
    for n in range(27, -1, -1):
        total = add(multiply(total, x), (INVERSE_FACTORIALS[n, 0], INVERSE_FACTORIALS[n, 1]))
    scale = math.pow(2.0, twos)
    return total[0] * scale, total[1] * scale
