"""SIGKILL at random moments: does a run end cleanly, or go on, and is every file readable?

    python benchmarks/kills.py [--kills 20] [--victims station planner+viewer ...] [--speed 1]
                               [--scenario rescue] [--out runs/kills.jsonl] [--table]

One run of `hil run --restart-station` over UDP for each kill, with `planning.planner=cem`. A
station dies at a random moment of one phase after the other, the others at random moments of what
a run takes. The kill of a station, planner or viewer has to end in the right verdict and a finished
mission; any other in exit code 3 with the victim named. In every case no process may be left, no
vehicle may drive on while nobody steers it, every file has to be readable, and what was recorded
has to reach to a second before the kill. Results are lines of JSON: a benchmark that was stopped
goes on. `planner+viewer` kills both in one run, each at its own moment. Two more get a run over
what happens to their station: `stopped` stops it for 5 s, `starved` gives it a tenth of 30 s.
Then a table in Markdown; exit code 1 for anything else.
"""

import argparse
import json
import os
import random
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from itertools import chain
from pathlib import Path

import pyarrow as pa
from rerun.chunk import RrdReader

from base_station.journal import Inputs, decoded, journal_files
from base_station.tlog import read_tlog

ROOT = Path(__file__).parents[1]
PATTERNS = {
    "station": "base_station.process ",
    "vehicle": "--sysid 2",
    "planner": "base_station.planning.process",
    "world": "hil.cli world",
    "viewer": "--serve-web",
}
SLEEPY = {"stopped": (5.0, 0.0, 1), "starved": (0.09, 0.01, 300)}  # s stopped, s awake, times
PATTERNS |= dict.fromkeys(SLEEPY, PATTERNS["station"])
VICTIMS = (*PATTERNS, "planner+viewer")
DEFAULT = ("station", "vehicle", "world", "planner+viewer")
NAMES = {
    "planner+viewer": "planner",
    "station": "base-station",
    "vehicle": "sim-vehicle",
    "planner": "planner",
}
SURVIVED = (
    "station",
    "planner",
    "viewer",
    "planner+viewer",
    *SLEEPY,
)  # whose death a run gets over
PHASES_S = {  # how long they last, in fleet time (s)
    "connect": 12.0,  # of wall time, from when the process starts
    "probe": 11.0,
    "plan_alpha": 3.0,
    "experiment": 10.0,
    "plan_beta": 6.0,
    "mission": 15.0,
}
MOMENTS_S = (2.0, 60.0)  # of fleet time, in which a run does all that it does
GIVE_UP_S = 900.0
GONE_WITHIN_S = 10.0
LOST_S = 1.0
OBEYED_S = 4.0  # a set-point holds for 3 s; then a vehicle has to come to rest
AT_REST_MPS = 0.05


@dataclass(frozen=True)
class Kill:
    """When it happened: unix time, and world time (s)."""

    epoch_s: float
    world_s: float


@dataclass(frozen=True)
class Result:
    """`lost_s` is from the newest record before the kill to the kill, in the worst of the files;
    `drove_s` how long after a station's death any vehicle still moved."""

    victim: str
    number: int
    planned: str
    moment_s: float
    phase: str
    code: int
    verdict: str
    met: bool
    named: bool
    orphans: int
    unreadable: tuple[str, ...]
    lost_s: float
    drove_s: float
    wall_s: float
    said: str = ""

    @property
    def clean(self) -> bool:
        kept = self.lost_s <= LOST_S and self.drove_s <= OBEYED_S
        return kept and not self.orphans and not self.unreadable

    @property
    def good(self) -> bool:
        if self.victim in SURVIVED:
            return self.clean and self.code == 0 and self.met
        return self.clean and self.code == 3 and self.named


