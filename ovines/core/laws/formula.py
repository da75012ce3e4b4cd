"""A written law as a formula: LaTeX for pages, one line of text for tables."""

from __future__ import annotations

import math

from ovines.core.laws.targets import (
    BOARDS,
    DIRECTED,
    HOST_PLACE,
    HOST_TILT,
    MARKER_NEIGHBOUR,
    MARKER_WAY,
    NES_PLACE,
    TARGETS,
)
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.core.laws.words import ALONG, LINES, QUANTITIES

#: a function in text and in LaTeX: of a quantity ``q`` over its ``scale``, with its ``order``, as a ``power`` where it
#: is not 1, or as a ``width`` or ``half`` of that; cosine, sine and sawtooth are set by themselves
FORMS = {
    "power": ("{q}{power}", "{q}{power}"),
    "absolute_power": ("|{q}|{power}", "|{q}|{power}"),
    "exponential": ("exp(-{q} / {scale})", "e^{{-{q}/{scale}}}"),
    "gaussian": ("exp(-({q} / {scale})^2 / 2)", r"e^{{-\frac{{1}}{{2}}({q}/{scale})^2}}"),
    "below": ("[{q} < {scale}]", "[{q}<{scale}]"),
    "beyond": ("[{q} >= {scale}]", r"[{q}\geq{scale}]"),
    "above": ("max({q} - {scale}, 0){power}", r"\max({q}-{scale},\,0){power}"),
    "tanh": ("tanh({q} / {scale})", r"\tanh({q}/{scale})"),
    "decay": ("exp(-|{q}| / {scale})", "e^{{-|{q}|/{scale}}}"),
    "rising": ("(1 - exp(-|{q}| / {scale}))", "(1-e^{{-|{q}|/{scale}}})"),
    "rational": ("1/(1 + |{q} / {scale}|^{order})", r"\frac{{1}}{{1+|{q}/{scale}|{power}}}"),
    "within": ("[|{q}| < {scale}]", r"[\,|{q}|<{scale}\,]"),
    "pulses": (
        "pulses({q}, every {scale}, width {width})",
        r"\sum_k\,e^{{-\frac{{1}}{{2}}(({q}-k\cdot {scale})/{width})^2}}",
    ),
    "gates": ("gates({q}, every {scale}, width {width})", r"\sum_k\,[\,|{q}-k\cdot {scale}|<{half}\,]"),
    "sign": ("sign({q})", r"\mathrm{{sgn}}({q})"),
}

#: what a law changes: left-hand side in LaTeX and in text, by target; of the flight all terms make one acceleration
CHANGES = {
    "restitution": (r"\Delta\varepsilon", "restitution +="),
    "wall_friction": (r"\Delta\mu_w", "wall friction +="),
    "tangential_restitution": (r"\Delta\beta_0", "tangential restitution +="),
    "spin_kept": (r"\Delta(\omega'/\omega)", "share of the spin kept +="),
    "spin_added": (r"\Delta\omega'", "spin after an impact +="),
    "contact_normal": (r"\Delta\alpha_n", "direction of the blow +="),
    "contact_radius": (r"\Delta R_c", "contact radius +="),
    "spin": (r"\Delta\dot\omega", "spin' +="),
    "clock_delay": (r"\Delta\tau", "delay of all cameras +="),
    "nes_place": (r"\Delta\vec x_{\mathrm{NES}}", "place where the NES is seen +="),
    "nes_place_outwards": (r"\Delta\vec x_{\mathrm{NES}}", "place where the NES is seen +="),
    "host_place": (r"\Delta\vec x_{\mathrm{Host}}", "place where the Host is seen +="),
    "host_tilt": (r"\Delta\nabla z_{\mathrm{Host}}", "tilt of the Host's markers +="),
    "nes_card": (r"\Delta\vec s_{\mathrm{NES}}", "place of all markers of the NES +="),
    "nes_card_turn": (r"\Delta\psi_{\mathrm{NES}}", "turn of all markers of the NES +="),
    "marker_way": (r"\Delta\vec x_m", "place of every marker +="),
    "marker_neighbour": (r"\Delta\vec x_m", "place of every marker +="),
    "board_stretch": (r"\Delta\vec x", "place by the boards +="),
    "board_bow": (r"\Delta\vec x", "place by the boards +="),
}
#: the same of targets that the number of a camera or a marker stands with
NUMBERED = {
    "picture_u": (r"\Delta u_{{{}}}", "picture u of camera {} +="),
    "picture_v": (r"\Delta v_{{{}}}", "picture v of camera {} +="),
    "picture_zoom": (r"\Delta z_{{{}}}", "zoom of camera {} +="),
    "picture_turn": (r"\Delta\rho_{{{}}}", "turn of camera {} +="),
    "picture_stretch": (r"\Delta s_{{{}}}", "stretch of camera {} +="),
    "picture_radial": (r"\Delta k_{{{}}}", "radial distortion of camera {} +="),
    "picture_decentring": (r"\Delta\vec p_{{{}}}", "decentring of camera {} +="),
    "picture_skew": (r"\Delta\gamma_{{{}}}", "skew of camera {} +="),
    "nes_picture_u": (r"\Delta u^{{\mathrm{{NES}}}}_{{{}}}", "picture u of the NES in camera {} +="),
    "nes_picture_v": (r"\Delta v^{{\mathrm{{NES}}}}_{{{}}}", "picture v of the NES in camera {} +="),
    "camera_delay": (r"\Delta\tau_{{{}}}", "delay of camera {} +="),
    "host_marker": (r"\Delta\vec s_{{{}}}", "place of marker {} of the Host +="),
    "nes_marker": (r"\Delta\vec s_{{{}}}", "place of marker {} of the NES +="),
}
#: what a target of the boards stands for in one line
WAYS = dict(zip(BOARDS, ("place_along", "distance^2 * place_from"), strict=True))
#: ... and a direction
DIRECTIONS = {
    "nes_place": "direction",
    HOST_PLACE: "direction",
    HOST_TILT: "direction",
    "nes_card": "body_direction",
    MARKER_WAY: "own_way",
    MARKER_NEIGHBOUR: "step",
}
FLIGHT = (r"\Delta\vec a", "acceleration +=")


