"""A packed law's terms, evaluated in compiled code: the same for the simulator, the flights' fits and the search."""

from __future__ import annotations

import math

from ovines.core.compiled import Floats, compiled
from ovines.core.laws import words as W

# As the targets and quantities are numbered in `words`; a test holds them together.
(
    FIXED, OUTWARDS, SWIRL, ALONG_V, ACROSS_V, MIRRORED_V, ALONG_U, ACROSS_U, MIRRORED_R, FROM_ROOM, FROM_HOST,
    FRICTION, MIRRORED_FRICTION, ALONG_BODY, SPIN, FROM_CONTACT, ALONG_W, ALONG_A, POLAR_FRICTION,
    FLOOR_LEVER, FLOOR_TORQUE,
) = range(21)  # fmt: skip
(
    Q_SPEED, Q_SLIDING, Q_RADIUS, Q_GAP, Q_SPIN, Q_TIME, Q_PHASE, Q_SINCE, Q_AZIMUTH, Q_RUN, Q_ROOM, Q_HOST, Q_ALONG,
    Q_VELOCITY, Q_APPROACH, Q_SLIP, Q_BODY, Q_CLOCK, Q_SHARE, Q_ANGLE, Q_WALL_SPEED,
    Q_PASSING, Q_INCIDENCE, Q_SLIDING_ALONG, Q_RADIAL, Q_CIRCLING, Q_HOST_SPEED, Q_HOST_ACCELERATION, Q_FROM_CONTACT,
    Q_CONTACT_TURN, Q_LAST_APPROACH, Q_SPIN_LEFT, Q_SLIDING_DIRECTION, Q_ACCELERATION_ALONG, Q_ACCELERATION_OUTWARDS,
    Q_FLOOR_ALONG, Q_SINCE_BY_BLOW, Q_HEADING, Q_SLIDING_HEADING, Q_TURNING, Q_RIM_TURN, Q_LAST_SLIP, Q_BLOWS,
    Q_NUMBER_OF_BLOWS, Q_SWING, Q_SWING_RATE, Q_OVALLING, Q_PLACE_ALONG_SLIDING, Q_AT_CYLINDER,
) = range(49)  # fmt: skip
(
    POWER,
    ABSOLUTE,
    COSINE,
    SINE,
    EXPONENTIAL,
    GAUSSIAN,
    BELOW,
    SIGN,
    PULSES,
    GATES,
    ABOVE,
    TANH,
    DECAY,
    RATIONAL,
    WITHIN,
    SAWTOOTH,
) = range(16)
# A direction of something so short (m, m/s) is none.
SHORT = 1e-12


@compiled
def before_impact(code: int, known: Floats) -> float:
    """Value of a quantity that is known of impacts only."""
    if code == Q_APPROACH:
        return known[W.APPROACH]
    if code == Q_SLIP:
        return known[W.SLIP]
    if code == Q_WALL_SPEED:
        return known[W.WALL_SPEED]
    if code == Q_PASSING:
        return known[W.PASSING]
    if code == Q_AT_CYLINDER:
        return known[W.AT_CYLINDER]
    return math.atan2(abs(known[W.SLIP]), known[W.APPROACH])


@compiled
def of_host_or_contact(code: int, known: Floats) -> float:
    """Value of a quantity that goes with the Host's motion, or with the contact before."""
    hx, hy = known[W.HX], known[W.HY]
    if code == Q_RADIAL or code == Q_CIRCLING:
        length = math.hypot(hx, hy)
        if length < SHORT:
            return 0.0
        if code == Q_RADIAL:
            return (known[W.UX] * hx + known[W.UY] * hy) / length
        return (known[W.UY] * hx - known[W.UX] * hy) / length
    if code == Q_HOST_SPEED:
        return math.hypot(known[W.VX] - known[W.UX], known[W.VY] - known[W.UY])
    if code == Q_HOST_ACCELERATION:
        return math.hypot(known[W.HOST_AX], known[W.HOST_AY])
    if code == Q_FROM_CONTACT:
        return math.hypot(hx - known[W.LAST_X], hy - known[W.LAST_Y])
    if code == Q_CONTACT_TURN or code == Q_RIM_TURN:
        turn = math.atan2(hy, hx) - math.atan2(known[W.LAST_Y], known[W.LAST_X])
        return turn - (known[W.ANGLE] - known[W.LAST_ANGLE]) if code == Q_RIM_TURN else turn
    if code == Q_LAST_SLIP:
        return known[W.LAST_SLIP]
    if code == Q_SPIN_LEFT:
        return known[W.SPIN_LEFT]
    if code == Q_SLIDING_DIRECTION:
        return math.atan2(known[W.UY], known[W.UX])
    if code == Q_HEADING:
        return math.atan2(known[W.VY], known[W.VX]) - known[W.ANGLE]
    if code == Q_SLIDING_HEADING:
        return math.atan2(known[W.UY], known[W.UX]) - known[W.ANGLE]
    if code == Q_SINCE_BY_BLOW:
        return known[W.SINCE] / max(known[W.LAST_APPROACH], SHORT)
    if code == Q_ACCELERATION_OUTWARDS:
        length = math.hypot(hx, hy)
        return (known[W.HOST_AX] * hx + known[W.HOST_AY] * hy) / length if length > SHORT else 0.0
    return known[W.LAST_APPROACH]


