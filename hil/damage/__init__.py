"""Faults in effect, and what they do to motor outputs and GPS: for vehicles, and for the world."""

from hil.damage.gps import GpsMeans
from hil.damage.injection import inject, struck
from hil.damage.motors import MotorOutputs
from hil.damage.state import Damage, EscDamage, Gaps, GpsDamage, ImuDamage, MotorDamage

__all__ = [
    "Damage",
    "EscDamage",
    "Gaps",
    "GpsDamage",
    "GpsMeans",
    "ImuDamage",
    "MotorDamage",
    "MotorOutputs",
    "inject",
    "struck",
]
