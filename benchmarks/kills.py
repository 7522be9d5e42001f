"""SIGKILL at random moments: does a run end cleanly, or go on, and is every file readable?

    python benchmarks/kills.py [--kills 20] [--victims station vehicle ...] [--scenario rescue]
                               [--out runs/kills.jsonl] [--speed 1]

One run of `hil run --restart-station` over UDP for each kill, with `planning.planner=cem`, at a
random moment of what a run takes. A station's kill has to end in the right verdict and a finished
mission; any other in exit code 3 with the victim named. In either case no process may be left, and
every file has to be readable, with at most a second lost. Results are lines of JSON: a benchmark
that was stopped goes on. Then a table in Markdown; exit code 1 for anything else.
"""

import argparse
import json
import os
import random
import select
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from base_station.journal import Inputs, read_journal
from base_station.tlog import read_tlog
from hil.errors import HilError

ROOT = Path(__file__).parents[1]
PATTERNS = {
    "station": "base_station.process ",
    "vehicle": "--sysid 2",
    "planner": "base_station.planning.process",
    "world": "hil.cli world",
}
MOMENTS_S = (2.0, 45.0)  # of fleet time, in which a run does all that it does
GIVE_UP_S = 900.0
GONE_WITHIN_S = 10.0
LOST_S = 1.0


@dataclass(frozen=True)
class Result:
    victim: str
    number: int
    moment_s: float
    phase: str
    code: int
    verdict: str
    met: bool
    named: bool
    orphans: int
    unreadable: tuple[str, ...]
    wall_s: float
    said: str = ""

    @property
    def good(self) -> bool:
        clean = not self.orphans and not self.unreadable
        if self.victim == "station":
            return clean and self.code == 0 and self.met
        return clean and (self.code == 0 or (self.code == 3 and self.named))


def one(victim: str, number: int, options: argparse.Namespace) -> Result:
    moment_s = round(random.Random(f"{victim} {number}").uniform(*MOMENTS_S), 1)
    began_s = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        command = [sys.executable, "-m", "hil.cli", "run", f"scenarios/{options.scenario}.yaml"]
        command += ["--out", str(out), "--seed", str(number), "--speed", options.speed]
        command += ["--restart-station", "--set", "planning.planner=cem"]
        run = subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        assert run.stderr is not None
        struck = _strike_when(run, out, victim, moment_s)
        code = _end_of(run)
        words = run.stderr.read()
        run.stderr.close()
        result = json.loads(_text(out / "result.json") or "{}")
        return Result(
            victim=victim,
            number=number,
            moment_s=moment_s,
            phase=_phase_at(out, moment_s),
            code=code,
            verdict=(result.get("verdict") or {}).get("hypothesis", ""),
            met=bool(result.get("expected_met")),
            named=struck.split(" ")[0] in words or "planner" in words,
            orphans=_orphans(str(out)),
            unreadable=tuple(_unreadable(out)),
            wall_s=round(time.monotonic() - began_s, 1),
            said=words.strip()[-300:],
        )


def _strike_when(run: subprocess.Popen[str], out: Path, victim: str, moment_s: float) -> str:
    """Kill the victim once world time has come that far; returns what is to be named."""
    while run.poll() is None:
        select.select([], [], [], 0.05)
        if _world_s(out) < moment_s:
            continue
        for pid, words in _descendants(run.pid).items():
            if PATTERNS[victim] in words:
                os.kill(pid, signal.SIGKILL)
                return {"vehicle": "sim-vehicle", "planner": "planner"}.get(victim, victim)
        break
    return victim


def _world_s(out: Path) -> float:
    lines = _text(out / "truth.jsonl").splitlines()[:-1]
    return float(json.loads(lines[-1]).get("time_s", 0.0)) if lines else 0.0


def _end_of(run: subprocess.Popen[str]) -> int:
    try:
        return run.wait(GIVE_UP_S)
    except subprocess.TimeoutExpired:
        run.kill()
        return run.wait()


def _descendants(pid: int) -> dict[int, str]:
    found: dict[int, str] = {}
    for thread in Path(f"/proc/{pid}/task").glob("*"):
        for below in map(int, _text(thread / "children").split()):
            found[below] = _text(Path(f"/proc/{below}/cmdline")).replace("\0", " ")
            found |= _descendants(below)
    return found


def _orphans(out: str) -> int:
    """Processes that still know this run's folder, once the kernel has had time to bury them."""
    end_s = time.monotonic() + GONE_WITHIN_S
    while True:
        left = [
            p
            for p in Path("/proc").glob("[0-9]*")
            if out in _text(p / "cmdline") and int(p.name) != os.getpid()
        ]
        if not left or time.monotonic() > end_s:
            return len(left)
        select.select([], [], [], 0.2)


def _text(path: Path) -> str:
    try:
        return path.read_text(errors="replace")
    except OSError:
        return ""


def _phase_at(out: Path, moment_s: float) -> str:
    events = [json.loads(line) for line in _text(out / "events.jsonl").splitlines()]
    told = [e["text"] for e in events if e["kind"] == "phase" and e["time_s"] <= moment_s]
    return told[-1] if told else "connect"


def _unreadable(out: Path) -> list[str]:
    """Files that cannot be read, and logs that end more than LOST_S before the others."""
    bad = []
    ends_s: dict[str, float] = {}
    for path in sorted(out.iterdir()):
        try:
            if path.suffix == ".jsonl":
                [json.loads(line) for line in path.read_text().splitlines()]
            elif path.suffix == ".json":
                json.loads(path.read_text())
            elif path.suffix == ".tlog":
                ends_s[path.name] = [t for t, _ in read_tlog(path)][-1] / 1e6
            elif path.suffix == ".rrd":
                subprocess.run(
                    [sys.executable, "-m", "rerun_cli", "rrd", "stats", str(path)],
                    check=True,
                    capture_output=True,
                )
        except (ValueError, IndexError, HilError, subprocess.CalledProcessError):
            bad.append(path.name)
    steps = [r.epoch_us / 1e6 for r in read_journal(out) if isinstance(r, Inputs)]
    bad += [name for name, end_s in ends_s.items() if steps and steps[-1] - end_s > 2 * LOST_S]
    return bad


def table(results: list[Result]) -> str:
    lines = [
        "| killed | times | as it must be | right to the end | orphans | unreadable files |",
        "|---|---|---|---|---|---|",
    ]
    for victim in PATTERNS:
        mine = [r for r in results if r.victim == victim]
        if mine:
            lines.append(
                f"| {victim} | {len(mine)} | {sum(r.good for r in mine)} "
                f"| {sum(r.met for r in mine)} | {sum(r.orphans for r in mine)} "
                f"| {sum(len(r.unreadable) for r in mine)} |"
            )
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=20, help="of each victim")
    parser.add_argument("--victims", nargs="+", choices=PATTERNS, default=list(PATTERNS))
    parser.add_argument("--scenario", default="rescue")
    parser.add_argument("--speed", default="1")
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / "kills.jsonl")
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    trees = [json.loads(line) for line in _text(options.out).splitlines()]
    results = [Result(**{**t, "unreadable": tuple(t["unreadable"])}) for t in trees]
    done = {(r.victim, r.number) for r in results}
    with options.out.open("a", encoding="utf-8") as file:
        for victim in options.victims:
            for number in range(options.kills):
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
