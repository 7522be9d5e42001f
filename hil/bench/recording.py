"""The recording of a run: the truth beside what the station recorded, in one file.

Rerun itself is used in `base_station.recording` only, and imported when it is needed.
"""

from pathlib import Path
from typing import Protocol

from hil.bench.folders import Folders
from hil.scenario import Scenario
from hil.world.truth import ContactEpisode, TruthRecord

STATION_RECORDING, TRUTH_RECORDING, RECORDING = "station.rrd", "truth.rrd", "mission.rrd"


class TruthObserver(Protocol):
    """Who shows the truth."""

    def truth(self, record: TruthRecord) -> None: ...

    def contact(self, episode: ContactEpisode) -> None: ...

    def fault(self, time_s: float, text: str) -> None: ...

    def close(self) -> None: ...


class RecordedTruth:
    """Hands the truth to the recorder, in the recording that the station writes, too."""

    def __init__(self, folders: Folders, scenario: Scenario, viewer: str | None) -> None:
        from base_station.recording.truth import TruthRecorder

        path = folders.run / TRUTH_RECORDING
        self._recorder = TruthRecorder(path, folders.run_id, scenario, viewer)

    def truth(self, record: TruthRecord) -> None:
        poses = {s: (v.north_m, v.east_m, v.yaw_rad) for s, v in record.vehicles.items()}
        self._recorder.truth(record.time_s, poses)

    def contact(self, episode: ContactEpisode) -> None:
        peak_ns = episode.peak_impulse_ns
        self._recorder.contact(episode.start_s, episode.bodies, episode.point_m, peak_ns)

    def fault(self, time_s: float, text: str) -> None:
        self._recorder.fault(time_s, text)

    def close(self) -> None:
        self._recorder.close()


def merge_recordings(folder: Path) -> Path | None:
    """One mission.rrd out of the parts there are, which go; None when nothing was recorded."""
    from base_station.recording.merge import merge

    stations = [folder / STATION_RECORDING, *sorted(folder.glob("station-[0-9]*.rrd"))]
    parts, target = [*stations, folder / TRUTH_RECORDING], folder / RECORDING
    try:
        merge(parts, target)
    except FileNotFoundError:
        return target if target.exists() else None
    for part in parts:
        part.unlink(missing_ok=True)
    return target
