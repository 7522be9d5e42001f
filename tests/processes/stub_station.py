"""A stand-in for the base station: speaks its line contract, concludes after some fleet time.

    python stub_station.py WAY VIEW --out DIR --machine ...

WAY is what it does after two seconds: conclude, garbage (break the contract), leave (end without a
result), hang, or wait (go on for ever).
"""

import json
import select
import signal
import sys
import time
from pathlib import Path
from typing import Any

from hil.link import UdpLink
from hil.mavlink import Decoder, LocalPosition
from hil.scenario import StationView, load_station_view

CONCLUDE_AFTER_S = 2.0


def say(line: dict[str, Any]) -> None:
    print(json.dumps(line), flush=True)


def event(time_s: float, kind: str, text: str) -> None:
    say({"type": "event", "time_s": time_s, "kind": kind, "text": text, "data": {}})


def outcome(view: StationView, time_s: float) -> dict[str, Any]:
    """Claims that rover 2 has no y motors and that nobody got anywhere."""
    posterior = {"motor_y_off": 0.995, "gps_east_stuck": 0.005}
    verdict = {"sysid": 2, "hypothesis": "motor_y_off", "posterior": posterior, "decided": True}
    training = {"kind": "alpha", "planner": "ppo", "preset": "tuned", "timesteps": 4000}
    return {
        "verdict": verdict,
        "alarm": True,
        "goals": {str(m.sysid): {"declared": "unreached", "time_s": None} for m in view.fleet},
        "phases": [{"phase": "probe", "wall_s": time_s, "sim_s": time_s}],
        "trainings": [{**training, "restarts": 0, "wall_s": 1.5}],
    }


def main(way: str, view: StationView) -> None:
    links = [UdpLink.bind(view.host, m.mavlink_port) for m in view.fleet]
    decoder = Decoder()
    say({"type": "ready"})
    told_s = -1.0
    while True:
        select.select(links, [], [], 1.0)
        received = [r for link in links for d in link.receive() for r in decoder.decode(d)]
        times_s = [r.value.time_s for r in received if isinstance(r.value, LocalPosition)]
        if not times_s or max(times_s) < told_s + 0.1:
            continue
        if told_s < 0.0:
            event(0.0, "phase", "probe")
        told_s = max(times_s)
        say({"type": "tick", "time_s": told_s, "phase": "probe"})
        if told_s < CONCLUDE_AFTER_S:
            continue
        if way == "hang":
            time.sleep(3600)
        if way == "garbage":
            say({"type": "tick", "time_s": "soon"})
        if way == "leave":
            sys.exit("the stub has had enough")
        if way == "conclude":
            event(told_s, "verdict", "rover_2: motor_y_off")
            say({"type": "result", "outcome": outcome(view, told_s)})
            return


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    Path("station_was_here.txt").write_text(" ".join(sys.argv))
    main(sys.argv[1], load_station_view(Path(sys.argv[2])))
