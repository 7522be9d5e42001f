"""The parameter protocol: list, read by name or index, set. Integers are C-cast."""

from hil.mavlink import (
    Message,
    ParamError,
    ParamFailed,
    ParamRequestList,
    ParamRequestRead,
    ParamSet,
    ParamValue,
)
from sim_vehicles.parameters import Parameter, Parameters
from sim_vehicles.services.service import Handlers, Replies, Request


class ParameterService:
    """Serves one table; what is not in it does not exist on this port."""

    def __init__(self, table: Parameters) -> None:
        self._table = table

    def handlers(self) -> Handlers:
        return {
            ParamRequestList: self._list,
            ParamRequestRead: self._read,
            ParamSet: self._set,
        }

    def _list(self, _request: Request) -> Replies:
        return [self._value(name) for name in self._table.names]

    def _read(self, request: Request) -> Replies:
        value: ParamRequestRead = request.value
        name = self._table.name_at(value.index) if value.index >= 0 else value.name
        if name is None or name not in self._table:
            return [_failed(request, value.name, value.index, ParamError.DOES_NOT_EXIST)]
        return [self._value(name)]

    def _set(self, request: Request) -> Replies:
        value: ParamSet = request.value
        if value.name not in self._table:
            return [_failed(request, value.name, -1, ParamError.DOES_NOT_EXIST)]
        error = self._table.set(value.name, value.value)
        current = self._value(value.name)
        if error is None:
            return [current]
        return [_failed(request, value.name, current.index, error), current]

    def _value(self, name: str) -> ParamValue:
        parameter: Parameter = self._table.parameter(name)
        index, count = self._table.names.index(name), len(self._table.names)
        return ParamValue(name, self._table[name], index, count, parameter.param_type)


def _failed(request: Request, name: str, index: int, error: ParamError) -> Message:
    return ParamFailed(request.sysid, request.compid, name, index, error)