@compiled
def along(code: int, x: float, known: Floats) -> float:
    """Part of a velocity, or of the Host's acceleration, along the direction ``x``."""
    c, s = math.cos(x), math.sin(x)
    if code == Q_VELOCITY:
        return c * known[W.VX] + s * known[W.VY]
    if code == Q_SLIDING_ALONG:
        return c * known[W.UX] + s * known[W.UY]
    if code == Q_ACCELERATION_ALONG:
        return c * known[W.HOST_AX] + s * known[W.HOST_AY]
    return c * (known[W.VX] - known[W.UX]) + s * (known[W.VY] - known[W.UY])


@compiled
def azimuth(code: int, rate: float, known: Floats) -> float:
    """Direction from the Host's centre: in the room, seen from the disk, or from what goes round at a ``rate``."""
    seen = math.atan2(known[W.HY], known[W.HX])
    if code == Q_BODY:
        return seen - known[W.ANGLE]
    return seen - rate * known[W.TIME] if code == Q_TURNING else seen


@compiled
def recent_blows(fades_s: float, known: Floats) -> float:
    """Squared normal speeds of the last impacts, each as it has faded within ``fades_s`` (m^2/s^2)."""
    total = 0.0
    for i in range(W.MOST_BLOWS):
        speed = known[W.BLOW_SPEEDS + i]
        if speed > 0.0:
            total += speed * speed * math.exp(-(known[W.TIME] - known[W.BLOW_TIMES + i]) / fades_s)
    return total


@compiled
def swing(code: int, rate: float, fades_s: float, known: Floats) -> float:
    """What the last impacts set swinging at ``rate`` (rad/s), as it fades within ``fades_s``: by their normal speeds
    (m/s), and as far as it goes out to where the disk is."""
    out, total = math.atan2(known[W.HY], known[W.HX]), 0.0
    lobes = 2.0 if code == Q_OVALLING else 1.0
    for i in range(W.MOST_BLOWS):
        speed = known[W.BLOW_SPEEDS + i]
        if speed > 0.0:
            since = known[W.TIME] - known[W.BLOW_TIMES + i]
            turned = rate * since
            wave = math.cos(turned) if code == Q_SWING_RATE else math.sin(turned)
            total += speed * math.exp(-since / fades_s) * wave * math.cos(lobes * (out - known[W.BLOW_WAYS + i]))
    return total


@compiled
def of_blows(code: int, x: float, y: float, known: Floats) -> float:
    """Value of a quantity that goes with the blows before."""
    if code == Q_BLOWS:
        return recent_blows(y, known) - x
    if code == Q_NUMBER_OF_BLOWS:
        return known[W.BLOWS] - x
    return swing(code, x, y, known)


@compiled
def quantity(code: int, x: float, y: float, known: Floats) -> float:
    """Value of a quantity; ``x``, ``y`` its own place, or angle, or what it counts from in ``x``; of a line its angle,
    of what turns its rate, of what fades its time in ``y``; of what swings its rate and the time in which it fades."""
    if code == Q_SPEED:
        return math.hypot(known[W.VX], known[W.VY]) - x
    if code == Q_SLIDING:
        return math.hypot(known[W.UX], known[W.UY]) - x
    if code == Q_RADIUS:
        return math.hypot(known[W.HX], known[W.HY]) - x
    if code == Q_GAP:
        return known[W.CONTACT_RADIUS] - math.hypot(known[W.HX], known[W.HY]) - x
    if code == Q_SPIN:
        return known[W.SPIN] - x
    if code == Q_TIME:
        return known[W.TIME] - x
    if code == Q_PHASE:
        return known[W.PHASE] - x
    if code == Q_SINCE:
        return known[W.SINCE] - x
    if code == Q_AZIMUTH or code == Q_BODY or code == Q_TURNING:
        return azimuth(code, y, known) - x
    if code == Q_RUN:
        return known[W.RUN] - x
    if code == Q_ROOM:
        return math.hypot(known[W.X] - x, known[W.Y] - y)
    if code == Q_HOST:
        return math.hypot(known[W.HX] - x, known[W.HY] - y)
    if code == Q_ALONG:
        return math.cos(y) * known[W.HX] + math.sin(y) * known[W.HY] - x
    if code == Q_VELOCITY or code == Q_SLIDING_ALONG or code == Q_ACCELERATION_ALONG or code == Q_FLOOR_ALONG:
        return along(code, x, known)
    if code == Q_SHARE or code == Q_ANGLE or code == Q_CLOCK:
        return known[W.SHARE if code == Q_SHARE else (W.ANGLE if code == Q_ANGLE else W.CLOCK)] - x
    if Q_BLOWS <= code <= Q_OVALLING:
        return of_blows(code, x, y, known)
    if code == Q_PLACE_ALONG_SLIDING:
        return (known[W.HX] - x) * known[W.UX] + (known[W.HY] - y) * known[W.UY]
    if code >= Q_RADIAL and code != Q_AT_CYLINDER:
        return of_host_or_contact(code, known) - x
    return before_impact(code, known) - x


