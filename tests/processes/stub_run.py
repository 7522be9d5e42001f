"""`hil run` with the stub in the station's place: stub_run.py WAY SCENARIO OUT."""

import sys
from pathlib import Path

from hil.bench.run import RunOptions, run
from hil.bench.udp import Programs
from hil.errors import HilError
from hil.scenario import load_scenario


def main(way: str, scenario: str, out: str) -> int:
    stub = str(Path(__file__).with_name("stub_station.py"))
    options = RunOptions(
        out=Path(out), speed=0.0, programs=Programs(station=(sys.executable, stub, way))
    )
    try:
        return run(load_scenario(Path(scenario)), options)
    except HilError as error:
        print(f"hil: {error}", file=sys.stderr)
        return error.exit_code


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
