"""A planner that dies at work as often as a file says, then answers: stub_planner.py FILE VIEW."""

import os
import signal
import sys
from pathlib import Path

from base_station.planning.requests import PlanReady, decode, encode


def main(deaths_left: Path) -> None:
    print("ready", flush=True)
    for line in sys.stdin:
        left = int(deaths_left.read_text())
        if left:
            deaths_left.write_text(str(left - 1))
            os.kill(os.getpid(), signal.SIGKILL)
        request = decode(line)
        print(encode(PlanReady(request.number, "alpha", ())), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
