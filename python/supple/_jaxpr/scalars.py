"""Functions of numbers that instructions do not have, written with those that they have.

Accurate near 0 and without overflow on the way; branches that are not taken give no numbers that are not finite, which
would spoil derivatives. Ties follow JAX: `max` and `min` share the derivative, that of `abs` at 0 is 1, that of `sign` is 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from .tape import Tape


def add(tape: Tape, a: int, b: int) -> int:
    """`a + b`."""
    return tape.emit("add", a, b)


def mul(tape: Tape, a: int, b: int) -> int:
    """`a b`."""
    return tape.emit("mul", a, b)


def neg(tape: Tape, a: int) -> int:
    """`-a`."""
    return tape.emit("neg", a)


def scaled(tape: Tape, factor: float, a: int) -> int:
    """`factor a`."""
    return tape.emit("mul", tape.constant(factor), a)


def shifted(tape: Tape, a: int, by: float) -> int:
    """`a + by`."""
    return tape.emit("add", a, tape.constant(by))


def choose(tape: Tape, condition: int, yes: int, no: int) -> int:
    """`yes` where the condition holds, which is where it is above 0."""
    return tape.emit("select", condition, yes, no)


def truth(tape: Tape, condition: int) -> int:
    """1 where the condition holds, else 0."""
    return choose(tape, condition, tape.constant(1.0), tape.constant(0.0))


def greater(tape: Tape, a: int, b: int) -> int:
    """Whether `a > b`; not where either is not a number."""
    infinite = _beyond(tape, a, b)
    return tape.emit("sub", a, b) if infinite is None else infinite


def _beyond(tape: Tape, a: int, b: int) -> int | None:
    """Whether `a > b` where one of them is always infinite: differences would not do."""
    known_a, known_b = tape.known(a), tape.known(b)
    for number, other, wins in ((known_a, b, math.inf), (known_b, a, -math.inf)):
        if number is not None and math.isinf(number):
            # Beyond all finite numbers on one side, and below them on the other.
            return equal(tape, other, other) if number == wins else tape.constant(0.0)
    return None


def equal(tape: Tape, a: int, b: int) -> int:
    """Whether `a == b`; not where either is not a number."""
    one, zero = tape.constant(1.0), tape.constant(0.0)
    if a == b:
        return choose(tape, a, one, tape.emit("sub", one, a))
    for number in (tape.known(a), tape.known(b)):
        if number is not None and math.isinf(number):
            return zero
    difference = tape.emit("sub", a, b)
    tie = choose(tape, neg(tape, difference), zero, tape.emit("add", one, difference))
    return choose(tape, difference, zero, tie)


def negated(tape: Tape, condition: int) -> int:
    """Whether a condition does not hold."""
    return choose(tape, condition, tape.constant(0.0), tape.constant(1.0))


def both(tape: Tape, a: int, b: int) -> int:
    """Whether two conditions hold."""
    return choose(tape, a, b, tape.constant(0.0))


def either(tape: Tape, a: int, b: int) -> int:
    """Whether one of two conditions holds."""
    return choose(tape, a, tape.constant(1.0), b)


def differs(tape: Tape, a: int, b: int) -> int:
    """Whether exactly one of two conditions holds."""
    return choose(tape, a, negated(tape, b), b)


def at_least(tape: Tape, a: int, b: int) -> int:
    """Whether `a >= b`."""
    return either(tape, greater(tape, a, b), equal(tape, a, b))


def maximum(tape: Tape, a: int, b: int) -> int:
    """The larger of two; at a tie half of each, as JAX has it."""
    if a == b:
        return a
    for number, other in ((tape.known(a), b), (tape.known(b), a)):
        if number == -math.inf:
            return other
    middle = scaled(tape, 0.5, add(tape, a, b))
    return choose(tape, greater(tape, a, b), a, choose(tape, greater(tape, b, a), b, middle))


def minimum(tape: Tape, a: int, b: int) -> int:
    """The smaller of two; at a tie half of each, as JAX has it."""
    return neg(tape, maximum(tape, neg(tape, a), neg(tape, b)))


def absolute(tape: Tape, a: int) -> int:
    """`|a|`, with the derivative 1 at 0, as JAX has it."""
    return choose(tape, neg(tape, a), neg(tape, a), a)


def sign(tape: Tape, a: int) -> int:
    """1, 0 or -1."""
    below = choose(tape, neg(tape, a), tape.constant(-1.0), power(tape, a, 3))
    return choose(tape, a, tape.constant(1.0), below)


def clamp(tape: Tape, low: int, a: int, high: int) -> int:
    """`a` within bounds, with the derivative of the bound at a tie."""
    inside = choose(tape, greater(tape, high, a), a, high)
    below = choose(tape, greater(tape, low, a), low, add(tape, low, power(tape, tape.emit("sub", a, low), 3)))
    known = tape.known(low)
    return inside if known == -math.inf else choose(tape, greater(tape, a, low), inside, below)


def power(tape: Tape, a: int, exponent: int) -> int:
    """An integer power, by squaring."""
    if exponent < 0:
        return tape.emit("recip", power(tape, a, -exponent))
    result, factor = None, a
    while exponent:
        if exponent & 1:
            result = factor if result is None else mul(tape, result, factor)
        exponent >>= 1
        if exponent:
            factor = mul(tape, factor, factor)
    return tape.constant(1.0) if result is None else result


def real_power(tape: Tape, a: int, exponent: float) -> int:
    """A power with a constant exponent: not a number where `a < 0`, unless the exponent is an integer."""
    if exponent == round(exponent) and abs(exponent) <= 64:
        return power(tape, a, int(exponent))
    if exponent < 0.0:
        return tape.emit("recip", real_power(tape, a, -exponent))
    if exponent == 0.5:
        return tape.emit("sqrt", a)
    one = tape.constant(1.0)
    safe = choose(tape, a, a, one)
    if 2.0 * exponent == round(2.0 * exponent) and exponent <= 64.0:
        positive = mul(tape, power(tape, safe, int(exponent)), tape.emit("sqrt", safe))
    else:
        positive = tape.emit("exp", scaled(tape, exponent, tape.emit("ln", safe)))
    # 0 at 0, and the logarithm of what is negative.
    return choose(tape, a, positive, tape.emit("ln", choose(tape, neg(tape, a), a, one)))


def general_power(tape: Tape, a: int, b: int) -> int:
    """`a^b`, of positive `a` where `b` is not constant."""
    exponent = tape.known(b)
    if exponent is not None:
        return real_power(tape, a, exponent)
    return tape.emit("exp", mul(tape, b, tape.emit("ln", a)))


def odd(function: Callable[[Tape, int], int]) -> Callable[[Tape, int], int]:
    """A smooth odd function from its values at 0 and above."""

    def whole(tape: Tape, a: int) -> int:
        size = choose(tape, a, a, neg(tape, a))
        value = function(tape, size)
        return choose(tape, a, value, neg(tape, value))

    return whole


@odd
def sinh(tape: Tape, a: int) -> int:
    """Hyperbolic sine: `(e + e / (e + 1)) / 2` with `e = exp(a) - 1`."""
    e = tape.emit("exp_m1", a)
    # e / (e + 1) is 1 - exp(-a), which does not overflow.
    return scaled(tape, 0.5, tape.emit("sub", e, tape.emit("exp_m1", neg(tape, a))))


def cosh(tape: Tape, a: int) -> int:
    """Hyperbolic cosine."""
    return scaled(tape, 0.5, add(tape, tape.emit("exp", a), tape.emit("exp", neg(tape, a))))


@odd
def asinh(tape: Tape, a: int) -> int:
    """Inverse hyperbolic sine: `ln(1 + a + a^2 / (1 + sqrt(1 + a^2)))`."""
    square = mul(tape, a, a)
    root = tape.emit("sqrt", shifted(tape, square, 1.0))
    return tape.emit("ln_1p", add(tape, a, tape.emit("div", square, shifted(tape, root, 1.0))))


def acosh(tape: Tape, a: int) -> int:
    """Inverse hyperbolic cosine: `ln(1 + t + sqrt(t (t + 2)))` with `t = a - 1`."""
    t = shifted(tape, a, -1.0)
    root = tape.emit("sqrt", mul(tape, t, shifted(tape, t, 2.0)))
    return tape.emit("ln_1p", add(tape, t, root))


@odd
def atanh(tape: Tape, a: int) -> int:
    """Inverse hyperbolic tangent: `ln(1 + 2 a / (1 - a)) / 2`."""
    rest = tape.emit("sub", tape.constant(1.0), a)
    return scaled(tape, 0.5, tape.emit("ln_1p", tape.emit("div", scaled(tape, 2.0, a), rest)))


@odd
def cbrt(tape: Tape, a: int) -> int:
    """Cube root."""
    return tape.emit("exp", tape.emit("div", tape.emit("ln", a), tape.constant(3.0)))


def logistic(tape: Tape, a: int) -> int:
    """`1 / (1 + exp(-a))`."""
    e = tape.emit("exp", neg(tape, choose(tape, a, a, neg(tape, a))))
    share = tape.emit("recip", shifted(tape, e, 1.0))
    return choose(tape, a, share, mul(tape, e, share))


def logaddexp(tape: Tape, a: int, b: int) -> int:
    """`ln(exp(a) + exp(b))`, with derivatives of every order also at a tie."""
    difference = tape.emit("sub", a, b)
    larger = choose(tape, difference, a, b)
    size = choose(tape, difference, difference, neg(tape, difference))
    return add(tape, larger, tape.emit("ln_1p", tape.emit("exp", neg(tape, size))))


def relu(tape: Tape, a: int) -> int:
    """`max(a, 0)`, flat at 0."""
    zero = tape.constant(0.0)
    return choose(tape, a, a, choose(tape, neg(tape, a), zero, power(tape, a, 3)))


def tan(tape: Tape, a: int) -> int:
    """Tangent of an angle in radians."""
    return tape.emit("div", tape.emit("sin", a), tape.emit("cos", a))


def _across(tape: Tape, a: int) -> int:
    one = tape.constant(1.0)
    return tape.emit("sqrt", mul(tape, tape.emit("sub", one, a), add(tape, one, a)))


def asin(tape: Tape, a: int) -> int:
    """The angle with this sine, radians."""
    return tape.emit("atan2", a, _across(tape, a))


def acos(tape: Tape, a: int) -> int:
    """The angle with this cosine, radians."""
    return tape.emit("atan2", _across(tape, a), a)


def finite(tape: Tape, a: int) -> int:
    """Whether a number is finite."""
    largest = tape.constant(1.7976931348623157e308)
    return greater(tape, largest, choose(tape, a, a, neg(tape, a)))
