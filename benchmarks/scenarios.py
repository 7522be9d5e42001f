"""Every shipped scenario for many seeds: does each meet its expectation?

    python benchmarks/scenarios.py [--seeds 10] [--udp] [--speed X] [--only rescue ...] [--out DIR]

Runs go one after the other through `hil run`, in memory unless --udp. Prints a table in Markdown;
exit code 1 when one run did not meet its expectation.
"""

import argparse
import json
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
SHIPPED = ("rescue", "stuck_gps", "healthy", "midway", "rescue_yaw")


@dataclass(frozen=True)
class Row:
    """One run."""

    scenario: str
    seed: int
    met: bool
    correct: bool
    unmet: tuple[str, ...]
    alpha_s: float
    beta_s: float
    beta_restarts: int
    sim_s: float
    wall_s: float


def main() -> None:
    options = _options()
    rows = []
    for name in options.only:
        for seed in range(options.first, options.first + options.seeds):
            row = _run(name, seed, options)
            rows.append(row)
            said = "met" if row.met else f"NOT MET {'; '.join(row.unmet)}"
            print(f"{name} {seed}: {said} ({row.wall_s:.0f} s)", file=sys.stderr, flush=True)
    print(_table(rows))
    sys.exit(0 if all(r.met for r in rows) else 1)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--udp", action="store_true", help="as processes instead of in memory")
    parser.add_argument("--speed", default="1", help="with --udp: times real time")
    parser.add_argument("--only", nargs="+", choices=SHIPPED, default=SHIPPED)
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / f"scenarios-{int(time.time())}")
    return parser.parse_args()


def _run(name: str, seed: int, options: argparse.Namespace) -> Row:
    out = options.out / f"{name}-{seed}"
    how = ["--speed", options.speed] if options.udp else ["--in-memory"]
    command = [sys.executable, "-m", "hil.cli", "run", str(ROOT / "scenarios" / f"{name}.yaml")]
    started_s = time.monotonic()
    done = subprocess.run(
        [*command, "--seed", str(seed), "--out", str(out), *how],
        capture_output=True,
        text=True,
        check=False,
    )
    wall_s = time.monotonic() - started_s
    result_file = out / "result.json"
    if not result_file.exists():
        return Row(name, seed, False, False, (done.stderr.strip()[-200:],), 0, 0, 0, 0, wall_s)
    result = json.loads(result_file.read_text())
    trainings = result["trainings"]
    return Row(
        scenario=name,
        seed=seed,
        met=done.returncode == 0 and result["expected_met"],
        correct=bool(result["correct"]),
        unmet=tuple(result["unmet"]),
        alpha_s=sum(t["wall_s"] for t in trainings if t["kind"] == "alpha"),
        beta_s=sum(t["wall_s"] for t in trainings if t["kind"] == "beta"),
        beta_restarts=sum(t["restarts"] for t in trainings if t["kind"] == "beta"),
        sim_s=sum(p["sim_s"] for p in result["phases"]),
        wall_s=wall_s,
    )


def _table(rows: list[Row]) -> str:
    lines = [
        "| scenario | expectation met | verdict right | learning alpha (s) | learning beta (s) "
        "| beta restarts | fleet time (s) | wall time (s) |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name in dict.fromkeys(r.scenario for r in rows):
        mine = [r for r in rows if r.scenario == name]
        lines.append(
            f"| `{name}` | {sum(r.met for r in mine)} of {len(mine)} "
            f"| {sum(r.correct for r in mine)} | {_spread([r.alpha_s for r in mine])} "
            f"| {_spread([r.beta_s for r in mine])} | {sum(r.beta_restarts for r in mine)} "
            f"| {_spread([r.sim_s for r in mine])} | {_spread([r.wall_s for r in mine])} |"
        )
    lines.append(f"\nMet: {sum(r.met for r in rows)} of {len(rows)}. Times: median (largest).")
    return "\n".join(lines)


def _spread(values: list[float]) -> str:
    return f"{statistics.median(values):.1f} ({max(values):.1f})"


if __name__ == "__main__":
    main()
