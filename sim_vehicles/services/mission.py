"""The mission protocol: upload, download, clear, set current; for mission, fence and rally.

Item 0 of a mission is home: what a station uploads there is replaced by where home is.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from hil.frames import Origin
from hil.mavlink import (
    Command,
    GlobalFrame,
    HomePosition,
    Message,
    MissionAck,
    MissionClearAll,
    MissionCount,
    MissionItem,
    MissionRequest,
    MissionRequestInt,
    MissionRequestList,
    MissionResult,
    MissionSetCurrent,
    MissionType,
    Result,
    RoverMode,
    Severity,
    StatusText,
)
from sim_vehicles.autopilot import set_mode
from sim_vehicles.mission import refusal, tidied
from sim_vehicles.navigator import Navigator
from sim_vehicles.services.commands import DENIED, Executor, Order, Outcome
from sim_vehicles.services.mode import Change
from sim_vehicles.services.service import Handlers, Replies, Request

MAX_ITEMS = 724  # what ArduPilot offers on a common board
ASK_AGAIN_S = 1.0
GIVE_UP_S = 8.0


@dataclass(frozen=True, slots=True)
class Upload:
    """A list on its way in. `heard_s` is when it last moved on, `asked_s` the last request."""

    sysid: int
    compid: int
    kind: MissionType
    count: int
    heard_s: float
    asked_s: float
    items: tuple[MissionItem, ...] = ()

    def is_from(self, request: Request) -> bool:
        return (request.sysid, request.compid) == (self.sysid, self.compid)

    def ask(self) -> Message:
        return MissionRequestInt(self.sysid, self.compid, len(self.items), self.kind)

    def ack(self, result: MissionResult) -> Message:
        return MissionAck(self.sysid, self.compid, result, self.kind)


class MissionService:
    """One upload at a time; downloads need no state."""

    def __init__(
        self,
        navigator: Navigator,
        origin: Origin,
        home: Callable[[], HomePosition | None],
        apply: Callable[[Change], Result],
    ) -> None:
        self._navigator, self._origin = navigator, origin
        self._home, self._apply = home, apply
        self._upload: Upload | None = None

    def handlers(self) -> Handlers:
        return {
            MissionRequestList: self._list,
            MissionRequestInt: self._send_item,
            MissionRequest: self._send_item,
            MissionCount: self._begin,
            MissionItem: self._take,
            MissionAck: self._ended,
            MissionClearAll: self._clear,
            MissionSetCurrent: self._set_current,
        }

    def executors(self) -> Mapping[int, Executor]:
        return {
            Command.DO_SET_MISSION_CURRENT: self._do_set_current,
            Command.MISSION_START: self._start,
        }

    def step(self, now_s: float) -> list[Message]:
        """Ask again for an item that does not come; give up after 8 s."""
        upload = self._upload
        if upload is None or now_s - upload.asked_s < ASK_AGAIN_S:
            return []
        if now_s - upload.heard_s >= GIVE_UP_S:
            self._upload = None
            text = StatusText(Severity.WARNING, "Mission upload timeout")
            return [upload.ack(MissionResult.OPERATION_CANCELLED), text]
        self._upload = replace(upload, asked_s=now_s)
        return [upload.ask()]

    def _list(self, request: Request) -> Replies:
        kind = _kind(request)
        if kind is None:
            return _answer(request, MissionResult.UNSUPPORTED)
        count = len(self._navigator.lists[kind])
        return [MissionCount(request.sysid, request.compid, count, kind)]

    def _send_item(self, request: Request) -> Replies:
        kind, seq = _kind(request), request.value.seq
        if kind is None:
            return _answer(request, MissionResult.UNSUPPORTED)
        items = self._navigator.lists[kind]
        if seq >= len(items):
            return _answer(request, MissionResult.INVALID_SEQUENCE)
        item = self._home_item(items[0]) if kind is MissionType.MISSION and seq == 0 else items[seq]
        is_current = kind is MissionType.MISSION and seq == self._navigator.current().seq
        sysid, compid = request.sysid, request.compid
        return [replace(item, target_sysid=sysid, target_compid=compid, current=is_current)]

    def _home_item(self, uploaded: MissionItem) -> MissionItem:
        home = self._home()
        if home is None:
            return uploaded
        return replace(
            uploaded,
            frame=GlobalFrame.GLOBAL,
            command=Command.NAV_WAYPOINT,
            params=(0.0,) * 4,
            x=round(home.lat_deg * 1e7),
            y=round(home.lon_deg * 1e7),
            z=home.alt_m,
        )

    def _begin(self, request: Request) -> Replies:
        """MISSION_COUNT. Who has begun may begin again; others wait until that is over."""
        kind, count = _kind(request), request.value.count
        if kind is None:
            return _answer(request, MissionResult.UNSUPPORTED)
        if self._upload is not None and not self._upload.is_from(request):
            return _answer(request, MissionResult.DENIED)
        if count > MAX_ITEMS:
            return _answer(request, MissionResult.NO_SPACE)
        now_s = request.now_s
        upload = Upload(request.sysid, request.compid, kind, count, now_s, now_s)
        return self._go_on(upload)

    def _take(self, request: Request) -> Replies:
        item: MissionItem = request.value
        upload = self._upload
        if upload is None or not upload.is_from(request) or upload.kind != item.mission_type:
            return _answer(request, MissionResult.DENIED)
        if item.seq != len(upload.items):
            return []  # a repeat, or one that came too early; the one asked for is still due
        item = tidied(item)
        result = refusal(item, self._origin, self._navigator.flies)
        if result is not None:
            self._upload = None
            return [upload.ack(result)]
        now_s, items = request.now_s, (*upload.items, item)
        return self._go_on(replace(upload, items=items, heard_s=now_s, asked_s=now_s))

    def _go_on(self, upload: Upload) -> Replies:
        """Ask for the next item, or take the whole list over."""
        if len(upload.items) < upload.count:
            self._upload = upload
            return [upload.ask()]
        self._upload = None
        return [upload.ack(self._navigator.store(upload.kind, upload.items))]

    def _ended(self, request: Request) -> Replies:
        """An ACK of the sender ends an upload (it has given up) or a download."""
        if self._upload is not None and self._upload.is_from(request):
            self._upload = None
        return []

    def _clear(self, request: Request) -> Replies:
        asked = request.value.mission_type
        kind = _kind(request)
        if kind is None and asked != MissionType.ALL:
            return _answer(request, MissionResult.UNSUPPORTED)
        for chosen in self._navigator.lists if kind is None else (kind,):
            self._navigator.store(chosen, ())
        return _answer(request, MissionResult.ACCEPTED)

    def _set_current(self, request: Request) -> Replies:
        if not self._navigator.set_current(request.value.seq):
            return [StatusText(Severity.WARNING, f"No mission item {request.value.seq}")]
        return [self._navigator.current()]

    def _do_set_current(self, order: Order) -> Outcome:
        seq = order.integer(1)
        if seq is None or not self._navigator.set_current(seq):
            return DENIED
        return Outcome(Result.ACCEPTED, (self._navigator.current(),))

    def _start(self, _order: Order) -> Outcome:
        return Outcome(self._apply(lambda state, ready: set_mode(state, RoverMode.AUTO, ready)))


def _kind(request: Request) -> MissionType | None:
    """Which single list is meant."""
    number = request.value.mission_type
    known = number in (MissionType.MISSION, MissionType.FENCE, MissionType.RALLY)
    return MissionType(number) if known else None


def _answer(request: Request, result: MissionResult) -> Replies:
    return [MissionAck(request.sysid, request.compid, result, request.value.mission_type)]
