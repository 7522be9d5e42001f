"""Bad radio against the whole station: loss x delay x disorder x black-outs x scenario.

    python benchmarks/chaos.py [--runs 300] [--udp 0] [--out runs/chaos.jsonl] [--learn] [--table]

Cells of the matrix come in a shuffled order that is always the same, run k has seed k, and each
result is a line of JSON, so that a run that was stopped goes on. In memory `cem` finds the
experiment; a mission is learnt once for each belief and place (to a metre) and used again (--learn:
in every run). Then a table in Markdown. Exit code 1 when something happened that must not: a wrong
verdict with a posterior of 0.99 or more, a false alarm, a set-point executed for more than 3 s.
"""

import argparse
import itertools
import json
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from base_station import twin
from base_station.listeners import Silent
from base_station.planning.planner import plan
from base_station.planning.requests import PlanProgress, PlanReady, PlanRequest
from base_station.records import Event
from hil.bench.folders import blind_view
from hil.bench.injector import Breaker
from hil.bench.onsets import Onsets
from hil.bench.rig import Learn, Rig
from hil.link import Link
from hil.mavlink import Decoder, LocalSetpoint
from hil.scenario import Scenario, StationView, load_scenario

ROOT = Path(__file__).parents[1]
EXPECTED = {"rescue": "motor_y_off", "stuck_gps": "gps_east_stuck", "healthy": None}
LOSSES = (0.0, 0.1, 0.3)
DELAYS_S = (0.0, 0.1, 0.25, 0.5)
DISORDERS = (0.0, 0.2)  # reordering and duplication, each
BLACKOUTS = ((0, ""), *itertools.product((1, 5, 15), ("one", "all")))
CERTAIN = 0.99
KEPT_S = 3.2  # an autopilot keeps a set-point for 3 s; plus a frame of the telemetry
DRIVE_US = 100  # output away from neutral: more than braking at rest takes
GIVE_UP_S = 240.0


@dataclass(frozen=True)
class Cell:
    scenario: str
    loss: float
    delay_s: float
    disorder: float
    blackout_s: int
    whose: str


@dataclass(frozen=True)
class Result:
    """`verdict` '' is none; `posterior` is that of the verdict; `stale_s` the longest drive on a
    set-point, counted from its arrival."""

    run: int
    udp: bool
    cell: Cell
    verdict: str
    posterior: float
    decided: bool
    false_alarms: tuple[str, ...]
    ended: str
    delivered: int
    stale_s: float
    wall_s: float

    @property
    def right(self) -> bool:
        expected = EXPECTED[self.cell.scenario]
        if expected is None:
            return not self.decided and not self.false_alarms
        return self.decided and self.verdict == expected

    @property
    def wrong(self) -> bool:
        return self.decided and not self.right

    @property
    def forbidden(self) -> bool:
        sure = self.wrong and self.posterior >= CERTAIN
        return sure or bool(self.false_alarms) or self.stale_s > KEPT_S


def cells() -> list[Cell]:
    found = [
        Cell(name, loss, delay_s, disorder, *blackout)
        for name, loss, delay_s, disorder, blackout in itertools.product(
            EXPECTED, LOSSES, DELAYS_S, DISORDERS, BLACKOUTS
        )
    ]
    random.Random(8).shuffle(found)
    return found


def overrides(cell: Cell, run: int) -> list[str]:
    """The cell as `--set` of a scenario; the black-out comes at a random moment."""
    steady = {
        "loss": cell.loss,
        "delay_s": cell.delay_s,
        "duplication": cell.disorder,
        "reordering": cell.disorder,
    }
    rng = random.Random(run)
    from_s = round(rng.uniform(3.0, 40.0), 1)
    dark = {"from_s": from_s, "until_s": from_s + cell.blackout_s, "loss": 1.0}
    both = [dark, steady] if cell.blackout_s else [steady]
    sets = [f"seed={run}", "planning.planner=cem"]
    sets.append(f"radio={json.dumps(both if cell.whose == 'all' else [steady])}")
    if cell.whose == "one":
        sets.append(f"fleet.{rng.randrange(3)}.radio={json.dumps(both)}")
    return sets


class Told(Silent):
    """What matters of the station's events."""

    def __init__(self) -> None:
        self.anomalies: list[str] = []

    def event(self, event: Event) -> None:
        if event.kind == "anomaly":
            self.anomalies.append(event.text.split()[0])