@compiled
def remembers(known: Floats) -> bool:
    """Whether a contact before is known: its place is never the Host's centre."""
    return known[W.LAST_X] != 0.0 or known[W.LAST_Y] != 0.0


@compiled
def circular(code: int) -> bool:
    """Whether the quantity's ends meet."""
    return (
        code == Q_AZIMUTH or code == Q_BODY or code == Q_PHASE or code == Q_CLOCK or code == Q_ANGLE
        or code == Q_CONTACT_TURN or code == Q_SLIDING_DIRECTION or code == Q_HEADING or code == Q_SLIDING_HEADING
        or code == Q_TURNING or code == Q_RIM_TURN
    )  # fmt: skip


@compiled
def factor(row: Floats, at: int, known: Floats) -> float:
    """Value of the factor whose numbers start at ``at``."""
    code = int(row[at + W.QUANTITY])
    last = Q_FROM_CONTACT <= code <= Q_LAST_APPROACH or Q_RIM_TURN <= code <= Q_LAST_SLIP or code == Q_SINCE_BY_BLOW
    if last and not remembers(known):
        return 0.0
    q = quantity(code, row[at + W.QUANTITY_X], row[at + W.QUANTITY_Y], known)
    function, order, scale = int(row[at + W.FUNCTION]), row[at + W.ORDER], row[at + W.SCALE]
    if function == POWER:
        return q if order == 1.0 else q**order
    if function == ABSOLUTE:
        return abs(q) ** order
    if function == COSINE:
        return math.cos(order * q / scale)
    if function == SINE:
        return math.sin(order * q / scale)
    if function == EXPONENTIAL:
        return math.exp(-q / scale)
    if function == GAUSSIAN or function == WITHIN or function == SAWTOOTH:
        if circular(code):
            turns = order if function == SAWTOOTH else 1.0
            q = math.atan2(math.sin(turns * q), math.cos(turns * q))
        if function == SAWTOOTH:  # jumps up by 1 at 0 (as often as its order says), and falls in between: mean 0
            return (0.5 if q > 0.0 else -0.5) - 0.5 * q / (math.pi * scale)
        if function == WITHIN:
            return 1.0 if abs(q) < scale else 0.0
        return math.exp(-0.5 * (q / scale) ** 2)
    if function == ABOVE:
        return (q - scale) ** order if q > scale else 0.0
    if function == TANH:
        return math.tanh(q / scale)
    if function == DECAY:
        return math.exp(-abs(q) / scale)
    if function == RATIONAL:
        return 1.0 / (1.0 + abs(q / scale) ** order)
    if function == BELOW:
        return 1.0 if q < scale else 0.0
    if function == PULSES or function == GATES:
        q -= scale * math.floor(q / scale + 0.5)
        if function == GATES:
            return 1.0 if abs(q) < 0.5 * order else 0.0
        return math.exp(-0.5 * (q / order) ** 2)
    return 1.0 if q > 0.0 else (-1.0 if q < 0.0 else 0.0)


@compiled
def size(row: Floats, known: Floats) -> float:
    """Coefficient times factors of a term."""
    value = row[W.COEFFICIENT]
    for i in range(int(row[W.FACTORS])):
        value *= factor(row, W.FIRST + W.FACTOR_SIZE * i, known)
    return value