def one(victim: str, number: int, options: argparse.Namespace) -> Result:
    began_s = time.monotonic()
    rng = random.Random(f"{victim} {number}")
    phase = (
        list(PHASES_S)[number % len(PHASES_S)]
        if PATTERNS.get(victim) == PATTERNS["station"]
        else ""
    )
    plan = sorted(
        (rng.uniform(0.0, PHASES_S[phase]) if phase else rng.uniform(*MOMENTS_S), name)
        for name in victim.split("+")
    )
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        command = [sys.executable, "-m", "hil.cli", "run", f"scenarios/{options.scenario}.yaml"]
        command += ["--out", str(out), "--seed", str(number), "--speed", options.speed]
        command += ["--restart-station", "--set", "planning.planner=cem"]
        command += ["--serve"] * ("viewer" in victim)
        run = subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        assert run.stderr is not None
        kills = [
            _strike_when(run, name, partial(_has_come, out, phase, moment_s), out)
            for moment_s, name in plan
        ]
        code = _end_of(run)
        words = run.stderr.read() + text(out / "base-station.log")
        run.stderr.close()
        result = json.loads(text(out / "result.json") or "{}")
        found = Result(
            victim=victim,
            number=number,
            planned=" ".join([*[f"{phase} +"] * bool(phase), *(f"{s:.1f} s" for s, _ in plan)]),
            moment_s=round(kills[0].world_s, 1),
            phase=" ".join(_phase_at(out, kill.world_s) for kill in kills),
            code=code,
            verdict=(result.get("verdict") or {}).get("hypothesis", ""),
            met=bool(result.get("expected_met")),
            named=NAMES.get(victim, victim) in words,
            orphans=orphans(str(out)),
            unreadable=tuple(_unreadable(out)),
            lost_s=round(max(_lost_s(out, kill.epoch_s) for kill in kills), 2),
            drove_s=round(_drove_s(out, kills[0].world_s), 2) if victim == "station" else 0.0,
            wall_s=round(time.monotonic() - began_s, 1),
            said=words.strip()[-300:],
        )
        if options.keep is not None and not found.good:
            shutil.copytree(out, options.keep / f"{victim}-{number}", dirs_exist_ok=True)
        return found


def _strike_when(
    run: subprocess.Popen[str], victim: str, has_come: Callable[[], bool], out: Path
) -> Kill:
    """Kill the victim once its moment has come; never, in a run that ends before."""
    while run.poll() is None:
        select.select([], [], [], 0.05)
        if not has_come():
            continue
        for pid, words in descendants(run.pid).items():
            if PATTERNS[victim] in words:
                kill = Kill(time.time(), world_s(out))
                if victim in SLEEPY:
                    _put_to_sleep(pid, *SLEEPY[victim])
                else:
                    os.kill(pid, signal.SIGKILL)
                return kill
    return Kill(time.time(), world_s(out))


def _put_to_sleep(pid: int, stopped_s: float, awake_s: float, times: int) -> None:
    with suppress(ProcessLookupError):
        for _ in range(times):
            os.kill(pid, signal.SIGSTOP)
            time.sleep(stopped_s)
            os.kill(pid, signal.SIGCONT)
            time.sleep(awake_s)


def _has_come(out: Path, phase: str, moment_s: float) -> bool:
    """World time has come that far, since the beginning, or since a phase began."""
    if phase == "connect":
        begun = [path.parent for path in out.parent.glob(".station-*/journal-0001.bin")]
        started_s = [(folder / "base-station.log").stat().st_mtime for folder in begun]
        return bool(started_s) and time.time() - started_s[0] >= moment_s
    begun = [0.0] if not phase else [t for t, name in phases(out) if name == phase]
    return bool(begun) and world_s(out) >= begun[0] + moment_s


def world_s(out: Path) -> float:
    lines = text(out / "truth.jsonl").splitlines()[:-1]
    return float(json.loads(lines[-1]).get("time_s", 0.0)) if lines else 0.0


def phases(out: Path) -> list[tuple[float, str]]:
    """(fleet time, name) as the run was told, the newest last."""
    *events, _ = [*text(out / "events.jsonl").split("\n")]
    told = map(json.loads, events)
    return [(e["time_s"], e["text"]) for e in told if e["kind"] == "phase"]


def _end_of(run: subprocess.Popen[str]) -> int:
    try:
        return run.wait(GIVE_UP_S)
    except subprocess.TimeoutExpired:
        run.kill()
        return run.wait()


def descendants(pid: int) -> dict[int, str]:
    found: dict[int, str] = {}
    for thread in Path(f"/proc/{pid}/task").glob("*"):
        for below in map(int, text(thread / "children").split()):
            found[below] = text(Path(f"/proc/{below}/cmdline")).replace("\0", " ")
            found |= descendants(below)
    return found


def orphans(out: str) -> int:
    """Processes that still know this run's folder, once the kernel has had time to bury them."""
    end_s = time.monotonic() + GONE_WITHIN_S
    while True:
        left = [
            p
            for p in Path("/proc").glob("[0-9]*")
            if out in text(p / "cmdline") and int(p.name) != os.getpid()
        ]
        if not left or time.monotonic() > end_s:
            return len(left)
        select.select([], [], [], 0.2)


def text(path: Path) -> str:
    try:
        return path.read_text(errors="replace")
    except OSError:
        return ""


def _phase_at(out: Path, moment_s: float) -> str:
    told = [name for time_s, name in phases(out) if time_s <= moment_s]
    return told[-1] if told else "connect"


