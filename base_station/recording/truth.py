"""The truth, written by the bench into the same recording, under a root of its own.

A viewer can switch `/truth` off and sees only what the station saw.
"""

import math
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import rerun as rr

from base_station.recording import columns as col
from base_station.recording import palette, scene, streams
from base_station.recording.fleet_rows import body
from base_station.recording.outlets import Channel, Inline, Queued
from base_station.recording.trails import Trails
from hil.scenario import Scenario

CONTACT_M_PER_SQRT_NS = 0.06  # the area of a contact's spot goes with its impulse
CONTACT_M = (0.03, 0.3)  # smallest and largest spot


class TruthRecorder:
    """Never raises and never waits for a viewer. NED in m and rad, N s, world time in s."""

    def __init__(
        self, path: Path, run_id: str, scenario: Scenario, viewer: str | None = None
    ) -> None:
        self._channels = [Channel(Inline(), partial(_file_writer, path, run_id, scenario))]
        if viewer:
            self._channels.append(
                Channel(Queued(), partial(_viewer_writer, viewer, run_id, scenario))
            )

    @property
    def failures(self) -> int:
        """Calls that went wrong so far; each was swallowed."""
        return sum(c.outlet.failures for c in self._channels)

    def truth(self, time_s: float, vehicles: Mapping[int, tuple[float, float, float]]) -> None:
        """Where each vehicle is: (north_m, east_m, yaw_rad) by system id."""
        self._tell(lambda writer: writer.truth(time_s, vehicles))

    def contact(
        self,
        time_s: float,
        bodies: tuple[str, str],
        point_m: tuple[float, float],
        impulse_ns: float,
    ) -> None:
        """Two bodies pressed on each other at `point_m` (north, east)."""
        self._tell(lambda writer: writer.contact(time_s, bodies, point_m, impulse_ns))

    def fault(self, time_s: float, text: str) -> None:
        """A fault struck or was cleared."""
        self._tell(lambda writer: writer.fault(time_s, text))

    def close(self) -> None:
        """Everything is in the file afterwards. May be called twice."""
        for channel in self._channels:
            channel.close()

    def _tell(self, call: Callable[["TruthWriter"], None]) -> None:
        for channel in self._channels:
            channel.tell(call)


class TruthWriter:
    """Writes one stream, from one thread. Errors of the recording library come through."""

    def __init__(self, stream: Any, scenario: Scenario, period_s: float) -> None:
        self._stream = stream
        self._batch = col.Batch(stream, period_s)
        self._radii_m = {v.sysid: v.frame.radius_m for v in scenario.fleet}
        self._trails = Trails()
        radii_m = list(self._radii_m.values())
        scene.style_bodies(stream, "/truth/fleet", radii_m, palette.TRUTH, solid=False)
        stream.log("/truth/trail", rr.LineStrips3D.from_fields(radii=0.01), static=True)

    def truth(self, time_s: float, vehicles: Mapping[int, tuple[float, float, float]]) -> None:
        self._batch.tick(time_s)
        bodies, steps = [], []
        for sysid, radius_m in self._radii_m.items():
            north_m, east_m, yaw_rad = vehicles[sysid]
            bodies.append(body((north_m, east_m), yaw_rad, radius_m, scene.TRUTH_Z_M))
            place = scene.at(north_m, east_m, scene.TRUTH_Z_M)
            if step := self._trails.step(sysid, place, palette.TRUTH):
                steps.append(step)
        self._batch.add("/truth/fleet", col.BODIES, bodies)
        if steps:
            self._batch.add("/truth/trail", col.SEGMENTS, steps)

    def contact(
        self,
        time_s: float,
        bodies: tuple[str, str],
        point_m: tuple[float, float],
        impulse_ns: float,
    ) -> None:
        smallest, largest = CONTACT_M
        radius_m = CONTACT_M_PER_SQRT_NS * math.sqrt(max(0.0, impulse_ns))
        spot = rr.Points3D(
            [scene.at(*point_m, scene.ARROW_Z_M)],
            radii=min(largest, max(smallest, radius_m)),
            colors=palette.TRUTH,
            labels=f"{impulse_ns:.1f} N s",
            show_labels=False,  # on hovering; else they cover the bodies
        )
        col.set_time(self._stream, time_s)
        self._stream.log("/truth/contacts", spot)
        text = f"contact of {bodies[0]} and {bodies[1]}: {impulse_ns:.2f} N s"
        self._stream.log("/truth/contact_log", rr.TextLog(text, level="DEBUG"))

    def fault(self, time_s: float, text: str) -> None:
        col.set_time(self._stream, time_s)
        self._stream.log("/truth/faults", rr.TextLog(f"fault (truth): {text}", level="ERROR"))

    def close(self) -> None:
        self._batch.send()
        self._stream.disconnect()


def _file_writer(path: Path, run_id: str, scenario: Scenario) -> TruthWriter:
    return TruthWriter(streams.to_file(path, run_id), scenario, streams.FILE_PERIOD_S)


def _viewer_writer(address: str, run_id: str, scenario: Scenario) -> TruthWriter | None:
    stream = streams.to_viewer(address, run_id)
    return stream and TruthWriter(stream, scenario, streams.VIEWER_PERIOD_S)
