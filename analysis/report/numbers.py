"""Numbers as people write them: a value with its standard deviation to the digits that mean something."""

from __future__ import annotations

from math import floor, isfinite, log10

MISSING = "–"
# An interval of smaller numbers is written with their power of ten.
SMALLEST_PLAIN = 1e-4


def value_with_sd(value: float | None, sd: float | None, unit: str = "") -> str:
    """``0.7234, 0.0124`` -> ``0.723 ± 0.012``; with a unit, ``(12.3 ± 0.4) mm``.

    Digits by the rule of the Particle Data Group: the sd keeps two digits when they are 10 to 35 and one
    otherwise; the value is rounded to the same place.  Very large or small numbers go to a power of ten.  A
    missing value is a dash; with a missing, zero or infinite sd the value stands alone with three digits,
    because nobody knows how many are right.
    """
    if value is None or not isfinite(value):
        return MISSING
    if sd is None or not isfinite(sd) or sd <= 0:
        return with_unit(value, unit)
    exponent = floor(log10(max(abs(value), sd)))
    scale = 0 if -4 < exponent < 6 else exponent
    rounded_sd, digits = _rounded_sd(sd / 10.0**scale)
    text = f"{_signed(value / 10.0**scale, digits)} ± {rounded_sd:.{max(digits, 0)}f}"
    if scale:
        return f"({text}) × 10{_superscript(scale)}{_space(unit)}"
    return f"({text}){_space(unit)}" if unit else text


def value_with_digits(value: float | None, sd: float | None) -> str:
    """``0.29513, 0.00029`` -> ``0.29513(29)``, the sd in units of the last digit: short, for wide tables.

    Where that would be no shorter (an sd of one or more, powers of ten) it is that of :func:`value_with_sd`.
    """
    if value is None or sd is None or not isfinite(value) or not isfinite(sd) or not 0 < sd < 1:
        return value_with_sd(value, sd)
    rounded, digits = _rounded_sd(sd)
    if abs(value) < 1e-3 or digits > 9:
        return value_with_sd(value, sd)
    return f"{_signed(value, digits)}({round(rounded * 10**digits)})"


def with_unit(value: float | None, unit: str = "", digits: int = 3) -> str:
    """``digits`` significant digits and the unit; a dash for a missing value."""
    if value is None or not isfinite(value):
        return MISSING
    if value == 0:
        return f"0{_space(unit)}"
    exponent = floor(log10(abs(value)))
    if -4 < exponent < 6:
        decimals = max(digits - 1 - exponent, 0)
        return f"{_signed(value, decimals)}{_space(unit)}"
    return f"{_signed(value / 10.0**exponent, digits - 1)} × 10{_superscript(exponent)}{_space(unit)}"


def length(value_m: float | None, digits: int = 2) -> str:
    """A small length in the unit that needs no power of ten: nm, µm, mm or m."""
    if value_m is None or not isfinite(value_m):
        return MISSING
    for below_m, per_m, unit in ((1e-7, 1e9, "nm"), (1e-4, 1e6, "µm"), (1.0, 1e3, "mm")):
        if abs(value_m) < below_m:
            return with_unit(per_m * value_m, unit, digits)
    return with_unit(value_m, "m", digits)


def interval(low: float | None, high: float | None, unit: str = "") -> str:
    """``0.710 to 0.735``; open ends as ``≥`` and ``≤``; a dash when both are missing."""
    low_known, high_known = low is not None and isfinite(low), high is not None and isfinite(high)
    if low_known and high_known:
        width = abs(high - low) / 2  # type: ignore[operator]
        largest = max(abs(low), abs(high))  # type: ignore[arg-type]
        if 0 < largest < SMALLEST_PLAIN:
            exponent = floor(log10(largest))
            scaled = interval(low / 10.0**exponent, high / 10.0**exponent)  # type: ignore[operator]
            return f"({scaled}) × 10{_superscript(exponent)}{_space(unit)}"
        digits = _rounded_sd(width)[1] if width > 0 else 3
        return f"{_signed(low, digits)} to {_signed(high, digits)}{_space(unit)}"  # type: ignore[arg-type]
    if low_known:
        return f"≥ {with_unit(low, unit)}"
    return f"≤ {with_unit(high, unit)}" if high_known else MISSING


def percent(fraction: float | None) -> str:
    """A share in percent: one decimal where it is close to 0 or 100, and never 100 % for what is not all.  Less than
    nothing and more than all are given as they are."""
    if fraction is None or not isfinite(fraction):
        return MISSING
    if not 0.0 < fraction < 1.0:
        return f"{_signed(100 * fraction, 0)} %"
    per_cent = min(max(100 * fraction, 0.1), 99.9)
    return f"{per_cent:.{1 if per_cent < 10 or per_cent > 90 else 0}f} %"


def _rounded_sd(sd: float) -> tuple[float, int]:
    """The sd rounded by the rule, and the number of decimals (negative: tens, hundreds)."""
    exponent = floor(log10(sd))
    leading = round(sd / 10.0 ** (exponent - 1))
    digits = 1 - exponent if leading <= 35 else -exponent
    rounded = round(sd, digits)
    if leading > 35 and rounded >= 9.5 * 10.0**exponent:  # 0.0097 -> 0.010: keep the second digit
        digits = -exponent
        rounded = round(sd, digits)
    return rounded, digits


def _signed(value: float, digits: int) -> str:
    text = f"{round(value, digits):.{max(digits, 0)}f}"
    if float(text) == 0:
        text = text.lstrip("-")
    return text.replace("-", "−")


def _space(unit: str) -> str:
    return f" {unit}" if unit else ""


def _superscript(number: int) -> str:
    return str(number).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
