"""What a regulator is told and what it answers."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Window:
    """What happened since the last sample that the regulator saw.

    duration : by the PLC's clock [s]
    shaft_torque : of the window or its end, by `regulator.torque` [N m, the sensor's sign]
    motor_speed, drum_speed : at its end [rad/s]
    drum_speed_change : over exactly this window [rad/s]
    shell_temperature : of the gear [K], None: not known
    """

    duration: float
    shaft_torque: float
    motor_speed: float
    drum_speed: float
    drum_speed_change: float
    shell_temperature: float | None = None


@dataclass(frozen=True, kw_only=True)
class Demand:
    """Motor speed that is wanted [rad/s], and its slope until the next sample [rad/s^2]."""

    speed: float
    rate: float = 0.0
