"""Scripted driving round others: straight on, or along the tangent of who is in the way (pure)."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

GAIN = 1.5  # m/s per m
LOOK_M = 2.0  # others further away than this are not in the way yet
LEAN = 1.1  # how far round the tangent leads, more than just touching


def steer(
    position_m: Array, target_m: Array, others_m: Array, clear_m: Array, low: Array, high: Array
) -> Array:
    """Velocities [N, 2] (m/s) of vehicles at `position_m` [N, 2] towards `target_m` [N, 2].

    `others_m` [N, O, 2] are kept at `clear_m` [O] between centres (the nearest one that is in the
    way counts); `low` and `high` [2] are the corners that centres can reach.
    """
    way = target_m - position_m
    length = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    heading = way / length
    right = np.stack([-heading[:, 1], heading[:, 0]], axis=1)
    offset = others_m - position_m[:, None]
    along = (offset * heading[:, None]).sum(axis=-1)
    across = (offset * right[:, None]).sum(axis=-1)
    distance = np.maximum(np.linalg.norm(offset, axis=-1), 1e-9)
    nearest = np.linalg.norm(
        offset - np.clip(along, 0.0, length)[..., None] * heading[:, None], axis=-1
    )
    blocks = (nearest < clear_m) & (along > 0.0) & (distance < LOOK_M)
    which = np.where(blocks, distance, np.inf).argmin(axis=1)
    rows = np.arange(len(position_m))
    blocked = blocks[rows, which]
    other, gap = others_m[rows, which], clear_m[which]
    side = np.where(across[rows, which] > 0.0, -1.0, 1.0)  # it is to the right: pass it on the left
    corner = other + side[:, None] * gap[:, None] * right
    outside = ((corner < low) | (corner > high)).any(axis=1)
    side = np.where(outside, -side, side)
    bearing = offset[rows, which] / distance[rows, which, None]
    turn = side * np.arcsin(np.minimum(1.0, LEAN * gap / distance[rows, which]))
    cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
    tangent = cos * bearing + sin * np.stack([-bearing[:, 1], bearing[:, 0]], axis=1)
    speed = np.minimum(1.0, GAIN * length)
    velocity = speed * np.where(blocked[:, None], tangent, heading)
    inside = np.maximum(0.0, clear_m - distance) / clear_m  # too close: away from it
    velocity -= (inside[..., None] * offset / distance[..., None]).sum(axis=1) * 2.0
    faster = np.maximum(1.0, np.linalg.norm(velocity, axis=1, keepdims=True))
    return np.asarray(velocity / faster)


def away_from_segment(position_m: Array, start_m: Array, end_m: Array) -> tuple[Array, Array]:
    """Unit vectors [N, 2] from the nearest point of segments to `position_m` [N, 2], and how far
    [N]."""
    way = end_m - start_m
    square = np.maximum((way**2).sum(axis=1, keepdims=True), 1e-12)
    share = np.clip(((position_m - start_m) * way).sum(axis=1, keepdims=True) / square, 0.0, 1.0)
    offset = position_m - (start_m + share * way)
    distance = np.linalg.norm(offset, axis=1)
    return offset / np.maximum(distance, 1e-9)[:, None], distance
