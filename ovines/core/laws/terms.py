"""A written law as data: terms of factors with coefficients, their units, their formula, and the engine's rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ovines.core.compiled import Floats
from ovines.core.laws import words as W
from ovines.core.laws.allowed import expected_instead
from ovines.core.laws.targets import CAMERAS, MARKERS, TARGETS
from ovines.core.laws.words import FUNCTIONS, QUANTITIES
from ovines.core.refusal import require

#: terms of a law at the most: each is a parameter of the flights' model; of the measurement, where none is
MOST_TERMS, MOST_OF_MEASUREMENT = 8, 12
#: functions that divide their quantity by a scale of its unit
SCALED = (
    *("cosine", "sine", "exponential", "gaussian", "below", *W.TRAINS),
    *("above", "tanh", "decay", "rational", "within", "sawtooth", "rising", "beyond"),
)
#: functions whose scale is a threshold, which may lie anywhere
THRESHOLDS = ("below", "above", "beyond")
# A dictionary makes thousands of terms: what a refusal would say is put together once.
SOME_QUANTITY, SOME_FUNCTION, SOME_TARGET = ("one of " + ", ".join(names) for names in (QUANTITIES, FUNCTIONS, TARGETS))
WITH_POSITIVE_ORDER = (*W.TRAINS, "above", "rational")


@dataclass(frozen=True)
class Factor:
    """A function of a quantity: ``power`` q^n, ``absolute_power`` |q|^n, ``cosine`` cos(n q / s), ``sine``,
    ``exponential`` exp(-q / s), ``gaussian`` exp(-(q / s)^2 / 2), ``below`` (1 where q < s), ``sign``, ``pulses``: a
    Gaussian of width n (in q's unit) about every multiple of the period s, ``gates``: 1 over a width n there, ``above``
    max(q - s, 0)^n, ``tanh`` tanh(q / s), ``decay`` exp(-|q| / s), ``rational`` 1 / (1 + |q / s|^n), ``within``
    (1 where |q| < s), ``sawtooth``: of an angle q taken n times, 1/2 sign(q) - q / (2 pi), a step up at 0 and even
    slope elsewhere, of anything else such a step at every multiple of the period s, ``rising`` 1 - exp(-|q| / s),
    ``beyond`` (1 where q >= s).

    ``scale`` s has the quantity's unit (1 for angles); ``x``, ``y``: the place that a distance is taken from (m), the
    wind of an airspeed (m/s), the angle, instant or value that q counts from in ``x``, for ``along_host`` the line's
    direction in ``y`` (rad), for ``turning_azimuth`` the rate in ``y`` (rad/s), for ``recent_blows`` and
    ``recent_rubbing`` the time in which one fades in ``y`` (s), for ``way_lately`` that in which what was fades in
    ``y`` (s), for ``trail_along`` and ``trail_across`` the length in which it does in ``y`` (m), for ``swing``,
    ``ovalling``, ``breathing``, ``twist`` and what is called after them with ``_rate`` the rate in ``x`` (rad/s; 0: it
    does not swing back) and the time in which it fades in ``y`` (s), for ``blows_here`` and ``rim_blows_here`` that
    time in ``x`` (s; 0: never) and the width in ``y`` (rad)."""

    quantity: str
    function: str = "power"
    order: float = 1.0
    scale: float = 1.0
    x: float = 0.0
    y: float = 0.0

    def __post_init__(self) -> None:
        known = self.quantity in QUANTITIES
        require(known, f"quantity {self.quantity!r} of a law", SOME_QUANTITY, "correct the name")
        known = self.function in FUNCTIONS
        require(known, f"function {self.function!r} of a law", SOME_FUNCTION, "correct the name")
        numbers = (self.order, self.scale, self.x, self.y)
        fine = all(map(math.isfinite, numbers)) and (self.scale > 0 or self.function in THRESHOLDS)
        fine = fine and (self.function not in WITH_POSITIVE_ORDER or self.order > 0)
        if self.function == "sawtooth":  # as often around a whole turn as its order says
            around = QUANTITIES[self.quantity].circular
            whole = self.order >= 1.0 and float(self.order).is_integer()
            fine = fine and ((whole and self.scale == 1.0) if around else self.order == 1.0)
        own = QUANTITIES[self.quantity].own
        fine = fine and (own not in ("fading", "swinging", "spreading", "trailing") or self.y > 0)
        fine = fine and (own not in ("swinging", "spreading") or self.x >= 0)
        require(fine, f"{self.quantity} with {numbers}", "finite numbers, a scale above 0", "correct the factor")

    @property
    def powers(self) -> dict[str, float]:
        """Powers of m, s and rad in the factor's unit."""
        keeps = FUNCTIONS[self.function][1]
        return powers_of(QUANTITIES[self.quantity].unit, self.order) if keeps else {}


@dataclass(frozen=True)
class Term:
    """``coefficient`` (of what makes the product the target's unit) times ``factors``, in direction of ``target``;
    ``x``, ``y``: the target's own angle in ``x`` (rad), or place (m), or wind (m/s), or the number of a camera or
    marker in ``x`` and its direction in ``y`` (rad).  ``sd``: of the coefficient."""

    target: str
    coefficient: float
    factors: tuple[Factor, ...] = ()
    x: float = 0.0
    y: float = 0.0
    sd: float = math.nan

    def __post_init__(self) -> None:
        known = self.target in TARGETS
        require(known, f"target {self.target!r} of a law", SOME_TARGET, "correct the name")
        fine = all(map(math.isfinite, (self.coefficient, self.x, self.y)))
        require(fine, f"a term of {self.target} with {self.coefficient}", "finite numbers", "correct the term")
        few = len(self.factors) <= W.MOST_FACTORS
        require(few, f"{len(self.factors)} factors", f"{W.MOST_FACTORS} at the most", "take factors out")
        own = TARGETS[self.target].own
        if own in (*CAMERAS, *MARKERS):
            what = "camera" if own in CAMERAS else "marker"
            counted = self.x >= 0 and self.x == int(self.x)
            require(counted, f"{what} {self.x:g} of {self.target}", f"a number of a {what}, from 0", "correct x")

    @property
    def powers(self) -> dict[str, float]:
        """Powers of m and s in the coefficient's unit."""
        total = powers_of(TARGETS[self.target].unit)
        for one in self.factors:
            for base, power in one.powers.items():
                total[base] = total.get(base, 0.0) - power
        return total

    @property
    def unit(self) -> str:
        """Unit of the coefficient."""
        return in_words(self.powers)

    def row(self) -> list[float]:
        """The term's row of a packed law."""
        out = [float(TARGETS[self.target].code), self.x, self.y, self.coefficient, float(len(self.factors))]
        for one in self.factors:
            out += [QUANTITIES[one.quantity].code, one.x, one.y, FUNCTIONS[one.function][0], one.order, one.scale]
        return out + [0.0] * (W.ROW_SIZE - len(out))


@dataclass(frozen=True)
class WrittenLaw:
    """Terms that are added up; all act in one ``stage`` ("flight", "impact", "geometry" or "measurement")."""

    terms: tuple[Term, ...]

    def __post_init__(self) -> None:
        most = most_terms(self.terms)
        some = 1 <= len(self.terms) <= most
        require(some, f"a law of {len(self.terms)} terms", f"1 to {most}", "split the law, or merge its terms")
        one = len({TARGETS[t.target].stage for t in self.terms}) == 1
        require(one, "a law of several stages", "terms of one stage", "write a law for each stage")
        for term in self.terms:
            for factor in term.factors:
                expected = expected_instead(term.target, factor.quantity)
                said = f"{factor.quantity} in a law of the {self.stage}"
                require(expected is None, said, expected or "", "take another quantity")

    @property
    def stage(self) -> str:
        """Where it acts."""
        return TARGETS[self.terms[0].target].stage

    def moved(self, turn_rad: float, origin_m: Sequence[float] = (0.0, 0.0)) -> WrittenLaw:
        """The same law in a frame in which its own frame's x axis points to ``turn_rad`` and its origin lies at
        ``origin_m``."""
        return WrittenLaw(tuple(_moved_term(one, turn_rad, (origin_m[0], origin_m[1])) for one in self.terms))

    def in_units(self, length_m: float, time_s: float) -> WrittenLaw:
        """The same law in numbers that count lengths in units of ``length_m`` and times in units of ``time_s``."""
        units = {"m": length_m, "s": time_s, "px": 1.0}
        return WrittenLaw(tuple(_in_units(one, units) for one in self.terms))

    def later(self, time_s: float, clock_rad: float = 0.0) -> WrittenLaw:
        """The same law for a run whose time counts from ``time_s`` on, when the drive's clock has come to
        ``clock_rad``."""
        late = {"time": time_s, "clock": clock_rad}

        def shifted(one: Factor) -> Factor:
            return replace(one, x=one.x - late.get(one.quantity, 0.0))

        return WrittenLaw(tuple(replace(term, factors=tuple(map(shifted, term.factors))) for term in self.terms))


def most_terms(terms: Sequence[Term]) -> int:
    """As many terms as a law of these may have at the most."""
    of_measurement = all(TARGETS[term.target].stage == "measurement" for term in terms)
    return MOST_OF_MEASUREMENT if of_measurement else MOST_TERMS


def rows_of(terms: Sequence[Term]) -> Floats:
    """Packed rows (T, ROW_SIZE) of terms."""
    return np.array([one.row() for one in terms], float).reshape(-1, W.ROW_SIZE)


def asks_for_contacts(rows: Floats) -> bool:
    """Whether any of packed ``rows`` (T, ROW_SIZE) asks for contacts before."""
    of_contacts = _follow(rows, (*W.OF_LAST_CONTACT, *W.OF_BLOWS))
    return of_contacts or bool(np.any(rows[:, W.TARGET] == TARGETS["from_last_contact"].code))


def _follow(rows: Floats, names: Sequence[str]) -> bool:
    """Whether any factor of packed ``rows`` (T, ROW_SIZE) follows one of the quantities ``names``."""
    codes = [QUANTITIES[name].code for name in names]
    asked = [rows[:, W.FIRST + W.FACTOR_SIZE * i + W.QUANTITY] for i in range(W.MOST_FACTORS)]
    return bool(np.any([np.isin(code, codes) & (rows[:, W.FACTORS] > i) for i, code in enumerate(asked)]))


def asks_for_way(rows: Floats) -> bool:
    """Whether any of packed ``rows`` (T, ROW_SIZE) asks for the way over the floor."""
    return _follow(rows, W.OF_WAY)


def powers_of(unit: str, times: float = 1.0) -> dict[str, float]:
    """Powers of the base units in ``unit`` (m, s, rad, 1; ``m/s^2``), ``times`` over."""
    top, _, bottom = unit.partition("/")
    out: dict[str, float] = {}
    for part, sign in ((top, 1.0), (bottom, -1.0)):
        base, _, power = part.partition("^")
        if base not in ("", "1", "rad"):
            out[base] = out.get(base, 0.0) + sign * float(power or 1) * times
    return out


def in_words(powers: dict[str, float]) -> str:
    """``m/s^2`` from powers of base units."""

    def side(sign: float) -> str:
        parts = [
            base + ("" if abs(p) == 1 else f"^{abs(p):g}") for base, p in sorted(powers.items()) if sign * p > 1e-12
        ]
        return " ".join(parts)

    top, bottom = side(1.0), side(-1.0)
    if not bottom:
        return top or "1"
    return f"{top or '1'}/{bottom if ' ' not in bottom else '(' + bottom + ')'}"


def _moved_term(term: Term, turn: float, origin: tuple[float, float]) -> Term:
    x, y = _moved_own(TARGETS[term.target].own, term.x, term.y, turn, origin)
    factors = []
    for one in term.factors:
        own = QUANTITIES[one.quantity].own
        if one.quantity in W.BETWEEN_THINGS:  # no directions in the room
            own = ""
        fx, fy = _moved_own(own, one.x, one.y, turn, origin)
        factors.append(replace(one, x=fx, y=fy))
    return replace(term, x=x, y=y, factors=tuple(factors))


def _moved_own(own: str, x: float, y: float, turn: float, origin: tuple[float, float]) -> tuple[float, float]:
    c, s = math.cos(turn), math.sin(turn)
    if own in ("angle", "turning"):
        return wrapped(x + turn, W.TURN), y
    if own == "axis":
        return wrapped(x + turn, math.pi), y
    if own == "room_line":
        angle = y + turn
        return x + math.cos(angle) * origin[0] + math.sin(angle) * origin[1], wrapped(angle, W.TURN)
    if own in ("line", "marker"):
        return x, wrapped(y + turn, W.TURN)
    if own in ("room", "host", "wind"):
        shift = origin if own == "room" else (0.0, 0.0)
        return c * x - s * y + shift[0], s * x + c * y + shift[1]
    return x, y


def _in_units(term: Term, units: dict[str, float]) -> Term:
    def size(powers: dict[str, float]) -> float:
        return math.prod(units[base] ** power for base, power in powers.items())

    def place(own: str, unit: str, x: float, y: float) -> tuple[float, float]:
        if own in ("angle", "axis", *CAMERAS, *MARKERS):
            return x, y
        if own in ("room", "host"):
            return x / units["m"], y / units["m"]
        if own == "wind":
            unit_m_per_s = units["m"] / units["s"]
            return x / unit_m_per_s, y / unit_m_per_s
        if own == "time":
            return x / units["s"], y
        if own == "turning":
            return x, y * units["s"]
        if own == "swinging":
            return x * units["s"], y / units["s"]
        if own == "spreading":
            return x / units["s"], y
        if own == "trailing":
            return x, y / units["m"]
        return x / size(powers_of(unit)), y / units["s"] if own == "fading" else y

    factors = []
    for one in term.factors:
        quantity = QUANTITIES[one.quantity]
        x, y = place(quantity.own, quantity.unit, one.x, one.y)
        unit = size(powers_of(quantity.unit)) if one.function in SCALED else 1.0
        order = one.order / unit if one.function in W.TRAINS else one.order
        factors.append(replace(one, x=x, y=y, scale=one.scale / unit, order=order))
    x, y = place(TARGETS[term.target].own or "angle", "1", term.x, term.y)
    unit = size(term.powers)
    return replace(term, coefficient=term.coefficient / unit, sd=term.sd / unit, x=x, y=y, factors=tuple(factors))


def wrapped(angle: float, period: float) -> float:
    """``angle`` within half a ``period`` of zero."""
    return (angle + 0.5 * period) % period - 0.5 * period
