"""Values of the quantities that a law's factors follow, in compiled code."""

from __future__ import annotations

import math

from ovines.core.compiled import Floats, compiled
from ovines.core.laws import words as W
from ovines.core.laws.memory import trail, way_lately

# As `words` numbers them; a test holds them together.
(
    Q_SPEED, Q_SLIDING, Q_RADIUS, Q_GAP, Q_SPIN, Q_TIME, Q_PHASE, Q_SINCE, Q_AZIMUTH, Q_RUN, Q_ROOM, Q_HOST, Q_ALONG,
    Q_VELOCITY, Q_APPROACH, Q_SLIP, Q_BODY, Q_CLOCK, Q_SHARE, Q_ANGLE, Q_WALL_SPEED,
    Q_PASSING, Q_INCIDENCE, Q_SLIDING_ALONG, Q_RADIAL, Q_CIRCLING, Q_HOST_SPEED, Q_HOST_ACCELERATION, Q_FROM_CONTACT,
    Q_CONTACT_TURN, Q_LAST_APPROACH, Q_SPIN_LEFT, Q_SLIDING_DIRECTION, Q_ACCELERATION_ALONG, Q_ACCELERATION_OUTWARDS,
    Q_FLOOR_ALONG, Q_SINCE_BY_BLOW, Q_HEADING, Q_SLIDING_HEADING, Q_TURNING, Q_RIM_TURN, Q_LAST_SLIP, Q_BLOWS,
    Q_NUMBER_OF_BLOWS, Q_SWING, Q_SWING_RATE, Q_OVALLING, Q_PLACE_ALONG_SLIDING, Q_AT_CYLINDER, Q_AIRSPEED,
    Q_HOST_PLACE, Q_ALONG_ROOM, Q_ACCELERATION_AROUND, Q_BREATHING, Q_BREATHING_RATE, Q_BLOWS_HERE, Q_RIM_BLOWS_HERE,
    Q_LAST_SPUN, Q_STRUCK_RIM, Q_TURNED_SINCE, Q_LAST_LEFT, Q_OVALLING_RATE, Q_TWIST, Q_TWIST_RATE, Q_RECENT_RUBBING,
    Q_TURNED, Q_NES_PLACE, Q_SLIDING_FROM_BLOW, Q_OFF_PATH, Q_WAY_SINCE, Q_WAY, Q_TRAIL_ALONG, Q_TRAIL_ACROSS,
    Q_WAY_LATELY, Q_RIM_ANGLE, Q_LAST_AZIMUTH, Q_WALL_ACCELERATION, Q_NORMAL,
) = range(78)  # fmt: skip
# A direction of something so short (m, m/s) is none.
SHORT = 1e-12
# What has faded for so many of its times is forgotten: a ten millionth is left.
FORGOTTEN = 16.0


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
    if code == Q_WALL_ACCELERATION:
        return known[W.WALL_ACCELERATION]
    if code == Q_NORMAL:
        return known[W.NORMAL]
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
    if code == Q_LAST_SPUN:
        return known[W.LAST_SPUN]
    if code == Q_STRUCK_RIM:
        return math.atan2(known[W.LAST_Y], known[W.LAST_X]) - known[W.LAST_ANGLE]
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
    if code == Q_ACCELERATION_OUTWARDS or code == Q_ACCELERATION_AROUND:
        length = math.hypot(hx, hy)
        if length < SHORT:
            return 0.0
        if code == Q_ACCELERATION_OUTWARDS:
            return (known[W.HOST_AX] * hx + known[W.HOST_AY] * hy) / length
        return (known[W.HOST_AY] * hx - known[W.HOST_AX] * hy) / length
    return known[W.LAST_APPROACH]


@compiled
def along(code: int, x: float, known: Floats) -> float:
    """Part of a velocity, or of the Host's acceleration or place, along the direction ``x``."""
    c, s = math.cos(x), math.sin(x)
    if code == Q_VELOCITY:
        return c * known[W.VX] + s * known[W.VY]
    if code == Q_SLIDING_ALONG:
        return c * known[W.UX] + s * known[W.UY]
    if code == Q_ACCELERATION_ALONG:
        return c * known[W.HOST_AX] + s * known[W.HOST_AY]
    if code == Q_HOST_PLACE:
        return c * (known[W.X] - known[W.HX]) + s * (known[W.Y] - known[W.HY])
    if code == Q_NES_PLACE:
        return c * known[W.X] + s * known[W.Y]
    return c * (known[W.VX] - known[W.UX]) + s * (known[W.VY] - known[W.UY])


@compiled
def azimuth(code: int, rate: float, known: Floats) -> float:
    """Direction from the Host's centre: of the disk in the room, seen from the disk, or from what goes round at a
    ``rate``; of the contact before."""
    if code == Q_LAST_AZIMUTH:
        return math.atan2(known[W.LAST_Y], known[W.LAST_X])
    seen = math.atan2(known[W.HY], known[W.HX])
    if code == Q_BODY:
        return seen - known[W.ANGLE]
    return seen - rate * known[W.TIME] if code == Q_TURNING else seen


