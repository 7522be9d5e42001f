"""The truth as the world tells it: where every body is, and which bodies touched (pure).

Both go out as lines of JSON; times are world time (s), positions NED (m), impulses N s.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Self

EPISODE_GAP_S = 0.25  # contacts of one pair closer in time than this are one episode


@dataclass(frozen=True)
class VehicleTruth:
    """One body: position (m) and velocity (m/s) in NED, yaw in rad. Down is 0 on the ground."""

    north_m: float
    east_m: float
    yaw_rad: float
    north_mps: float
    east_mps: float
    down_m: float = 0.0
    down_mps: float = 0.0


@dataclass(frozen=True)
class TruthRecord:
    """All bodies at one instant, by system id."""

    time_s: float
    vehicles: dict[int, VehicleTruth]


@dataclass(frozen=True)
class Contact:
    """Two bodies that pressed on each other during one step: where (NED), and how hard."""

    time_s: float
    bodies: tuple[str, str]
    impulse_ns: float
    point_m: tuple[float, float]


@dataclass(frozen=True)
class ContactEpisode:
    """Contacts of one pair without a gap.

    `peak_impulse_ns` is the largest of any one step, `point_m` is where it pressed.
    """

    start_s: float
    end_s: float
    bodies: tuple[str, str]
    peak_impulse_ns: float
    point_m: tuple[float, float]

    @classmethod
    def of(cls, c: Contact) -> Self:
        return cls(c.time_s, c.time_s, c.bodies, c.impulse_ns, c.point_m)

    def extended(self, c: Contact) -> "ContactEpisode":
        if c.impulse_ns <= self.peak_impulse_ns:
            return replace(self, end_s=c.time_s)
        return replace(self, end_s=c.time_s, peak_impulse_ns=c.impulse_ns, point_m=c.point_m)


class ContactLog:
    """Merges contacts into episodes."""

    def __init__(self) -> None:
        self._open: dict[tuple[str, str], ContactEpisode] = {}

    def add(self, time_s: float, contacts: Iterable[Contact]) -> tuple[ContactEpisode, ...]:
        """Take the contacts of a step that ends at `time_s`; returns the episodes now over."""
        for c in contacts:
            begun = self._open.get(c.bodies)
            self._open[c.bodies] = begun.extended(c) if begun else ContactEpisode.of(c)
        over = [e for e in self._open.values() if time_s - e.end_s > EPISODE_GAP_S]
        for episode in over:
            del self._open[episode.bodies]
        return tuple(over)

    def close(self) -> tuple[ContactEpisode, ...]:
        """End all episodes, at the end of the world."""
        episodes = tuple(self._open.values())
        self._open.clear()
        return episodes


def truth_line(record: TruthRecord) -> str:
    """A record as JSON; per vehicle north, east, yaw, north speed, east speed.

    Off the ground, down and down speed follow.
    """
    vehicles = {str(s): [round(x, 6) for x in _numbers(v)] for s, v in record.vehicles.items()}
    return _line({"type": "truth", "time_s": round(record.time_s, 6), "vehicles": vehicles})


def _numbers(v: VehicleTruth) -> tuple[float, ...]:
    plane = (v.north_m, v.east_m, v.yaw_rad, v.north_mps, v.east_mps)
    flies = v.down_m != 0.0 or v.down_mps != 0.0
    return (*plane, v.down_m, v.down_mps) if flies else plane


def contact_line(episode: ContactEpisode) -> str:
    """An episode as JSON."""
    return _line(
        {
            "type": "contact",
            "time_s": round(episode.start_s, 6),
            "end_s": round(episode.end_s, 6),
            "bodies": list(episode.bodies),
            "peak_impulse_ns": round(episode.peak_impulse_ns, 6),
            "point_m": [round(x, 6) for x in episode.point_m],
        }
    )


def parse_line(line: str) -> TruthRecord | ContactEpisode | None:
    """The inverse of both; None for any other line."""
    try:
        tree = json.loads(line)
        if tree["type"] == "truth":
            vehicles = {int(s): VehicleTruth(*map(float, v)) for s, v in tree["vehicles"].items()}
            return TruthRecord(float(tree["time_s"]), vehicles)
        if tree["type"] == "contact":
            first, second = tree["bodies"]
            north_m, east_m = tree["point_m"]
            return ContactEpisode(
                float(tree["time_s"]),
                float(tree["end_s"]),
                (str(first), str(second)),
                float(tree["peak_impulse_ns"]),
                (float(north_m), float(east_m)),
            )
    except (ValueError, KeyError, TypeError, AttributeError):
        pass
    return None


def _line(tree: dict[str, Any]) -> str:
    return json.dumps(tree, separators=(",", ":"))