def as_text(law: WrittenLaw) -> str:
    """The law in one line: ``acceleration += -13.2 1/s^2 * radius * outwards``."""
    parts = []
    for left, terms in _sides(law):
        said = " ".join(_text_term(term, first=i == 0) for i, term in enumerate(terms))
        parts.append(f"{left[1]} {said}")
    return "; ".join(parts)


def as_latex(law: WrittenLaw) -> str:
    """The law as a LaTeX formula, coefficients with their units."""
    return r",\quad ".join(" ".join(terms) for terms in _latex_sides(law))


def latex_lines(law: WrittenLaw, letters: int) -> list[str]:
    """:func:`as_latex` in lines of about so many ``letters`` of LaTeX, no term parted."""
    lines: list[str] = []
    for terms in _latex_sides(law):
        line = ""
        for term in terms:
            if line and len(line) + len(term) > letters:
                lines.append(line)
                line = r"\quad"
            line = f"{line} {term}".strip()
        lines.append(line)
    return lines


def _latex_sides(law: WrittenLaw) -> list[list[str]]:
    """Each side's terms in LaTeX, with what they change before the first."""
    out = []
    for left, terms in _sides(law):
        said = [_latex_term(term, first=i == 0) for i, term in enumerate(terms)]
        out.append([f"{left[0]} = {said[0]}", *said[1:]])
    return out


def _sides(law: WrittenLaw) -> list[tuple[tuple[str, str], list[Term]]]:
    sides: dict[tuple[str, str], list[Term]] = {}
    for term in law.terms:
        sides.setdefault(_changed(term), []).append(term)
    return list(sides.items())


def _has_direction(term: Term) -> bool:
    """Whether a term's own direction, or way, stands behind its factors."""
    return _changed(term) == FLIGHT or term.target in (*NES_PLACE, *DIRECTIONS, *WAYS)


def _changed(term: Term) -> tuple[str, str]:
    """What a term changes, in LaTeX and in text; cameras and markers count from 1 for people."""
    if term.target in NUMBERED:
        latex, text = NUMBERED[term.target]
        return latex.format(int(term.x) + 1), text.format(int(term.x) + 1)
    return CHANGES.get(term.target, FLIGHT)


def _number(value: float, first: bool) -> str:
    sign = "-" if value < 0 else ("" if first else "+ ")
    if value < 0 and not first:
        sign = "- "
    return f"{sign}{abs(value):.4g}"