class Tap:
    """A vehicle's link, with the time of the last set-point that came through."""

    def __init__(self, link: Link, clock: Callable[[], float]) -> None:
        self._link, self._clock, self._decoder = link, clock, Decoder()
        self.last_s: float | None = None

    def send(self, datagram: bytes) -> None:
        self._link.send(datagram)

    def receive(self) -> list[bytes]:
        datagrams = self._link.receive()
        for datagram in datagrams:
            if any(isinstance(m.value, LocalSetpoint) for m in self._decoder.decode(datagram)):
                self.last_s = self._clock()
        return datagrams


def in_memory(run: int, cell: Cell, learn: Learn) -> Result:
    scenario = load_scenario(ROOT / "scenarios" / f"{cell.scenario}.yaml", overrides(cell, run))
    began_s = time.monotonic()
    told = Told()
    rig = Rig(scenario, blind_view(scenario), [told], learn)
    taps = {}
    for sysid, seat in rig._seats.items():
        taps[sysid] = seat.gcs = Tap(seat.gcs, lambda: rig.time_s)
    stale_s = 0.0
    for _ in struck(scenario, rig):
        for sysid, tap in taps.items():
            drives = any(p and abs(p - 1500) > DRIVE_US for p in rig._seats[sysid].outputs)
            if drives and tap.last_s is not None:
                stale_s = max(stale_s, rig.time_s - tap.last_s)
        if rig.node.finished or rig.time_s > GIVE_UP_S:
            break
    desk = rig.node.station.desk
    verdict = desk.verdict
    broken = scenario.vehicle(2).name if EXPECTED[cell.scenario] else ""
    return Result(
        run=run,
        udp=False,
        cell=cell,
        verdict=verdict.hypothesis if verdict else "",
        posterior=round(max(verdict.posterior.values()), 4) if verdict else 0.0,
        decided=bool(verdict and verdict.decided),
        false_alarms=tuple(name for name in told.anomalies if name != broken),
        ended=getattr(desk.phase, "reason", desk.phase.name),
        delivered=sum(desk.goals.delivered),
        stale_s=round(stale_s, 2),
        wall_s=round(time.monotonic() - began_s, 1),
    )


def struck(scenario: Scenario, rig: Rig) -> Iterator[None]:
    """Time passes, and faults strike as the scenario says."""
    breaker = Breaker(scenario, lambda _: None, lambda _: None, rig.simulation.obey)
    onsets = Onsets(scenario)
    breaker.strike(onsets.at_start())

    def inject() -> None:
        for vehicle, link in zip(scenario.fleet, rig.injector_links, strict=True):
            for datagram in breaker.step(rig.time_s, vehicle.sysid, link.receive()):
                link.send(datagram)

    while not breaker.done:
        inject()
        rig.serve()
    for advance in rig.run():
        for record in advance.truth:
            breaker.strike(onsets.due(record))
        inject()
        yield


class Cached:
    """Missions learnt once for each belief and place: one learnt elsewhere would go astray."""

    def __init__(self) -> None:
        self._known: dict[str, PlanReady] = {}

    def learn(
        self, view: StationView, request: PlanRequest, tell: Callable[[PlanProgress], None]
    ) -> PlanReady:
        if request.kind == "alpha":
            return plan(view, request, tell)
        place = request.states[0, :, twin.NORTH : twin.EAST + 1].round().tolist()
        name = "+".join(f"{h.sysid} {h.name}" for h in request.hypotheses) + str(place)
        if name not in self._known:
            self._known[name] = plan(view, request, tell)
        return replace(self._known[name], number=request.number)


