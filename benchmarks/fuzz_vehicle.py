"""Fuzz the whole receive path of a vehicle: `python benchmarks/fuzz_vehicle.py --seconds 600`.

Datagrams are made from valid frames of every message the dialect has, with random payloads, and
then broken: bits flipped, cut, joined, flags set, checksums mended or not. After each batch the
vehicle must still step, hold finite outputs, and answer a request. Exit code 1 when it does not;
the seed printed repeats the run.
"""

import argparse
import math
import random
import struct
import sys
import time
from collections import Counter
from pathlib import Path

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega

from hil.mavlink import Command, CopterMode, Decoder, Encoder, MessageId, RoverMode
from hil.physics_link import AT_REST_MPS2, PhysicsState
from hil.scenario import load_scenario
from sim_vehicles.vehicle import PortName, Vehicle

SCENARIO = Path(__file__).parents[1] / "scenarios" / "rescue.yaml"
SYSID, BATCH, LIFE = 2, 50, 2000  # datagrams between checks; batches until a new vehicle
STATION = Encoder(250, 190)
LAYOUTS = {n: m for n, m in ardupilotmega.mavlink_map.items() if n < 2**24}
OURS = [int(m) for m in MessageId]
ODD_FLOATS = [math.nan, math.inf, -math.inf, 1e30, -3e38, 1e-45, 0.0, -0.0]
ZERO = (0.0, 0.0, 0.0)
AIRFRAMES = ("omni_plus", "skid_steer", "quad_x")
HEIGHT_M = 3.0


def payload(rng: random.Random, size: int) -> bytes:
    """Random bytes, zeros, ones, or odd floats throughout."""
    kind = rng.randrange(4)
    if kind == 0:
        return rng.randbytes(size)
    if kind == 1:
        return bytes([rng.choice((0, 1, 127, 128, 255))]) * size
    if kind == 2:
        return bytes(rng.choice((0, 0, 0, 1, SYSID, 255)) for _ in range(size))

    floats = b"".join(struct.pack("<f", rng.choice(ODD_FLOATS)) for _ in range(size // 4 + 1))
    return floats[:size]


def frame(rng: random.Random) -> bytes:
    """A frame whose checksum is right, mostly addressed to the vehicle."""
    number = rng.choice(OURS) if rng.random() < 0.8 else rng.choice(list(LAYOUTS))
    layout = LAYOUTS[number]
    body = bytearray(payload(rng, layout.unpacker.size))
    for name, value in (("target_system", SYSID), ("target_component", 1), ("target", SYSID)):
        if name in layout.ordered_fieldnames and rng.random() < 0.9:
            at = offset(layout, name)
            body[at] = value
    flags = rng.choice((0, 0, 0, 1, rng.randrange(256)))
    ids = bytes((rng.choice((250, 245, 1, 0, 255)), rng.choice((190, 1, 0))))
    head = bytes((len(body), flags, 0, rng.randrange(256))) + ids + number.to_bytes(3, "little")
    crc = mcrf4xx(head + bytes(body) + bytes([layout.crc_extra])).to_bytes(2, "little")
    return b"\xfd" + head + bytes(body) + crc + (rng.randbytes(13) if flags & 1 else b"")


def offset(layout: type, name: str) -> int:
    """Where a field begins on the wire."""

    codes = layout.unpacker.format.lstrip("<")
    at, expanded, count = 0, [], ""
    for c in codes:
        if c.isdigit():
            count += c
            continue
        expanded += [c] if c == "s" else [c] * int(count or 1)
        if c == "s":
            expanded[-1] = f"{count or 1}s"
        count = ""
    k = 0
    for field, length in zip(layout.ordered_fieldnames, layout.array_lengths, strict=True):
        if field == name:
            return at
        items = 1 if expanded[k].endswith("s") else max(1, length)
        at += sum(struct.calcsize("<" + e) for e in expanded[k : k + items])
        k += items
    raise KeyError(name)


def broken(rng: random.Random, data: bytes) -> bytes:
    """What a bad line, or bad intent, makes of it."""
    kind = rng.randrange(8)
    if kind == 0:
        return data[: rng.randrange(len(data) + 1)]
    if kind == 1 and data:
        at = rng.randrange(len(data))
        return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]
    if kind == 2:
        return rng.randbytes(rng.randrange(300))
    if kind == 3:
        return data + frame(rng) + rng.randbytes(rng.randrange(20))
    if kind == 4:
        return rng.randbytes(rng.randrange(20)) + data
    return data


class Subject:
    """A vehicle that stands, or hangs in the air, armed and in GUIDED; and its time."""

    def __init__(self, seed: int, airframe: str) -> None:
        overrides = [f"seed={seed}", "yaw=free", "faults=[]", f"fleet.1.airframe={airframe}"]
        self.vehicle = Vehicle(load_scenario(SCENARIO, overrides), SYSID)
        self.ticks, self.down_m = 0, 0.0
        for _ in range(75):
            self.step()
        flies = airframe == "quad_x"
        mode = CopterMode.GUIDED if flies else RoverMode.GUIDED
        self.vehicle.receive("gcs", STATION.set_mode(SYSID, mode))
        self.vehicle.receive("gcs", STATION.arm(SYSID))
        if flies:
            take_off = (Command.NAV_TAKEOFF, 0, 0, 0, math.nan, 0, 0, HEIGHT_M)
            self.vehicle.receive("gcs", STATION.command_long(SYSID, *take_off))
            self.down_m = -HEIGHT_M

    def step(self) -> None:
        self.ticks += 1
        place = (0.0, 0.0, self.down_m)
        state = PhysicsState(self.ticks * 0.02, ZERO, AT_REST_MPS2, place, ZERO, ZERO)
        pwm = self.vehicle.step(state)
        if not all(0 <= p <= 2200 for p in pwm):
            raise AssertionError(f"outputs out of range: {pwm}")

    def check(self, port: PortName) -> None:
        """It steps, and answers a request to the point."""
        self.step()
        self.vehicle.outbox("gcs"), self.vehicle.outbox("injector")
        self.vehicle.receive(port, STATION.request_message(SYSID, MessageId.HEARTBEAT))
        answers = [r.value for d in self.vehicle.outbox(port) for r in Decoder().decode(d)]
        if [type(a).__name__ for a in answers] != ["CommandAck", "Heartbeat"]:
            raise AssertionError(f"no answer, but {answers}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng, counts = random.Random(arguments.seed), Counter[str]()
    end_s = time.monotonic() + arguments.seconds
    recent: list[tuple[PortName, bytes]] = []
    try:
        while time.monotonic() < end_s:
            airframe = AIRFRAMES[counts["vehicles"] % len(AIRFRAMES)]
            subject = Subject(rng.randrange(2**31), airframe)
            counts["vehicles"] += 1
            counts[airframe] += 1
            for _ in range(LIFE):
                port: PortName = rng.choice(("gcs", "gcs", "injector"))
                recent = [(port, broken(rng, frame(rng))) for _ in range(BATCH)]
                for name, datagram in recent:
                    subject.vehicle.receive(name, datagram)
                subject.check(port)
                counts["datagrams"] += BATCH
                if time.monotonic() >= end_s:
                    break
    except Exception:
        print(f"seed {arguments.seed}, {dict(counts)}; the last datagrams:", file=sys.stderr)
        for name, datagram in recent:
            print(name, datagram.hex(), file=sys.stderr)
        raise
    print(f"seed {arguments.seed}: {dict(counts)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