def _text_term(term: Term, first: bool) -> str:
    parts = [_number(term.coefficient, first) + _text_unit(term.unit)]
    parts += [_text_factor(one, term) for one in term.factors]
    if _has_direction(term):
        own = TARGETS[term.target].own
        at = {
            "": "",
            "angle": f"({term.x:.3g} rad)",
            "axis": f"({term.x:.3g} rad)",
            "body": f"({term.x:.3g} rad)",
            "wind": f"({_wind(term)})",
            "time": f"({1e3 * term.x:+.3g} ms)",
        }.get(own, f"({_place(term)})")
        way = term.target.removeprefix("nes_place_")
        parts.append(WAYS.get(way, DIRECTIONS.get(way, way)) + at)
    elif TARGETS[term.target].own in DIRECTED:
        parts.append(f"direction({term.y:.3g} rad)")
    return " * ".join(parts)


def _place(one: Term | Factor) -> str:
    return f"{1e3 * one.x:.4g} mm, {1e3 * one.y:.4g} mm"


def _wind(one: Term | Factor) -> str:
    return f"wind {math.hypot(one.x, one.y):.4g} m/s to {math.atan2(one.y, one.x):.3g} rad"


def _spread(one: Factor) -> str:
    return f"{one.y:.3g} rad" + (f" and {one.x:.3g} s" if one.x else "")


def _text_quantity(one: Factor, term: Term) -> str:
    """A factor's quantity with what it has of its own."""
    unit = _text_unit(QUANTITIES[one.quantity].unit)
    own, name = QUANTITIES[one.quantity].own, one.quantity
    if own in ("room", "host"):
        # The target's own place is named with it.
        name = name if (one.x, one.y) == (term.x, term.y) else f"{name}({_place(one)})"
    elif own == "wind":
        name = name if (one.x, one.y) == (term.x, term.y) else f"{name}({_wind(one)})"
    elif own in LINES:
        name = f"({name}({one.y:.3g} rad)" + (f" - {1e3 * one.x:.3g} mm" if one.x else "") + ")"
    elif one.quantity in ALONG:
        name = f"{name}({one.x:.3g} rad)"
    elif own == "fading":
        name = f"{name}(within {one.y:.4g} s)"
    elif own == "trailing":
        name = f"{name}(within {1e3 * one.y:.4g} mm)"
    elif own == "swinging":
        name = f"{name}(" + (f"at {one.x:.4g} rad/s, " if one.x else "") + f"within {one.y:.4g} s)"
    elif own == "spreading":
        name = f"{name}(within {_spread(one)})"
    elif own == "turning":
        name = f"(azimuth {_counted(one.x)} rad {_counted(one.y)} rad/s * time)"
    elif one.x:
        name = f"({name} {_counted(one.x)}{unit})"
    return name


def _after_seen_blow(one: Factor) -> bool:
    """Whether a factor is 1 after a blow that was seen: what goes with the blow before is nothing without one."""
    return (one.quantity, one.function, one.scale) == ("last_left", "beyond", 0.0)


def _text_factor(one: Factor, term: Term) -> str:
    unit, name = _text_unit(QUANTITIES[one.quantity].unit), _text_quantity(one, term)
    scale, times = f"{one.scale:.4g}{unit}", "" if one.order == 1 else f"{one.order:g} "
    if _after_seen_blow(one):
        return "[after a blow that was seen]"
    if one.function in ("cosine", "sine"):
        inside = times + (name if one.scale == 1 else f"{name} / {scale}")
        return f"{one.function[:3]}{inside}" if _bracketed(inside) else f"{one.function[:3]}({inside})"
    if one.function == "sawtooth":
        circular = QUANTITIES[one.quantity].circular
        return f"sawtooth({times}{name})" if circular else f"sawtooth({name}, every {scale})"
    power = "" if one.order == 1 else f"^{one.order:g}"
    width = f"{one.order:.3g}{unit}"
    return FORMS[one.function][0].format(q=name, scale=scale, power=power, order=f"{one.order:g}", width=width)


def _counted(zero: float) -> str:
    """What a quantity counts from, taken off it."""
    return f"{'-' if zero > 0 else '+'} {abs(zero):.4g}"


def _bracketed(said: str) -> bool:
    """Whether one pair of brackets holds all of it."""
    return said.startswith("(") and said.endswith(")") and said.count("(") == 1


def _latex_number(value: float, first: bool) -> str:
    said = _number(value, first)
    if "e" in said:
        base, power = said.split("e")
        said = rf"{base}\cdot 10^{{{int(power)}}}"
    return said


def _text_unit(unit: str) -> str:
    """As it follows a number: nothing where that is a count or a ratio."""
    return "" if unit == "1" else f" {unit}"