@compiled
def of_friction(target: int, angle: float, value: float, known: Floats, out: Floats) -> None:
    """Add to ``out`` (3,) ``value`` times a part of the floor's friction; ``angle`` of its mirror or its lever."""
    if target == FRICTION:
        out[0] += value * known[W.FX]
        out[1] += value * known[W.FY]
        out[2] += value * known[W.FT]
        return
    if target == FLOOR_LEVER:
        c, s = math.cos(known[W.ANGLE] + angle), math.sin(known[W.ANGLE] + angle)
        out[2] += value * (c * known[W.FY] - s * known[W.FX])
        return
    if target == FLOOR_TORQUE:
        out[2] += value * known[W.FT]
        return
    if target == POLAR_FRICTION:
        length = math.hypot(known[W.HX], known[W.HY])
        if length > SHORT:
            c, s = known[W.HX] / length, known[W.HY] / length
            c, s = c * c - s * s, 2.0 * c * s
            out[0] += value * (c * known[W.FX] + s * known[W.FY])
            out[1] += value * (s * known[W.FX] - c * known[W.FY])
        return
    if target == MIRRORED_FRICTION:
        c, s = math.cos(2.0 * angle), math.sin(2.0 * angle)
        out[0] += value * (c * known[W.FX] + s * known[W.FY])
        out[1] += value * (s * known[W.FX] - c * known[W.FY])
        return


@compiled
def push(row: Floats, times: float, known: Floats, out: Floats) -> None:
    """Add ``times`` what a term of the flight gives to ``out`` (3,): acceleration along x and y, and of the spin."""
    value = times * size(row, known)
    target = int(row[W.TARGET])
    x, y = 0.0, 0.0
    if target == FIXED:
        out[0] += value * math.cos(row[W.TARGET_X])
        out[1] += value * math.sin(row[W.TARGET_X])
        return
    if target == SPIN:
        out[2] += value
        return
    if target == ALONG_BODY:
        out[0] += value * math.cos(known[W.ANGLE] + row[W.TARGET_X])
        out[1] += value * math.sin(known[W.ANGLE] + row[W.TARGET_X])
        return
    if FRICTION <= target <= MIRRORED_FRICTION or POLAR_FRICTION <= target <= FLOOR_TORQUE:
        of_friction(target, row[W.TARGET_X], value, known, out)
        return
    if target == OUTWARDS or target == SWIRL or target == MIRRORED_R:
        x, y = known[W.HX], known[W.HY]
    elif target == ALONG_V or target == ACROSS_V or target == MIRRORED_V:
        x, y = known[W.VX], known[W.VY]
    elif target == ALONG_U or target == ACROSS_U:
        x, y = known[W.UX], known[W.UY]
    elif target == ALONG_W:
        x, y = known[W.VX] - known[W.UX], known[W.VY] - known[W.UY]
    elif target == ALONG_A:
        x, y = known[W.HOST_AX], known[W.HOST_AY]
    elif target == FROM_CONTACT and remembers(known):
        x, y = known[W.HX] - known[W.LAST_X], known[W.HY] - known[W.LAST_Y]
    elif target == FROM_ROOM:
        x, y = known[W.X] - row[W.TARGET_X], known[W.Y] - row[W.TARGET_Y]
    elif target == FROM_HOST:
        x, y = known[W.HX] - row[W.TARGET_X], known[W.HY] - row[W.TARGET_Y]
    length = math.hypot(x, y)
    if length < SHORT:
        return
    x, y = x / length, y / length
    if target == SWIRL or target == ACROSS_V or target == ACROSS_U:
        x, y = -y, x
    elif target == MIRRORED_V or target == MIRRORED_R:
        c, s = math.cos(2.0 * row[W.TARGET_X]), math.sin(2.0 * row[W.TARGET_X])
        x, y = c * x + s * y, s * x - c * y
    out[0] += value * x
    out[1] += value * y


@compiled
def pushes(rows: Floats, known: Floats, out: Floats) -> None:
    """Fill ``out`` (N, 3, T) with what each of ``rows`` (T, ROW_SIZE) gives in each of the states ``known``
    (N, KNOWN_SIZE)."""
    out[:] = 0.0
    for i in range(known.shape[0]):
        for j in range(rows.shape[0]):
            push(rows[j], 1.0, known[i], out[i, :, j])


@compiled
def sizes(rows: Floats, known: Floats, out: Floats) -> None:
    """Fill ``out`` (N, T) with coefficient times factors of each of ``rows`` in each of the states ``known``."""
    for i in range(known.shape[0]):
        for j in range(rows.shape[0]):
            out[i, j] = size(rows[j], known[i])


@compiled
def law_of(target: int, rows: Floats, known: Floats) -> float:
    """Sum of the terms that act on one number (restitution, ...)."""
    total = 0.0
    for j in range(rows.shape[0]):
        if int(rows[j, W.TARGET]) == target:
            total += size(rows[j], known)
    return total
