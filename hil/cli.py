"""The `hil` command. Heavy imports wait until a command needs them."""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from hil.errors import HilError
from hil.options import Parser, count, minutes, port, speed, times
from hil.scenario import Scenario, load_scenario

EXIT_BROKEN_PIPE = 128 + 13  # as a process that SIGPIPE ended
EXIT_INTERRUPTED = 128 + 2  # as one that SIGINT ended


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; errors meant for people are one line on stderr and an exit code."""
    try:
        options = _parser().parse_args(argv)
        code = options.command(options)
    except HilError as error:
        print(f"hil: {error}", file=sys.stderr)
        code = error.exit_code
    except KeyboardInterrupt:
        print("hil: interrupted", file=sys.stderr)
        code = EXIT_INTERRUPTED
    except BrokenPipeError:  # as in `hil schema | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = EXIT_BROKEN_PIPE
    assert isinstance(code, int)
    return code


def _world(options: argparse.Namespace) -> int:
    from hil.world.process import WorldOptions, run_world

    return run_world(
        _seeded_scenario(options),
        WorldOptions(
            speed=options.speed,
            physics_port=options.physics_port,
            host=options.host,
            truth=options.truth,
            leash=options.leash,
        ),
    )


def _run(options: argparse.Namespace) -> int:
    from hil.bench.check import refuse_hopeless
    from hil.bench.run import RunOptions, run

    scenario = _seeded_scenario(options)
    refuse_hopeless(options.scenario, scenario)
    return run(
        scenario,
        RunOptions(
            out=options.out,
            speed=options.speed,
            in_memory=options.in_memory,
            viewer=options.viewer,
            serve=options.serve,
            signing_key=options.signing_key,
            restart_station=options.restart_station,
        ),
    )


def _campaign(options: argparse.Namespace) -> int:
    from hil.bench.campaign.command import CampaignOptions, run_campaign

    return run_campaign(
        options.campaign, CampaignOptions(options.out, options.jobs, options.backend)
    )


def _view(options: argparse.Namespace) -> int:
    from hil.bench.viewers import view

    return view(options.run, options.web)


def _shot(options: argparse.Namespace) -> int:
    from hil.bench.viewers import shoot

    shoot(options.run, options.at, options.out, options.view)
    return 0


def _replay(options: argparse.Namespace) -> int:
    from hil.bench.replaying import replay_run

    return replay_run(options.logs, options.view)


def _report(options: argparse.Namespace) -> int:
    from hil.bench.report.write import write_report

    print(write_report(options.run, options.out))
    return 0


def _reproduce(options: argparse.Namespace) -> int:
    import logging

    from base_station.planning.laboratory.jobs import STUDIES
    from base_station.planning.laboratory.reproduce import reproduce
    from hil.bench.folders import blind_view

    logging.basicConfig(stream=sys.stderr, level=logging.INFO, format="%(message)s")
    studies = tuple(study for study in STUDIES if study in (options.studies or STUDIES))
    base = blind_view(load_scenario(options.scenario))
    print(
        reproduce(
            base,
            options.out,
            studies,
            options.trainings,
            options.restarts,
            options.minutes,
            tuple(options.only),
        )
    )
    return 0


def _check(options: argparse.Namespace) -> int:
    from hil.bench.check import describe, refuse_hopeless

    scenario = load_scenario(options.scenario, options.set)
    print(describe(scenario))
    refuse_hopeless(options.scenario, scenario)
    return 0


def _identify(options: argparse.Namespace) -> int:
    from base_station.identify.process import identify

    print(identify(options.fleet, options.out))
    return 0


def _station_view(options: argparse.Namespace) -> int:
    from hil.bench.folders import blind_view

    print(blind_view(load_scenario(options.scenario, options.set)).model_dump_json(indent=2))
    return 0


def _schema(_options: argparse.Namespace) -> int:
    print(json.dumps(Scenario.model_json_schema(), indent=2))
    return 0


def _seeded_scenario(options: argparse.Namespace) -> Scenario:
    seed = [] if options.seed is None else [f"seed={options.seed}"]
    return load_scenario(options.scenario, [*options.set, *seed])


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="hil", description="A testbed in which a fleet finds out for itself what is broken."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    scenario = Parser(add_help=False)
    scenario.add_argument("scenario", type=Path, metavar="SCENARIO", help="a YAML file")
    scenario.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY.PATH=VALUE",
        help="override one value of the scenario; may be given more than once",
    )
    timed = Parser(add_help=False)
    timed.add_argument("--seed", type=int, help="instead of the scenario's")
    timed.add_argument(
        "--speed",
        type=speed,
        default=1.0,
        metavar="X",
        help="times real time; 0 is as fast as possible",
    )

    world = commands.add_parser("world", parents=[scenario, timed], help="simulate the world")
    world.add_argument("--physics-port", type=port, metavar="P", help="of the first vehicle")
    world.add_argument("--host", help="address to listen on")
    world.add_argument("--truth", metavar="FILE", help="where to write the truth; - is stdout")
    world.add_argument(
        "--leash",
        action="store_true",
        help="never step beyond the last `until SECONDS` read from stdin",
    )
    world.set_defaults(command=_world)

    run = commands.add_parser("run", parents=[scenario, timed], help="run everything, and score")
    run.add_argument("--out", type=Path, metavar="DIR", help="default runs/SCENARIO-TIMESTAMP")
    run.add_argument(
        "--in-memory", action="store_true", help="one process, in lockstep, deterministic"
    )
    run.add_argument(
        "--viewer",
        action=argparse.BooleanOptionalAction,
        default=False,
        help="open the Rerun viewer and stream to it",
    )
    run.add_argument("--serve", action="store_true", help="offer a web viewer on this machine")
    run.add_argument(
        "--signing-key", type=Path, metavar="FILE", help="sign MAVLink with the pass phrase in it"
    )
    run.add_argument(
        "--restart-station",
        action="store_true",
        help="a station that was killed is started again, and goes on by its journal",
    )
    run.set_defaults(command=_run)

    campaign = commands.add_parser("campaign", help="many runs in memory: a table and a report")
    campaign.add_argument("campaign", type=Path, metavar="CAMPAIGN", help="a YAML file")
    campaign.add_argument("--jobs", type=count, metavar="N", help="at a time; default all cores")
    campaign.add_argument(
        "--backend", choices=("local", "ray"), default="local", help="where: here, or a Ray cluster"
    )
    campaign.add_argument(
        "--out", type=Path, metavar="DIR", help="default runs/campaign-NAME; goes on where it ended"
    )
    campaign.set_defaults(command=_campaign)

    recorded = Parser(add_help=False)
    recorded.add_argument("run", type=Path, metavar="RUN", help="a run's folder, or an .rrd file")

    view = commands.add_parser("view", parents=[recorded], help="open a run in the Rerun viewer")
    view.add_argument("--web", action="store_true", help="in a browser")
    view.set_defaults(command=_view)

    shot = commands.add_parser(
        "shot", parents=[recorded], help="a picture of a run, as a viewer shows it"
    )
    shot.add_argument("--at", type=float, required=True, metavar="T", help="simulation time (s)")
    shot.add_argument("--view", metavar="NAME", help="a tab, or a view by its title's beginning")
    shot.add_argument("-o", "--out", type=Path, required=True, metavar="PNG")
    shot.set_defaults(command=_shot)

    report = commands.add_parser("report", help="a page on a run, to open in a browser")
    report.add_argument("run", type=Path, metavar="RUN", help="a run's folder")
    report.add_argument("-o", "--out", type=Path, metavar="HTML", help="default RUN/report.html")
    report.set_defaults(command=_report)

    replay = commands.add_parser("replay", help="diagnose recorded telemetry again")
    replay.add_argument(
        "logs", type=Path, nargs="+", metavar="RUN", help="a run's folder, or .tlog files"
    )
    replay.add_argument("--view", type=Path, metavar="FILE", help="as `hil station-view` prints it")
    replay.set_defaults(command=_replay)

    reproduce = commands.add_parser(
        "reproduce",
        help="the paper's results and more, as tables and figures; goes on where it was",
    )
    reproduce.add_argument(
        "scenario", type=Path, nargs="?", default=Path("scenarios/rescue.yaml"), metavar="SCENARIO"
    )
    reproduce.add_argument("--trainings", type=count, default=50, metavar="N", help="of each")
    reproduce.add_argument(
        "--studies",
        nargs="+",
        choices=["paper", "layouts", "objective", "ladder", "ablation", "cost"],
        help="default: all of them",
    )
    reproduce.add_argument(
        "--only",
        nargs="+",
        default=["*"],
        metavar="PATTERN",
        help="jobs whose key STUDY/CASE/PLANNER/PRESET/NUMBER/CHANGE matches, with * for anything",
    )
    reproduce.add_argument(
        "--restarts", type=times, default=20, metavar="N", help="when a target is missed"
    )
    reproduce.add_argument(
        "--minutes", type=minutes, metavar="M", help="stop after so long; the same command goes on"
    )
    reproduce.add_argument("--out", type=Path, default=Path("reproduction"), metavar="DIR")
    reproduce.set_defaults(command=_reproduce)

    check = commands.add_parser("check", parents=[scenario], help="validate a scenario")
    check.set_defaults(command=_check)

    identify = commands.add_parser(
        "identify", help="drive each vehicle of a fleet gently, and fit its twin to its answers"
    )
    identify.add_argument("fleet", type=Path, metavar="FLEET", help="a fleet file")
    identify.add_argument(
        "-o", "--out", type=Path, metavar="FILE", help="default FLEET.identified.yaml"
    )
    identify.set_defaults(command=_identify)

    told = commands.add_parser(
        "station-view", parents=[scenario], help="print what the base station is told"
    )
    told.set_defaults(command=_station_view)

    schema = commands.add_parser("schema", help="print the JSON schema of scenarios")
    schema.set_defaults(command=_schema)
    return parser


if __name__ == "__main__":
    sys.exit(main())