@compiled
def recent_blows(code: int, fades_s: float, known: Floats) -> float:
    """Squared normal speeds of the last impacts, or normal times tangential speeds, each as it has faded within
    ``fades_s`` (m^2/s^2)."""
    total = 0.0
    for i in range(W.MOST_BLOWS):
        speed = known[W.BLOW_SPEEDS + i]
        ago = (known[W.TIME] - known[W.BLOW_TIMES + i]) / fades_s
        if ago > FORGOTTEN:
            break
        if speed > 0.0:
            other = speed if code == Q_BLOWS else abs(known[W.BLOW_SLIPS + i])
            total += speed * other * math.exp(-ago)
    return total


@compiled
def swing(code: int, rate: float, fades_s: float, known: Floats) -> float:
    """What the last impacts set swinging at ``rate`` (rad/s), as it fades within ``fades_s``: by their normal speeds
    (m/s), and as far as it goes out to where the disk is; of what is twisted by their tangential speeds."""
    out, total = math.atan2(known[W.HY], known[W.HX]), 0.0
    lobes = 2.0 if code == Q_OVALLING or code == Q_OVALLING_RATE else (1.0 if code < Q_OVALLING else 0.0)
    goes = code == Q_SWING_RATE or code == Q_BREATHING_RATE or code == Q_OVALLING_RATE or code == Q_TWIST_RATE
    sizes = W.BLOW_SLIPS if code == Q_TWIST or code == Q_TWIST_RATE else W.BLOW_SPEEDS
    for i in range(W.MOST_BLOWS):
        since = known[W.TIME] - known[W.BLOW_TIMES + i]
        if since > FORGOTTEN * fades_s:
            break
        if known[W.BLOW_SPEEDS + i] > 0.0:
            wave = math.cos(rate * since) if goes else math.sin(rate * since)
            if lobes > 0.0:
                wave *= math.cos(lobes * (out - known[W.BLOW_WAYS + i]))
            total += known[sizes + i] * math.exp(-since / fades_s) * wave
    return total


@compiled
def blows_here(code: int, fades_s: float, width: float, known: Floats) -> float:
    """Normal speeds of the last impacts (m/s), each by how near to here it struck the wall, or the disk's rim (a
    Gaussian of ``width``, rad), as it fades within ``fades_s`` (0: never)."""
    here, first, total = math.atan2(known[W.HY], known[W.HX]), W.BLOW_WAYS, 0.0
    if known[W.AT_CYLINDER] > 0.0:
        here += math.pi
    if code == Q_RIM_BLOWS_HERE:
        here, first = here - known[W.ANGLE], W.BLOW_SIDES
    for i in range(W.MOST_BLOWS):
        speed = known[W.BLOW_SPEEDS + i]
        if speed > 0.0:
            turn = here - known[first + i]
            off = math.atan2(math.sin(turn), math.cos(turn)) / width
            ago = (known[W.TIME] - known[W.BLOW_TIMES + i]) / fades_s if fades_s > 0.0 else 0.0
            total += speed * math.exp(-0.5 * off * off - ago)
    return total


@compiled
def of_blows(code: int, x: float, y: float, known: Floats) -> float:
    """Value of a quantity that goes with the blows before."""
    if code == Q_BLOWS or code == Q_RECENT_RUBBING:
        return recent_blows(code, y, known) - x
    if code == Q_BLOWS_HERE or code == Q_RIM_BLOWS_HERE:
        return blows_here(code, x, y, known)
    if code == Q_NUMBER_OF_BLOWS:
        return known[W.BLOWS] - x
    return swing(code, x, y, known)


@compiled
def of_turns_or_blows(code: int, x: float, y: float, known: Floats) -> float:
    """Value of a quantity that counts the disk's turns, or goes with the blows before."""
    if code == Q_TURNED:
        return known[W.ANGLE] - known[W.START_ANGLE] - x
    if code == Q_TURNED_SINCE:
        return known[W.ANGLE] - known[W.LAST_ANGLE] - x
    return known[W.LAST_LEFT] - x if code == Q_LAST_LEFT else of_blows(code, x, y, known)


@compiled
def off_path(known: Floats) -> float:
    """Distance (m) from the line between the last two contacts, to the left of the way from one to the other."""
    along_x, along_y = known[W.LAST_X] - known[W.BEFORE_X], known[W.LAST_Y] - known[W.BEFORE_Y]
    length = math.hypot(along_x, along_y)
    if length < SHORT:
        return 0.0
    return (along_x * (known[W.HY] - known[W.BEFORE_Y]) - along_y * (known[W.HX] - known[W.BEFORE_X])) / length


