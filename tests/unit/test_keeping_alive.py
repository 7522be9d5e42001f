"""Heartbeats: once a second, and the more often the more of them get lost."""

import pytest

from base_station.commands import AskTime, Heartbeat
from base_station.keeping_alive import KeepAlive
from hil.scenario import StationView


@pytest.mark.parametrize(
    ("loss", "beats"),
    [
        (0.0, 10),  # one a second
        (0.1, 30),  # all three of a second lost: 0.1 %
        (0.3, 50),
    ],
)
def test_heartbeats_are_as_frequent_as_the_link_is_bad(
    rescue_view: StationView, loss: float, beats: int
) -> None:
    keep = KeepAlive(rescue_view.fleet[:1])
    sent = [c for k in range(1000) for c in keep.due(0.01 * k, 0.0, loss)]
    assert sum(isinstance(c, Heartbeat) for c in sent) == pytest.approx(beats, rel=0.05)
    assert sum(isinstance(c, AskTime) for c in sent) == 10


def test_the_faster_of_both_clocks_counts(rescue_view: StationView) -> None:
    """A simulation that is ten times as fast has failsafes that are."""
    keep = KeepAlive(rescue_view.fleet[:1])
    sent = [c for k in range(100) for c in keep.due(0.01 * k, 0.1 * k, 0.0)]
    assert sum(isinstance(c, Heartbeat) for c in sent) == pytest.approx(10, abs=1)
