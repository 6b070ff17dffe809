"""What the gateway sees of the bench between two samples."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Window:
    """The time between two samples that the regulator sees.

    duration : by the PLC's clock [s]
    shaft_torque : over the window or at its end, see `regulator.torque` [N m, sign of the sensor]
    motor_speed, drum_speed : at the end of the window [rad/s]
    drum_speed_change : over exactly this window [rad/s]
    shell_temperature, oil_temperature : of the gear [K], None: unknown
    """

    duration: float
    shaft_torque: float
    motor_speed: float
    drum_speed: float
    drum_speed_change: float
    shell_temperature: float | None = None
    oil_temperature: float | None = None
