"""Colours and names that mean the same in every view.

The hues are Okabe and Ito's, which people with any kind of colour blindness can tell apart.
Vehicles and hypotheses share none. Broken motors are warm, broken GPS is cool, nothing is grey.
"""

from collections.abc import Sequence

Rgb = tuple[int, int, int]

SKY_BLUE: Rgb = (86, 180, 233)
YELLOW: Rgb = (240, 228, 66)
GREEN: Rgb = (0, 158, 115)
VERMILION: Rgb = (213, 94, 0)
ORANGE: Rgb = (230, 159, 0)
PURPLE: Rgb = (204, 121, 167)
BLUE: Rgb = (0, 114, 178)
WHITE: Rgb = (255, 255, 255)
BLACK: Rgb = (0, 0, 0)
DIM: Rgb = (110, 116, 126)
LIGHT_GREY: Rgb = (200, 200, 200)
GREY: Rgb = (150, 150, 150)
DARK_GREY: Rgb = (100, 100, 100)

TRUTH = WHITE
THRESHOLD = WHITE
ACCEPTED = GREEN
REJECTED = GREY
RUNNING = YELLOW

_VEHICLES = (SKY_BLUE, YELLOW, GREEN)
_HYPOTHESES: dict[str, Rgb] = {
    "motor_y_off": VERMILION,
    "motor_x_off": ORANGE,
    "gps_east_stuck": PURPLE,
    "gps_north_stuck": BLUE,
    "none": GREY,
    "unknown": DARK_GREY,
}
_OTHERS = (VERMILION, PURPLE, ORANGE, BLUE)

_PHASES: dict[str, Rgb] = {  # muted, so that nobody takes a phase for a vehicle or a hypothesis
    "connect": (70, 74, 82),
    "arm": (70, 74, 82),
    "probe": (62, 104, 138),
    "plan_alpha": (98, 84, 140),
    "experiment": (150, 88, 58),
    "plan_beta": (98, 84, 140),
    "mission": (50, 112, 92),
    "return": (50, 112, 92),
    "hold": (140, 124, 50),
    "done": (105, 110, 118),
    "idle": (46, 50, 56),
    "probing": (62, 104, 138),
    "suspect": (140, 124, 50),
    "helping": (98, 122, 60),
    "home": (105, 110, 118),
    "held": (46, 50, 56),
}
PHASES: Sequence[tuple[str, Rgb]] = tuple(_PHASES.items())


def vehicle_color(index: int) -> Rgb:
    """Colour of the vehicle at `index` in the fleet; beyond the hues, each round is paler."""
    rounds, hue = divmod(index, len(_VEHICLES))
    return mix(_VEHICLES[hue], WHITE, min(0.75, 0.35 * rounds))


def hypothesis_color(name: str) -> Rgb:
    """Colour of a hypothesis, by its name, so that it needs no order."""
    return _HYPOTHESES.get(name) or _OTHERS[sum(name.encode()) % len(_OTHERS)]


def mix(a: Rgb, b: Rgb, share_of_b: float) -> Rgb:
    """A colour between two."""
    r, g, b_ = (round(x + (y - x) * share_of_b) for x, y in zip(a, b, strict=True))
    return r, g, b_
