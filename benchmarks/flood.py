"""Strangers at every port: does a run go on as if nobody were there?

    python benchmarks/flood.py [--seconds 60] [--rate 1000] [--scenario rescue] [--speed 1]
                               [--until PHASE] [--seed 1]

`hil run` over UDP with a signing key, the experiment found by `cem`. From world time 3 s on, three
strangers send to every UDP port that world, vehicles, station and bench have open, `--rate`
datagrams a second to each: noise; frames cut, with a bit flipped, unsigned, signed with another key
(orders to vehicles, heartbeats and positions in their names), and what was said before, as the
station's own logs have it; at the physics ports motor outputs and states in ArduPilot's format.

The run has to end as its scenario expects (with `--until`, to reach that phase; it is interrupted
then), without a take-over, an alarm about a sound vehicle, or a process that has died. A table says
what each port was sent, and what its process took of a core before, in and after the flood. Exit
code 1 for anything else.
"""

import argparse
import itertools
import json
import os
import random
import secrets
import select
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path

from kills import descendants, orphans, phases, text, world_s

from base_station.tlog import read_tlog
from hil.mavlink import (
    AUTOPILOT_ARDUPILOT,
    COMPONENT_AUTOPILOT,
    COMPONENT_GCS,
    TYPE_ROVER,
    Encoder,
    Heartbeat,
    LocalPosition,
    RoverMode,
    Signing,
    key_of,
    ticks,
)
from hil.physics_link import PhysicsState, ServoFrame, encode_frame, encode_state

ROOT = Path(__file__).parents[1]
HOST = "127.0.0.1"
STATION_SYSID, INJECTOR_SYSID = 250, 251
ROLES = {
    "base_station.planning": "planner",
    "base_station.process": "station",
    "sim_vehicles.process": "vehicle",
    "hil.cli world": "world",
    "hil.cli run": "bench",
}
BEGIN_S = 3.0  # world time: everybody is there
CALM_S = 5.0  # wall time before the flood, in which CPU is measured
BURST_S, MAKE_UP_S = 0.02, 0.1  # a sender that was held up makes up for so much and no more
STRANGERS = 3
OWN_SUSPECT = "rover_2"  # who is broken in the scenarios


@dataclass
class Port:
    """A UDP port of a process of the run."""

    number: int
    pid: int
    role: str
    sent: int = 0


@dataclass
class Load:
    """CPU seconds of each process at instants (s)."""

    at: list[tuple[float, dict[int, float]]] = field(default_factory=list)

    def note(self, pids: dict[int, str]) -> None:
        self.at.append((time.monotonic(), {pid: cpu_s(pid) for pid in pids}))

    def share(self, pid: int, stretch: int) -> float:
        """Of a core, between instant `stretch` and the next; NaN where there is none."""
        if stretch + 1 >= len(self.at):
            return float("nan")
        (from_s, before), (to_s, after) = self.at[stretch], self.at[stretch + 1]
        if pid not in before or pid not in after:
            return float("nan")
        return (after[pid] - before[pid]) / max(1e-9, to_s - from_s)


