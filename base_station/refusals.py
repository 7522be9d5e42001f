"""Frames that a station does not listen to, told to people: a wrong key must not look like silence.

Nothing here has an effect on what the station believes or does.
"""

from collections.abc import Sequence

from base_station.records import Event
from hil.mavlink import Decoder, Refusal
from hil.scenario import StationView

TOLD_EVERY_US = 5_000_000
REMEDY: dict[Refusal, str] = {
    "unsigned": "not signed; start the vehicle with the same --signing-key",
    "forged": "signature does not match the key",
    "replayed": "signed before: replayed, or its clock is a minute behind",
}


class Refusals:
    """Counts per link, told at once and then at most every 5 s while they grow."""

    def __init__(self, view: StationView) -> None:
        self._view = view
        self._told: list[dict[Refusal, int]] = [{} for _ in view.fleet]
        self._told_us = [-TOLD_EVERY_US] * len(view.fleet)
        self._namesakes: dict[int, bool] = {}  # vehicle index: has it been told?

    def namesake(self, index: int) -> None:
        """Somebody else speaks with this station's system id on a vehicle's link."""
        self._namesakes.setdefault(index, False)

    def told(self, decoders: Sequence[Decoder], time_s: float, epoch_us: int) -> list[Event]:
        """What is new, as events."""
        events = []
        for index, decoder in enumerate(decoders):
            counts = decoder.refused
            if counts == self._told[index] or epoch_us - self._told_us[index] < TOLD_EVERY_US:
                continue
            name = self._view.fleet[index].name
            events += [
                Event(round(time_s, 3), "link", f"{name}: {n} frames refused: {REMEDY[why]}")
                for why, n in counts.items()
                if n != self._told[index].get(why)
            ]
            self._told[index], self._told_us[index] = dict(counts), epoch_us
        for index in [i for i, told in self._namesakes.items() if not told]:
            self._namesakes[index] = True
            name, own = self._view.fleet[index].name, self._view.station_sysid
            text = f"another station with system id {own} speaks on the link of {name}"
            events.append(Event(round(time_s, 3), "link", text))
        return events