def over_udp(run: int, cell: Cell) -> Result:
    began_s = time.monotonic()
    sets = itertools.chain.from_iterable(("--set", s) for s in overrides(cell, run))
    scenario = ROOT / "scenarios" / f"{cell.scenario}.yaml"
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        command = [sys.executable, "-m", "hil.cli", "run", str(scenario), "--out", str(out), *sets]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        tree: dict[str, Any] = {}
        if (out / "result.json").exists():
            tree = json.loads((out / "result.json").read_text())
        lines = (out / "events.jsonl").read_text().splitlines() if out.exists() else []
    events = [json.loads(line) for line in lines]
    verdict = tree.get("verdict") or {}
    broken = "rover_2" if EXPECTED[cell.scenario] else ""
    alarmed = [e["text"].split()[0] for e in events if e["kind"] == "anomaly"]
    ends = [e["text"] for e in events if e["kind"] == "end"]
    return Result(
        run=run,
        udp=True,
        cell=cell,
        verdict=verdict.get("hypothesis", ""),
        posterior=round(max(verdict.get("posterior", {"": 0.0}).values()), 4),
        decided=bool(verdict.get("decided")),
        false_alarms=tuple(name for name in alarmed if name != broken),
        ended=ends[-1] if ends else done.stderr.strip()[-200:],
        delivered=sum(e["kind"] == "goal" for e in events),
        stale_s=0.0,  # nobody looks into a vehicle's motors here
        wall_s=round(time.monotonic() - began_s, 1),
    )


def table(results: list[Result]) -> str:
    lines = [
        "| what | runs | right verdict, or rightly none | cannot tell, or a hold before it "
        "| wrong | wrong with 0.99 or more | false alarms | longest drive on a set-point (s) |",
        "|---|---|---|---|---|---|---|---|",
    ]
    groups: list[tuple[str, Callable[[Result], bool]]] = [("all", lambda _: True)]
    groups += [(f"`{n}`", partial(_is, "scenario", n)) for n in EXPECTED]
    groups += [(f"loss {x:.0%}", partial(_is, "loss", x)) for x in LOSSES]
    groups += [(f"delay {x * 1e3:.0f} ms", partial(_is, "delay_s", x)) for x in DELAYS_S]
    groups += [(f"disorder {x:.0%}", partial(_is, "disorder", x)) for x in DISORDERS]
    groups += [
        (f"black-out {s} s {who}" if s else "no black-out", partial(_dark, s, who))
        for s, who in BLACKOUTS
    ]
    groups.append(("over UDP", lambda r: r.udp))
    for name, belongs in groups:
        mine = [r for r in results if belongs(r)]
        if not mine:
            continue
        right = [r for r in mine if r.right]
        wrong = [r for r in mine if r.wrong]
        lines.append(
            f"| {name} | {len(mine)} | {len(right)} | {len(mine) - len(right) - len(wrong)} "
            f"| {len(wrong)} | {sum(r.posterior >= CERTAIN for r in wrong)} "
            f"| {sum(bool(r.false_alarms) for r in mine)} | {max(r.stale_s for r in mine):.1f} |"
        )
    return "\n".join(lines)


def _is(field: str, value: object, result: Result) -> bool:
    return bool(getattr(result.cell, field) == value)


def _dark(seconds: int, whose: str, result: Result) -> bool:
    return (result.cell.blackout_s, result.cell.whose) == (seconds, whose)


def read(path: Path) -> list[Result]:
    """What has been run already."""
    lines = path.read_text().splitlines() if path.exists() else []
    trees = [json.loads(line) for line in lines]
    return [
        Result(
            **{
                **tree,
                "cell": Cell(**tree["cell"]),
                "false_alarms": tuple(tree["false_alarms"]),
            }
        )
        for tree in trees
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=300, help="in memory")
    parser.add_argument("--udp", type=int, default=0, help="over UDP")
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / "chaos.jsonl")
    parser.add_argument("--learn", action="store_true", help="the mission, too, in every run")
    parser.add_argument("--table", action="store_true", help="of what there is; nothing is run")
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    results = read(options.out)
    done = {(r.run, r.udp) for r in results}
    matrix = cells()
    learn = plan if options.learn else Cached().learn
    wanted = [(k, False) for k in range(options.runs)] + [(k, True) for k in range(options.udp)]
    with options.out.open("a", encoding="utf-8") as file:
        for run, udp in wanted if not options.table else ():
            if (run, udp) in done:
                continue
            cell = matrix[run % len(matrix)]
            result = over_udp(run, cell) if udp else in_memory(run, cell, learn)
            file.write(json.dumps(asdict(result)) + "\n")
            file.flush()
            results.append(result)
            mark = "FORBIDDEN " if result.forbidden else ""
            print(f"{mark}{result}", file=sys.stderr, flush=True)
    print(table(results))
    return 1 if any(r.forbidden for r in results) else 0


if __name__ == "__main__":
    sys.exit(main())