@compiled
def of_way(code: int, x: float, y: float, known: Floats) -> float:
    """Value of a quantity that goes with the way over the floor, as it is or as it is remembered, or with how the rim
    takes part in it."""
    ux, uy = known[W.UX], known[W.UY]
    if code == Q_PLACE_ALONG_SLIDING:
        return (known[W.HX] - x) * ux + (known[W.HY] - y) * uy
    if code == Q_WAY or code == Q_WAY_SINCE:
        return known[W.WAY] - (known[W.WAY_BEFORE] if code == Q_WAY_SINCE else 0.0) - x
    if code == Q_SLIDING_FROM_BLOW:
        return math.atan2(uy, ux) - known[W.BLOW_WAYS] - x
    if code == Q_OFF_PATH:
        return off_path(known) - x
    if code == Q_WAY_LATELY:
        return way_lately(y, known) - x
    speed = math.hypot(ux, uy)
    if code == Q_RIM_ANGLE:
        return math.atan2(known[W.DISK_RADIUS] * known[W.SPIN], speed) - x
    if speed < SHORT:
        return 0.0
    mean_x, mean_y = trail(y, known)
    if code == Q_TRAIL_ALONG:
        return (mean_x * ux + mean_y * uy) / speed - x
    return (mean_y * ux - mean_x * uy) / speed - x


@compiled
def quantity(code: int, x: float, y: float, known: Floats) -> float:
    """Value of a quantity; ``x``, ``y`` its own place, wind, or angle, or what it counts from in ``x``; of a line its
    angle, of what turns its rate, of what fades its time in ``y``; of what swings its rate and the time in which it
    fades, of what spreads that time and its width; of a trail the length in which it fades in ``y``."""
    if code == Q_SPEED:
        return math.hypot(known[W.VX], known[W.VY]) - x
    if code == Q_SLIDING:
        return math.hypot(known[W.UX], known[W.UY]) - x
    if code == Q_RADIUS:
        return math.hypot(known[W.HX], known[W.HY]) - x
    if code == Q_GAP:
        # Within the wall there is none: what falls off with it would grow without end on a path drawn out into it.
        return max(known[W.CONTACT_RADIUS] - math.hypot(known[W.HX], known[W.HY]), 0.0) - x
    if code == Q_SPIN:
        return known[W.SPIN] - x
    if code == Q_TIME:
        return known[W.TIME] - x
    if code == Q_PHASE:
        return known[W.PHASE] - x
    if code == Q_SINCE:
        return known[W.SINCE] - x
    if code == Q_AZIMUTH or code == Q_BODY or code == Q_TURNING or code == Q_LAST_AZIMUTH:
        return azimuth(code, y, known) - x
    if code == Q_RUN:
        return known[W.RUN] - x
    if code == Q_ROOM:
        return math.hypot(known[W.X] - x, known[W.Y] - y)
    if code == Q_HOST:
        return math.hypot(known[W.HX] - x, known[W.HY] - y)
    if code == Q_AIRSPEED:
        return math.hypot(known[W.VX] - x, known[W.VY] - y)
    if code == Q_ALONG or code == Q_ALONG_ROOM:
        first, second = (W.HX, W.HY) if code == Q_ALONG else (W.X, W.Y)
        return math.cos(y) * known[first] + math.sin(y) * known[second] - x
    if (
        code == Q_VELOCITY or code == Q_SLIDING_ALONG or code == Q_FLOOR_ALONG
        or code == Q_ACCELERATION_ALONG or code == Q_HOST_PLACE or code == Q_NES_PLACE
    ):  # fmt: skip
        return along(code, x, known)
    if code == Q_SHARE or code == Q_ANGLE or code == Q_CLOCK:
        return known[W.SHARE if code == Q_SHARE else (W.ANGLE if code == Q_ANGLE else W.CLOCK)] - x
    if Q_BLOWS <= code <= Q_OVALLING or Q_BREATHING <= code <= Q_RIM_BLOWS_HERE or Q_TURNED_SINCE <= code <= Q_TURNED:
        return of_turns_or_blows(code, x, y, known)
    if Q_SLIDING_FROM_BLOW <= code <= Q_LAST_AZIMUTH or code == Q_PLACE_ALONG_SLIDING:
        return of_way(code, x, y, known)
    if code >= Q_RADIAL and code != Q_AT_CYLINDER and code < Q_WALL_ACCELERATION:
        return of_host_or_contact(code, known) - x
    return before_impact(code, known) - x


@compiled
def remembers(known: Floats) -> bool:
    """Whether a contact before is known: its place is never the Host's centre."""
    return known[W.LAST_X] != 0.0 or known[W.LAST_Y] != 0.0


@compiled
def remembers_two(known: Floats) -> bool:
    """Whether the contact before the last is known, too."""
    return remembers(known) and (known[W.BEFORE_X] != 0.0 or known[W.BEFORE_Y] != 0.0)


@compiled
def circular(code: int) -> bool:
    """Whether the quantity's ends meet."""
    return (
        code == Q_AZIMUTH or code == Q_BODY or code == Q_PHASE or code == Q_CLOCK or code == Q_ANGLE
        or code == Q_CONTACT_TURN or code == Q_SLIDING_DIRECTION or code == Q_HEADING or code == Q_SLIDING_HEADING
        or code == Q_TURNING or code == Q_RIM_TURN or code == Q_STRUCK_RIM or code == Q_SLIDING_FROM_BLOW
        or code == Q_RIM_ANGLE or code == Q_LAST_AZIMUTH or code == Q_NORMAL
    )  # fmt: skip
