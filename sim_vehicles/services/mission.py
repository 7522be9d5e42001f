"""The mission protocol of a vehicle that stores none: empty lists, uploads refused."""

from hil.mavlink import (
    MissionAck,
    MissionClearAll,
    MissionCount,
    MissionRequestList,
    MissionResult,
)
from sim_vehicles.services.service import Handlers, Replies, Request


def handlers() -> Handlers:
    return {MissionRequestList: _list, MissionCount: _upload, MissionClearAll: _clear}


def _list(request: Request) -> Replies:
    return [MissionCount(request.sysid, request.compid, 0, request.value.mission_type)]


def _upload(request: Request) -> Replies:
    empty = request.value.count == 0
    return _ack(request, MissionResult.ACCEPTED if empty else MissionResult.UNSUPPORTED)


def _clear(request: Request) -> Replies:
    return _ack(request, MissionResult.ACCEPTED)


def _ack(request: Request, result: MissionResult) -> Replies:
    return [MissionAck(request.sysid, request.compid, result, request.value.mission_type)]
