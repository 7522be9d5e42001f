"""The legend beside the arena: what is drawn how, so that the plane explains itself."""

from typing import Any

import rerun as rr

from base_station.belief.hypotheses import NONE
from base_station.recording.palette import LIGHT_GREY, TRUTH, WHITE, hypothesis_color, vehicle_color
from base_station.recording.scene import DISC_M, GROUND_Z_M, at, circle, usual
from hil.scenario import StationView

ROWS = 8  # more do not fit beside the arena
MARGIN = 0.17  # of the arena's width, between it and the middle of an entry
SIZE = 0.13  # radius of a sign, of the distance between two
WELL = "if all is well"
OTHERS = "others: paler"


def log_legend(stream: Any, view: StationView) -> None:
    """Vehicles and set-points to the west of the arena, truth and twins to the east."""
    arena = view.arena
    margin_m = MARGIN * (arena.east_max_m - arena.east_min_m)
    west_m, east_m = arena.east_min_m - margin_m, arena.east_max_m + margin_m
    pitch_m = (arena.north_max_m - arena.north_min_m) / ROWS
    norths_m = [arena.north_max_m - pitch_m * (row + 0.3) for row in range(ROWS)]
    size_m = SIZE * pitch_m

    fleet = view.fleet[: ROWS - 1]
    discs = rr.Cylinders3D(
        centers=[at(north_m, west_m, GROUND_Z_M) for north_m in norths_m[: len(fleet)]],
        radii=size_m,
        lengths=DISC_M,
        colors=[vehicle_color(k) for k in range(len(fleet))],
        fill_mode="solid",
    )
    stream.log("/plane/legend/reported", discs, static=True)

    arrow = rr.Arrows3D(
        origins=[at(norths_m[len(fleet)], west_m - size_m, GROUND_Z_M)],
        vectors=[at(0.0, 2.0 * size_m)],
        colors=WHITE,
        radii=0.04,
    )
    stream.log("/plane/legend/setpoint", arrow, static=True)

    twins = usual(view)[: ROWS - 2]
    rings = rr.LineStrips3D(
        [circle(n, east_m, size_m, GROUND_Z_M) for n in norths_m[: len(twins) + 1]],
        colors=[TRUTH, *map(hypothesis_color, twins)],
        radii=0.025,
    )
    stream.log("/plane/legend/rings", rings, static=True)

    texts_west = [*((m.name, vehicle_color(k)) for k, m in enumerate(fleet)), ("ordered", WHITE)]
    texts_east = [("truth", TRUTH), *((_if(name), hypothesis_color(name)) for name in twins)]
    texts_east.append((OTHERS, LIGHT_GREY))
    rows = [(west_m, k, *text) for k, text in enumerate(texts_west)]
    rows += [(east_m, k, *text) for k, text in enumerate(texts_east)]
    below_m = 1.2 * size_m  # the viewer writes a label just below its point
    texts = rr.Points3D(
        [at(norths_m[k] - below_m, place_m, GROUND_Z_M) for place_m, k, _, _ in rows],
        colors=[color for *_, color in rows],
        labels=[text for _, _, text, _ in rows],
        radii=0.001,
    )
    stream.log("/plane/legend/texts", texts, static=True)


def _if(hypothesis: str) -> str:
    return WELL if hypothesis == NONE else f"if {hypothesis}"