def cpu_s(pid: int) -> float:
    fields = text(Path(f"/proc/{pid}/stat")).rpartition(")")[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK") if fields else float("nan")


def role_of(words: str) -> str:
    return next((role for part, role in ROLES.items() if part in words), "")


def ports_of(pids: dict[int, str]) -> list[Port]:
    """Every UDP socket that these processes have, from the kernel's tables."""
    inodes: dict[str, int] = {}
    for line in text(Path("/proc/net/udp")).splitlines()[1:]:
        columns = line.split()
        inodes[columns[9]] = int(columns[1].split(":")[1], 16)
    found = []
    for pid, words in pids.items():
        for handle in Path(f"/proc/{pid}/fd").glob("*"):
            with suppress(OSError):
                target = os.readlink(handle)
                number = inodes.get(target.removeprefix("socket:[").removesuffix("]"))
                if number and role_of(words):
                    found.append(Port(number, pid, role_of(words)))
    return found


def said_before(folder: Path, count: int) -> list[bytes]:
    """Genuine signed frames, of both directions, from the station's logs as they are now."""
    frames: list[bytes] = []
    for path in folder.glob(".station-*/*.tlog"):
        frames += [frame for _, frame in read_tlog(path)][-count:]
    return frames


def lies(key: bytes | None) -> list[bytes]:
    """What would do harm if somebody listened: orders, and telemetry of vehicles."""
    made: list[bytes] = []

    def encoder(sysid: int, component: int) -> Encoder:
        signing = key and Signing(key, 0, lambda: ticks(time.time()))
        return Encoder(sysid, component, signing or None)

    for sysid in (1, 2, 3):
        for orders in (encoder(STATION_SYSID, COMPONENT_GCS), encoder(77, COMPONENT_GCS)):
            made += [
                orders.set_mode(sysid, int(RoverMode.MANUAL)),
                orders.arm(sysid, False),
                orders.emergency_stop(sysid),
                orders.velocity_setpoint(sysid, 0, 1.0, 1.0, 0.0),
                orders.gcs_heartbeat(),
                orders.inject_failure(sysid, 101, 1, 0),
            ]
        vehicle = encoder(sysid, COMPONENT_AUTOPILOT)
        mode = int(RoverMode.MANUAL)
        made += [
            vehicle.encode(Heartbeat(TYPE_ROVER, AUTOPILOT_ARDUPILOT, False, mode, 3)),
            vehicle.encode(LocalPosition(1e4, (9.0, 9.0, 0.0), (0.0, 0.0, 0.0))),
            vehicle.timesync(1, 10**18),
        ]
    injector = encoder(INJECTOR_SYSID, COMPONENT_GCS)
    return [*made, *(injector.inject_failure(sysid, 101, 1, 0) for sysid in (1, 2, 3))]


def physics(rng: random.Random) -> list[bytes]:
    """Motor outputs and states in the format of the physics link, with counts and times to come."""
    three = (0.0, 0.0, 0.0)
    frames = [
        encode_frame(ServoFrame(50, rng.choice((0, 10**6)), (rng.randrange(1100, 1900),) * 16))
        for _ in range(20)
    ]
    states = [encode_state(PhysicsState(t, *(three,) * 5)) for t in (0.0, 1.0, 1e6)]
    return [*frames, *states]


def junk(rng: random.Random, folder: Path) -> list[bytes]:
    """A mixture, for every port: what does not belong there must do no harm either."""
    unsigned, forged, replayed = lies(None), lies(key_of("another")), said_before(folder, 200)
    whole = [*unsigned, *forged, *replayed]
    cut = [frame[: rng.randrange(len(frame))] for frame in rng.choices(whole, k=100)]
    flipped = [_flipped(rng, frame) for frame in rng.choices(whole, k=100)]
    noise = [rng.randbytes(rng.randrange(1, 300)) for _ in range(50)]
    made = [*unsigned, *forged, *replayed, *physics(rng), *cut, *flipped, *noise]
    rng.shuffle(made)
    return made


def _flipped(rng: random.Random, frame: bytes) -> bytes:
    at = rng.randrange(len(frame))
    return frame[:at] + bytes([frame[at] ^ 1 << rng.randrange(8)]) + frame[at + 1 :]


def flood(ports: list[Port], mixture: list[bytes], rate: float, seconds: float) -> Iterator[None]:
    """Sends for so long; yields after each burst."""
    with ExitStack() as stack:
        socks = [
            stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            for _ in range(STRANGERS)
        ]
        supply = itertools.cycle(mixture)
        began_s = time.monotonic()
        while (elapsed_s := time.monotonic() - began_s) < seconds:
            due = int(elapsed_s * rate)
            for k, port in enumerate(ports):
                for _ in range(min(due - port.sent, int(rate * MAKE_UP_S))):
                    with suppress(OSError):
                        socks[(k + port.sent) % STRANGERS].sendto(next(supply), (HOST, port.number))
                    port.sent += 1
            yield
            select.select([], [], [], BURST_S)


def faults_of(out: Path, run_code: int, until: str) -> list[str]:
    """What happened that must not."""
    wrong = []
    events = [json.loads(line) for line in text(out / "events.jsonl").splitlines()]
    wrong += [f"take-over: {e['text']}" for e in events if e["kind"] == "takeover"]
    alarms = [e["text"] for e in events if e["kind"] == "anomaly"]
    wrong += [f"false alarm: {a}" for a in alarms if not a.startswith(OWN_SUSPECT)]
    if until:
        if until not in [name for _, name in phases(out)]:
            wrong.append(f"never reached {until}")
        if run_code != 128 + signal.SIGINT:
            wrong.append(f"exit code {run_code}")
    elif run_code:
        wrong.append(f"exit code {run_code}")
    if left := orphans(str(out)):
        wrong.append(f"{left} processes left")
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rate", type=float, default=1000.0, help="to each port, a second")
    parser.add_argument("--scenario", default="rescue")
    parser.add_argument("--speed", default="1")
    parser.add_argument("--until", default="", metavar="PHASE", help="of the station; then stop")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        return flooded(Path(name), options)


def flooded(folder: Path, options: argparse.Namespace) -> int:
    rng = random.Random(options.seed)
    key, out = folder / "key", folder / "run"
    key.write_text(secrets.token_hex())
    key.chmod(0o600)
    command = [sys.executable, "-m", "hil.cli", "run", f"scenarios/{options.scenario}.yaml"]
    command += ["--out", str(out), "--seed", str(options.seed), "--speed", options.speed]
    command += ["--signing-key", str(key), "--set", "planning.planner=cem"]
    load = Load()
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as run:
        while run.poll() is None and world_s(out) < BEGIN_S:
            select.select([], [], [], 0.1)
        pids = {run.pid: "hil.cli run", **descendants(run.pid)}
        load.note(pids)
        select.select([], [], [], CALM_S)
        load.note(pids)
        ports = ports_of(pids)
        for _ in flood(ports, junk(rng, folder), options.rate, options.seconds):
            if run.poll() is not None:
                break
        load.note(pids)
        reached = False
        while run.poll() is None and not reached:
            select.select([], [], [], 0.2)
            reached = options.until in [name for _, name in phases(out)]
            if len(load.at) == 3 and time.monotonic() - load.at[2][0] >= CALM_S:
                load.note(pids)
        if reached:
            run.send_signal(signal.SIGINT)
        assert run.stderr is not None
        words = run.stderr.read().strip()
        code = run.wait()
    print(table(ports, load))
    told = [json.loads(line)["text"] for line in text(out / "events.jsonl").splitlines()]
    print("\n".join(dict.fromkeys(t for t in told if "refused" in t)))
    wrong = faults_of(out, code, options.until)
    if wrong:
        print("\n".join([*wrong, words]), file=sys.stderr)
    return 1 if wrong else 0


def table(ports: list[Port], load: Load) -> str:
    lines = [
        "| process | its ports | datagrams | each a second | core before | in the flood | after |",
        "|---|---|---|---|---|---|---|",
    ]
    seconds = load.at[2][0] - load.at[1][0]
    for pid in dict.fromkeys(p.pid for p in ports):
        mine = [p for p in ports if p.pid == pid]
        shares = " | ".join(f"{load.share(pid, k):.1%}" for k in range(3))
        sent = sum(p.sent for p in mine)
        each = sent / len(mine) / seconds
        lines.append(f"| {mine[0].role} | {len(mine)} | {sent} | {each:.0f} | {shares} |")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
