"""Fuzz what station and bench read: `python benchmarks/fuzz_station.py TARGET --seconds 600`.

TARGET is
- station: datagrams into a station in the middle of its probe, three links, on and off a step;
- scenario: shipped YAML, and noise, cut, joined, repeated and garbled, through the loader;
- physics: both packets of the physics link, garbled, and numbers that are none;
- replay: a recorded telemetry log and a journal, garbled, through reader, station and diagnosis.

Only `InputError` may come out, and a station must still step, hold finite beliefs and end its step
with plain commands. The seed that is printed repeats a run.
"""

import argparse
import json
import lzma
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
from fastcrc.crc16 import mcrf4xx
from fuzz_vehicle import LAYOUTS, broken, frame

from base_station.commands import encode
from base_station.journal import Head, Inputs, encoded
from base_station.replay import replay
from base_station.resuming import resume
from base_station.tlog import read_tlog
from hil.bench.folders import blind_view
from hil.bench.rig import Rig
from hil.errors import InputError
from hil.mavlink import Encoder
from hil.physics_link import (
    PhysicsState,
    ServoFrame,
    decode_frame,
    decode_state,
    encode_frame,
    encode_state,
)
from hil.scenario import load_scenario, load_station_view
from hil.world.simulation import Simulation

ROOT = Path(__file__).parents[1]
SCENARIOS = sorted((ROOT / "scenarios").glob("*.yaml"))
DATA = ROOT / "tests" / "data"
LIFE = 300  # batches until a new station
BATCH = 30


def from_vehicle(rng: random.Random) -> bytes:
    """A valid frame of any message, said by a vehicle of the fleet."""
    data = bytearray(frame(rng))
    data[5:7] = bytes((rng.randrange(1, 4), rng.choice((1, 1, 1, 0, 190))))
    end = 10 + data[1]
    number = int.from_bytes(data[7:10], "little")
    extra = bytes([LAYOUTS[number].crc_extra])
    data[end : end + 2] = mcrf4xx(bytes(data[1:end]) + extra).to_bytes(2, "little")
    return bytes(data)


def garbled(rng: random.Random, data: bytes) -> bytes:
    """Bytes changed, cut out, doubled, put in."""
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 5, 40))):
        at, size = rng.randrange(len(out) + 1), rng.choice((1, 1, 2, 8, 64))
        match rng.randrange(4):
            case 0:
                out[at : at + size] = rng.randbytes(size)
            case 1:
                del out[at : at + size]
            case 2:
                out[at:at] = out[at : at + size]
            case _:
                out[at:at] = rng.randbytes(size)
    return bytes(out)


def station(rng: random.Random) -> Iterator[int]:
    scenario = load_scenario(ROOT / "scenarios" / "rescue.yaml", [f"seed={rng.randrange(10**6)}"])
    rig = Rig(scenario, blind_view(scenario), [])
    until_s = rng.uniform(0.1, 15.0)
    for _ in rig.run():
        if rig.time_s > until_s:
            break
    node, wall_s = rig.node, rig.time_s
    for _ in range(LIFE):
        for link in rig.station_links:
            for _ in range(BATCH // 3):
                link._inbox.append(broken(rng, from_vehicle(rng)))  # type: ignore[attr-defined]
        wall_s += rng.choice((0.0, 0.05, 0.05, 1.0))
        node.step(wall_s, round(wall_s * 1e6))
        desk = node.station.desk
        if desk.watching and not np.isfinite(desk.watch.state).all():
            raise AssertionError("the believed twin is not finite")
        yield BATCH


def scenario(rng: random.Random) -> Iterator[int]:
    texts = [path.read_bytes() for path in SCENARIOS]
    view = json.dumps(blind_view(load_scenario(SCENARIOS[0])).model_dump(mode="json")).encode()
    bombs = [b"[" * 10_000, b"a: &a [*a]\n", b"{a: " * 5_000, b"? " * 5_000, b"- " * 20_000]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "any.yaml"
        for _ in range(LIFE):
            path.write_bytes(garbled(rng, rng.choice((*texts, view, *bombs))))
            for load in (load_scenario, load_station_view):
                try:
                    load(path)
                except InputError as error:
                    if "\n" in str(error):
                        raise AssertionError(f"more than a line: {error}") from None
            yield 2


def physics(rng: random.Random) -> Iterator[int]:
    scenario = load_scenario(ROOT / "scenarios" / "rescue.yaml")
    simulation = Simulation(scenario, 1)
    three = (1.0, 2.0, 3.0)
    state = encode_state(PhysicsState(1.0, *(three,) * 5))
    for count in range(LIFE):
        servo = encode_frame(ServoFrame(50, count, tuple(rng.randrange(2**16) for _ in range(16))))
        for _ in range(BATCH):
            odd = rng.choice((b"NaN", b"1e999", b"null", b"-Infinity", b"[]", b"true", b'"x"'))
            answer = state.replace(rng.choice((b"1.0", b"2.0", b"3.0")), odd, 1)
            decode_state(garbled(rng, rng.choice((state, answer))))
            decode_state(answer)
            bad = garbled(rng, servo)
            decode_frame(bad)
            simulation.receive(rng.randrange(1, 4), [bad, servo], float(count))
        simulation.advance(float("inf"), float(count))
        yield BATCH


def replays(rng: random.Random) -> Iterator[int]:
    log = lzma.decompress((DATA / "rescue.tlog.xz").read_bytes())
    view = load_station_view(DATA / "rescue-view.json")
    gcs = Encoder(250, 190)
    steps = [Inputs(k * 0.05, k, ((k % 3, gcs.gcs_heartbeat()),)) for k in range(200)]
    journal = b"".join(map(encoded, (Head(view.model_dump(mode="json")), *steps)))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for _ in range(LIFE):
            at = rng.randrange(len(log) // 2)
            (folder / "any.tlog").write_bytes(garbled(rng, log[:at] if rng.random() < 0.5 else log))
            (folder / "journal-0001.bin").write_bytes(garbled(rng, journal))
            for read in (_replayed, _resumed):
                with suppress(InputError):
                    read(folder, view)
            yield 2


def _replayed(folder: Path, view: object) -> None:
    replay(view, list(read_tlog(folder / "any.tlog")))  # type: ignore[arg-type]


def _resumed(folder: Path, _view: object) -> None:
    node = resume(folder, None).node
    out = node.station.step(1e3, ())
    for command in out.commands:
        encode(command, Encoder(250, 190), node.station.autopilots[0])


TARGETS: dict[str, Callable[[random.Random], Iterator[int]]] = {
    "station": station,
    "scenario": scenario,
    "physics": physics,
    "replay": replays,
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", choices=TARGETS)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    counts = Counter[str]()
    end_s = time.monotonic() + arguments.seconds
    seed = arguments.seed
    while time.monotonic() < end_s:
        counts["lives"] += 1
        try:
            for inputs in TARGETS[arguments.target](random.Random(seed)):
                counts["inputs"] += inputs
                if time.monotonic() >= end_s:
                    break
        except Exception:
            print(f"{arguments.target}: --seed {seed} --seconds 600 repeats it", file=sys.stderr)
            raise
        seed += 1
    print(f"{arguments.target}: seeds {arguments.seed} to {seed - 1}, {counts['inputs']} inputs")
    return 0


if __name__ == "__main__":
    sys.exit(main())
