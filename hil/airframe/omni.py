"""Omnidirectional rovers: four omni wheels, in two layouts."""

import math
from collections.abc import Sequence

from hil.airframe.model import Airframe, Motor

Pair = tuple[float, float]


def _omni(
    name: str, frame_type: int, places: Sequence[Pair], directions: Sequence[Pair]
) -> Airframe:
    """Four omni wheels at 0.2 m. An 8 kg research rover; its figures are chosen, not a product's.

    16 N of stall force a wheel and 1.6 m/s free speed give a time constant of 0.4 s and 3 m/s2
    at standstill. c_rr = 0.1 is between medium hard soil (0.08) and sand (0.1-0.2; Carvill,
    Mechanical Engineer's Data Handbook). A blocked wheel skids at 0.7 of its quarter of the weight
    (rubber slides on dry concrete at 0.6-0.85; engineeringtoolbox.com, friction).
    """
    motors = tuple(
        Motor(p, d, 16.0, 1.6, grip_n=13.7) for p, d in zip(places, directions, strict=True)
    )
    return Airframe(
        name, 0.3, 8.0, 0.36, 0.10, 0.6, 1.0, motors, drag_area_m2=0.15, frame_type=frame_type
    )


# left, right, front, rear: one pair drives x, the other y
OMNI_PLUS = _omni(
    "omni_plus",
    3,
    ((0.0, -0.2), (0.0, 0.2), (0.2, 0.0), (-0.2, 0.0)),
    ((1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, 1.0)),
)

# front left, front right, rear left, rear right: every wheel drives x and y
_H = math.sqrt(0.5)
OMNI_X = _omni(
    "omni_x",
    2,
    ((0.2 * _H, -0.2 * _H), (0.2 * _H, 0.2 * _H), (-0.2 * _H, -0.2 * _H), (-0.2 * _H, 0.2 * _H)),
    ((_H, _H), (_H, -_H), (_H, -_H), (_H, _H)),
)
