"""A run as processes: world, vehicles and station over UDP, held together by this one."""

import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from hil.bench.firmware import is_foreign, start_of
from hil.bench.folders import SCENARIO_FILE, VIEW_FILE, Folders
from hil.bench.injector import Breaker
from hil.bench.leash import Leash
from hil.bench.lines import STATION, parse_station_line
from hil.bench.onsets import Onsets
from hil.bench.processes import Child, Children, Command
from hil.bench.runlog import RunLog
from hil.bench.watchdog import Watchdog
from hil.link import UdpLink
from hil.mavlink import Signing, read_key, ticks
from hil.scenario import PORTS_PER_VEHICLE, Scenario
from hil.world.orders import Until, order_line
from hil.world.truth import TruthRecord, parse_line

READY_WITHIN_S = 180.0  # the first start ever compiles kernels
FAREWELL_S = 3.0
POLL_S = 0.02
WORLD = "world"


@dataclass(frozen=True)
class Programs:
    """How the parts of a run are started; tests put others in their place."""

    world: tuple[str, ...] = (sys.executable, "-m", "hil.cli", "world")
    vehicle: tuple[str, ...] = (sys.executable, "-m", "sim_vehicles.process")
    station: tuple[str, ...] = (sys.executable, "-m", "base_station.process")


@dataclass(frozen=True)
class UdpOptions:
    speed: float = 1.0
    viewer: str | None = None  # host:port
    signing_key: Path | None = None
    restart_station: bool = False  # when a signal has ended it
    programs: Programs = field(default_factory=Programs)


def run_over_udp(
    scenario: Scenario, folders: Folders, options: UdpOptions, log: RunLog, onsets: Onsets
) -> None:
    """Until the station has concluded. Raises ProcessDiedError, and InputError for a refused fault.

    `scenario` has its ports pinned, and its files are in `folders`.
    """
    _Run(scenario, folders, options, log, onsets).go()


def _signing(path: Path | None) -> Callable[[], Signing] | None:
    if path is None:
        return None
    key = read_key(path)
    return lambda: Signing(key, 0, lambda: ticks(time.time()))


class _Run:
    def __init__(
        self,
        scenario: Scenario,
        folders: Folders,
        options: UdpOptions,
        log: RunLog,
        onsets: Onsets,
    ) -> None:
        self._scenario, self._folders, self._options = scenario, folders, options
        self._log, self._onsets = log, onsets
        self._world: Child  # from `_start` on
        self._breaker = Breaker(
            scenario,
            lambda fault: log.struck(fault, log.world_s),
            lambda fault: log.mended(fault, log.world_s),
            lambda order: self._world.send(order_line(order)),
            _signing(options.signing_key),
        )
        self._injector_links: dict[int, UdpLink] = {}
        self._leash = Leash(options.speed)

    def go(self) -> None:
        with ExitStack() as stack:
            children = stack.enter_context(Children(self._heard))
            self._open_injector_links(stack)
            self._world, station = self._start(children)
            children.wait_ready(READY_WITHIN_S)
            self._break_at_zero(children)
            self._drive(children, station)
            children.wait_end(station, FAREWELL_S)

    def _start(self, children: Children) -> tuple[Child, Child]:
        folder, programs = self._folders.run, self._options.programs
        scenario_file = str(folder / SCENARIO_FILE)
        speed = ("--speed", str(self._options.speed))
        world = children.start(
            Command(
                WORLD,
                (*programs.world, scenario_file, *speed, "--truth", "-", "--leash"),
                folder / "world.log",
                takes_lines=True,
            )
        )
        key = self._options.signing_key
        signing = () if key is None else ("--signing-key", str(key.absolute()))
        for v in self._scenario.fleet:
            foreign = start_of(v.autopilot)
            if foreign is not None:
                children.start(foreign(self._scenario, v, folder))
                continue
            argv = (*programs.vehicle, scenario_file, "--sysid", str(v.sysid), *signing)
            children.start(Command(f"sim-vehicle {v.name}", argv, folder / f"{v.name}.log"))
        viewer = ("--viewer", self._options.viewer) if self._options.viewer else ()
        how = ("--machine", "--run-id", self._folders.run_id, *viewer, *signing)
        again = (*programs.station, "--resume", ".", *how)
        station = children.start(
            Command(
                STATION,
                # relative paths: nothing in its arguments tells which scenario this is
                (*programs.station, VIEW_FILE, "--out", ".", *how),
                self._folders.station / "base-station.log",
                cwd=self._folders.station,
                again=again if self._options.restart_station else None,
            )
        )
        return world, station

    def _open_injector_links(self, stack: ExitStack) -> None:
        links = self._scenario.links
        assert links.injector_port_base is not None
        for i, v in enumerate(self._scenario.fleet):
            reach = UdpLink.bind if is_foreign(v) else UdpLink.connect  # a firmware calls us
            link = reach(links.host, links.injector_port_base + PORTS_PER_VEHICLE * i)
            stack.callback(link.close)
            self._injector_links[v.sysid] = link

    def _break_at_zero(self, children: Children) -> None:
        """The world holds t = 0 until these faults are in effect."""
        self._breaker.strike(self._onsets.at_start())
        while not self._breaker.done:
            self._inject()
            children.pump(POLL_S)

    def _drive(self, children: Children, station: Child) -> None:
        watchdog = Watchdog(self._options.speed, time.monotonic())
        while self._log.outcome is None:
            now_s = time.monotonic()
            if station.ready:
                longer = self._leash.lengthen(self._log.tick_s, self._log.learning, now_s)
            else:
                longer = self._leash.go_on(now_s)
                watchdog.rest(now_s)
            if longer:
                self._world.send(order_line(Until(self._leash.until_s)))
            children.pump(POLL_S)
            self._inject()
            watchdog.check(self._log.world_s, self._leash.until_s, self._log.tick_s, now_s)

    def _inject(self) -> None:
        now_s = time.monotonic()
        for sysid, link in self._injector_links.items():
            for datagram in self._breaker.step(now_s, sysid, link.receive()):
                link.send(datagram)

    def _heard(self, name: str, line: str) -> None:
        if name == STATION:
            self._heard_station(line)
        elif name == WORLD:
            told = parse_line(line)
            if isinstance(told, TruthRecord):
                self._log.truth(told)
                self._breaker.strike(self._onsets.due(told))
                self._breaker.mend(self._onsets.over(told))
            elif told is not None:
                self._log.contact(told)

    def _heard_station(self, text: str) -> None:
        line = parse_station_line(text)
        if line is not None:
            self._log.station_line(line)