def _latex_unit(unit: str) -> str:
    if unit in ("1", "rad"):
        return ""
    for power in "234":
        unit = unit.replace(f"^{power}", f"^{{{power}}}")
    return rf"\,\mathrm{{{unit.replace(' ', chr(92) + ',')}}}"


def _latex_term(term: Term, first: bool) -> str:
    parts = [_latex_number(term.coefficient, first) + _latex_unit(term.unit)]
    parts += [_latex_factor(one) for one in term.factors]
    if TARGETS[term.target].own == "time":
        parts.append(rf"{TARGETS[term.target].symbol}({1e3 * term.x:+.3g}\,\mathrm{{ms}})")
    elif _has_direction(term) or TARGETS[term.target].own in DIRECTED:
        parts.append(TARGETS[term.target].symbol)
    return r"\,".join(parts)


def _latex_factor(one: Factor) -> str:
    entry = QUANTITIES[one.quantity]
    symbol, unit = entry.symbol, _latex_unit(entry.unit)
    if (entry.own in LINES and one.x) or (entry.own in ("", "angle") and one.x and one.quantity not in ALONG):
        symbol = rf"({symbol}{_latex_number(-one.x, False)}{unit})"
    if entry.own == "turning":
        rate = _latex_number(-one.y, False) + _latex_unit("rad/s")
        symbol = rf"(\theta{_latex_number(-one.x, False)}{rate}\,t)"
    scale, times = _latex_number(one.scale, True) + unit, "" if one.order == 1 else f"{one.order:g}"
    if _after_seen_blow(one):
        return r"[\mathrm{after\ a\ blow\ that\ was\ seen}]"
    if one.function in ("cosine", "sine"):
        inside = times + (symbol if one.scale == 1 else rf"{symbol}/{scale}")
        return rf"\{one.function[:3]}{inside}" if _bracketed(inside) else rf"\{one.function[:3]}({inside})"
    if one.function == "sawtooth":
        return rf"\mathrm{{saw}}({times}{symbol})" if entry.circular else rf"\mathrm{{saw}}({symbol}/{scale})"
    power = "" if one.order == 1 else f"^{{{one.order:g}}}"
    width, half = (_latex_number(share * one.order, True) + unit for share in (1.0, 0.5))
    said = FORMS[one.function][1].format(q=symbol, scale=scale, power=power, width=width, half=half)
    return said.replace("--", "+") if one.function == "above" else said


def legend(law: WrittenLaw) -> list[tuple[str, str]]:
    """(LaTeX, meaning) of every symbol of the formula."""
    out: dict[str, str] = {}
    for term in law.terms:
        target = TARGETS[term.target]
        if _has_direction(term):
            out[target.symbol] = target.meaning + _own_of_target(term)
        elif target.own in DIRECTED:
            out[target.symbol] = f"{target.meaning}, at {term.y:.3g} rad"
        for one in term.factors:
            quantity = QUANTITIES[one.quantity]
            if quantity.own == "turning":
                # The formula writes it by the azimuth and the time.
                out |= {QUANTITIES[part].symbol: QUANTITIES[part].in_words for part in ("azimuth", "time")}
            else:
                out[quantity.symbol] = quantity.in_words + _own_of_quantity(one)
    return list(out.items())


def _own_of_target(term: Term) -> str:
    """What the target's place or angle is, after its meaning."""
    own = TARGETS[term.target].own
    said = {
        "angle": f", at {term.x:.3g} rad",
        "axis": f", about the axis at {term.x:.3g} rad",
        "body": f", at {term.x:.3g} rad from its own axis",
        "wind": f", {_wind(term)}",
        "time": "",
    }
    return said.get(own, f", at ({_place(term)})" if own else "")


def _own_of_quantity(one: Factor) -> str:
    """What the quantity's place, angle or range is, after its meaning."""
    own = QUANTITIES[one.quantity].own
    if one.quantity in ALONG:
        return f" of {one.x:.3g} rad"
    if own in LINES:
        return f" of {one.y:.3g} rad"
    said = {
        "room": f", at ({_place(one)})",
        "host": f", at ({_place(one)})",
        "wind": f", {_wind(one)}",
        "fading": f", within {one.y:.3g} s",
        "trailing": f", within {1e3 * one.y:.3g} mm",
        "swinging": (f", at {one.x:.3g} rad/s and" if one.x else ",") + f" within {one.y:.3g} s",
        "spreading": f", within {_spread(one)}",
    }
    return said.get(own, "")
