"""`hil identify`: how a vehicle really answers, found by driving it gently."""

from base_station.identify.excitation import Excitation, Tried
from base_station.identify.fit import AxisFit, fit_axis
from base_station.identify.noise import NoiseFit, RestNoise
from base_station.identify.responses import (
    FirstOrder,
    Integrating,
    NoseFirst,
    Response,
    response_of,
)

__all__ = [
    "AxisFit",
    "Excitation",
    "FirstOrder",
    "Integrating",
    "NoiseFit",
    "NoseFirst",
    "Response",
    "RestNoise",
    "Tried",
    "fit_axis",
    "response_of",
]
