"""Colours and names that mean the same in every view.

The hues are Okabe and Ito's, which people with any kind of colour blindness can tell apart.
Vehicles and hypotheses share none. Broken motors are warm, broken GPS is cool, nothing is grey.
Explanations that are likely beforehand have a hue to themselves, others a paler one, the rarest a
darker one.
"""

from collections.abc import Sequence

Rgb = tuple[int, int, int]


def mix(a: Rgb, b: Rgb, share_of_b: float) -> Rgb:
    """A colour between two."""
    r, g, b_ = (round(x + (y - x) * share_of_b) for x, y in zip(a, b, strict=True))
    return r, g, b_


SKY_BLUE: Rgb = (86, 180, 233)
YELLOW: Rgb = (240, 228, 66)
GREEN: Rgb = (0, 158, 115)
VERMILION: Rgb = (213, 94, 0)
ORANGE: Rgb = (230, 159, 0)
PURPLE: Rgb = (204, 121, 167)
BLUE: Rgb = (0, 114, 178)
WHITE: Rgb = (255, 255, 255)
BLACK: Rgb = (0, 0, 0)
LAVENDER: Rgb = (206, 196, 255)
DIM: Rgb = (110, 116, 126)
LIGHT_GREY: Rgb = (200, 200, 200)
GREY: Rgb = (122, 122, 122)
DARK_GREY: Rgb = (84, 84, 84)

TRUTH = WHITE
THRESHOLD = WHITE
ACCEPTED = GREEN
REJECTED = GREY
RUNNING = YELLOW

_VEHICLES = (SKY_BLUE, YELLOW, GREEN)
_HYPOTHESES: dict[str, Rgb] = {
    "motor_y_off": VERMILION,
    "motor_x_off": ORANGE,
    "motor_y_partial": mix(VERMILION, WHITE, 0.5),
    "motor_x_partial": mix(ORANGE, WHITE, 0.6),
    "motor_y_reversed": mix(VERMILION, BLACK, 0.4),
    "motor_x_reversed": mix(ORANGE, BLACK, 0.45),
    "gps_east_stuck": PURPLE,
    "gps_north_stuck": BLUE,
    "gps_stuck": LAVENDER,
    "gps_offset": mix(BLUE, WHITE, 0.45),
    "gps_drift": mix(PURPLE, WHITE, 0.5),
    "gps_noise": mix(PURPLE, BLACK, 0.25),
    "gps_delay": mix(BLUE, BLACK, 0.35),
    "none": GREY,
    "unknown": DARK_GREY,
}
_FAMILIES = {"motor": (VERMILION, ORANGE), "esc": (VERMILION, ORANGE), "gps": (PURPLE, BLUE)}

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
    """Colour of a hypothesis, by its name alone, so that it is the same in every run.

    Those without a colour of their own get a pale one of their family.
    """
    if name in _HYPOTHESES:
        return _HYPOTHESES[name]
    hues = _FAMILIES.get(name.split("_")[0], (PURPLE, ORANGE))
    shade, hue = divmod(sum(name.encode()), len(hues))
    return mix(hues[hue], WHITE, 0.3 + 0.1 * (shade % 5))