def _unreadable(out: Path) -> list[str]:
    bad = []
    for path in sorted(out.iterdir()):
        try:
            if path.suffix == ".jsonl":
                [json.loads(line) for line in path.read_text().splitlines()]
            elif path.suffix == ".json":
                json.loads(path.read_text())
            elif path.suffix == ".tlog":
                list(read_tlog(path))
            elif path.suffix == ".rrd":
                next(iter(RrdReader(str(path)).stream().to_chunks()))
        except Exception as error:  # whatever it is: that file cannot be read
            bad.append(f"{path.name}: {error}"[:100])
    if not journal_files(out):
        bad.append("no journal")
    return bad


def _lost_s(out: Path, kill_s: float) -> float:
    """From the newest record before the kill to the kill; the worst of journal, logs, recording."""
    kept = chain.from_iterable(decoded(path.read_bytes()) for path in journal_files(out))
    logs = [[r.epoch_us / 1e6 for r in kept if isinstance(r, Inputs)]]
    logs += [[us / 1e6 for us, _ in read_tlog(path)] for path in out.glob("*.tlog")]
    if (out / "mission.rrd").exists():
        logs.append(list(_recorded_s(out / "mission.rrd")))
    before = [[t for t in times if t <= kill_s] for times in logs]
    return max((kill_s - max(times) for times in before if times), default=0.0)


def _recorded_s(path: Path) -> Iterator[float]:
    """Wall times of the rows in which the station told where the fleet is."""
    for chunk in RrdReader(str(path)).stream().filter(content="/fleet").to_chunks():
        if not chunk.is_static and "wall_time" in chunk.timeline_names:
            times = chunk.to_record_batch().column("wall_time").cast(pa.int64()).to_pylist()
            yield from (t / 1e9 for t in times)


def _drove_s(out: Path, kill_s: float) -> float:
    """How long after the kill somebody still moved, until all stood."""
    for truth in map(json.loads, text(out / "truth.jsonl").splitlines()):
        if truth["type"] == "truth" and truth["time_s"] >= kill_s:
            speeds_mps = [(v[3] ** 2 + v[4] ** 2) ** 0.5 for v in truth["vehicles"].values()]
            if max(speeds_mps) <= AT_REST_MPS:
                return float(truth["time_s"]) - kill_s
    return float("inf")


def table(results: list[Result]) -> str:
    head = (
        "killed", "times", "as it must be", "right verdict, mission finished", "named", "orphans",
        "unreadable files", "most lost (s)", "longest drive on (s)",
    )  # fmt: skip
    lines = [_row(*head), _row(*["---"] * len(head))]
    for victim in VICTIMS:
        mine = [r for r in results if r.victim == victim]
        phases = (
            dict.fromkeys(r.planned.split(" +")[0] for r in mine) if victim == "station" else {}
        )
        if mine:
            lines.append(_summary(victim, mine))
        for phase in phases:
            there = [r for r in mine if r.planned.startswith(phase)]
            lines.append(_summary(f"{victim}, in `{phase}`", there))
    return "\n".join(lines)


def _summary(name: str, mine: list[Result]) -> str:
    return _row(
        name,
        len(mine),
        sum(r.good for r in mine),
        sum(r.met for r in mine),
        sum(r.named for r in mine),
        sum(r.orphans for r in mine),
        sum(len(r.unreadable) for r in mine),
        f"{max(r.lost_s for r in mine):.2f}",
        f"{max(r.drove_s for r in mine):.1f}",
    )


def _row(*cells: object) -> str:
    return f"| {' | '.join(map(str, cells))} |"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=20, help="of each victim")
    parser.add_argument("--first", type=int, default=0, help="number of the first of them")
    parser.add_argument("--victims", nargs="+", choices=VICTIMS, default=DEFAULT)
    parser.add_argument("--scenario", default="rescue")
    parser.add_argument("--speed", default="1")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="the folders of bad runs")
    parser.add_argument("--table", action="store_true", help="of what there is; nothing is run")
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / "kills.jsonl")
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    trees = [json.loads(line) for line in text(options.out).splitlines()]
    results = [Result(**{**t, "unreadable": tuple(t["unreadable"])}) for t in trees]
    done = {(r.victim, r.number) for r in results}
    with options.out.open("a", encoding="utf-8") as file:
        for victim in options.victims if not options.table else ():
            for number in range(options.first, options.first + options.kills):
                if (victim, number) in done:
                    continue
                result = one(victim, number, options)
                file.write(json.dumps(asdict(result)) + "\n")
                file.flush()
                results.append(result)
                print("good" if result.good else "BAD ", result, file=sys.stderr, flush=True)
    print(table(results))
    return 0 if all(r.good for r in results) else 1


if __name__ == "__main__":
    sys.exit(main())
