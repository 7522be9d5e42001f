"""Signed links: whoever has another key, or none, is refused, and that is said."""

import pytest

from base_station.node import StationNode
from hil.bench.folders import blind_view
from hil.mavlink import Encoder, Signing, key_of, ticks
from hil.scenario import Scenario
from tests.scenarios.bench import scripted, start

KEY, OTHER = key_of("a pass phrase"), key_of("another")


def connected(rescue: Scenario, ours: bytes | None, theirs: bytes | None) -> tuple[str, list[str]]:
    """The station's phase after five seconds, and what it has said of links and by vehicles."""
    rig, heard, times = start(rescue, scripted(0.8), key=theirs)
    links, planner = rig.station_links, rig.planner
    rig.node = StationNode(blind_view(rescue), links, planner, [heard], key=ours)
    for time_s in times:
        if time_s > 5.0:
            break
    said = heard.texts("link") + heard.texts("text")
    return rig.node.station.desk.phase.name, [text for text in said if "refused" in text]


def test_with_the_same_key_nothing_is_refused(rescue: Scenario) -> None:
    assert connected(rescue, KEY, KEY) == ("probe", [])


@pytest.mark.parametrize(
    ("theirs", "why"),
    [(OTHER, "signature does not match the key"), (None, "not signed; start the vehicle with")],
)
def test_telemetry_without_our_key_is_refused_aloud(
    rescue: Scenario, theirs: bytes | None, why: str
) -> None:
    phase, said = connected(rescue, KEY, theirs)
    assert phase == "connect"
    for name in ("rover_1", "rover_2", "rover_3"):
        assert any(text.startswith(name) and f"frames refused: {why}" in text for text in said)


def test_a_station_without_a_key_is_told_by_the_vehicles(rescue: Scenario) -> None:
    phase, said = connected(rescue, None, KEY)
    assert phase == "connect"  # nobody tells it the time
    assert any(text.startswith("rover_2") and "refused: not signed" in text for text in said)


def test_a_second_station_with_our_system_id_is_named_once(rescue: Scenario) -> None:
    rig, heard, times = start(rescue, scripted(0.8))
    for time_s in times:
        if time_s > 1.0:
            rig.node.hear_of(1, 245)
            rig.node.hear_of(1, 250)
        if time_s > 2.0:
            break
    told = [text for text in heard.texts("link") if "another station" in text]
    assert told == ["another station with system id 250 speaks on the link of rover_2"]


def test_who_is_welcome_where_a_vehicle_is_expected(rescue: Scenario) -> None:
    rig, heard, _ = start(rescue, scripted(0.8))
    links, planner = rig.station_links, rig.planner
    node = StationNode(blind_view(rescue), links, planner, [heard], key=KEY)
    node.step(0.0, 1_700_000_000_000_000)
    now = ticks(1_700_000_000.0)

    def beat(sysid: int, key: bytes | None, late: int = 0) -> bytes:
        signing = key and Signing(key, 0, lambda: now - late)
        return Encoder(sysid, 1, signing or None).gcs_heartbeat()

    genuine = beat(2, KEY)
    assert node.is_welcome(1, genuine)
    assert node.is_welcome(1, genuine)  # asking does not use it up
    assert not node.is_welcome(0, genuine)
    assert not node.is_welcome(1, beat(2, OTHER))
    assert not node.is_welcome(1, beat(2, None))
    assert not node.is_welcome(1, beat(2, KEY, late=61 * 100_000))


def test_without_a_key_only_a_heartbeat_of_the_vehicle_makes_its_sender_the_vehicle(
    rescue: Scenario,
) -> None:
    rig, _, _ = start(rescue, scripted(0.8))
    assert rig.node.is_welcome(1, Encoder(2, 1).gcs_heartbeat())
    assert not rig.node.is_welcome(1, Encoder(3, 1).gcs_heartbeat())
    assert not rig.node.is_welcome(1, Encoder(2, 190).gcs_heartbeat())
    assert not rig.node.is_welcome(1, Encoder(2, 1).timesync(1, 2))
