"""Friction of the bench as the regulator knows it: that of the gear by its table, and effects.

Default values of the table are those of the thesis (Table 3.1), identified with the gear's shell at
32 degC. The temperature coefficient is not in the thesis: friction falls with the viscosity of the
oil. The effects are those of the emulator's library that change the force on the truck; their
parameters have the names that they have there, in SI. Without values they do nothing.
"""

from dataclasses import asdict, dataclass, fields
from math import copysign, exp

from register_maps.units import ZERO_CELSIUS

FILM_SPEED = 0.02
"""[rad/s] Drum speed below which the bearings' torque is proportional to the speed."""


@dataclass(frozen=True, kw_only=True)
class OilTemperature:
    """The viscous friction follows the oil, which its own losses warm and the shell cools.

    viscosity_coefficient [1/K]; nominal_temperature : at which the table holds [K]
    heat_capacity [J/K]; shell_conductance [W/K]
    start_temperature, shell_temperature : of the identified runs at their start [K]. A log does not
        tell a colder oil from a thicker one, so that only their difference belongs to the law.
    """

    viscosity_coefficient: float = 0.0
    nominal_temperature: float = 313.15
    heat_capacity: float = 1e5
    shell_conductance: float = 100.0
    start_temperature: float = 305.15
    shell_temperature: float = 305.15


@dataclass(frozen=True, kw_only=True)
class LoadLoss:
    """Friction of the gear by the torque that it transmits.

    share : of this torque [1]; difference : between driving and driven side, relative [1]
    """

    share: float = 0.0
    difference: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Bearings:
    """Friction of the drum's bearings: coulomb [N m], viscous [N m s/rad], exponent [1]."""

    coulomb: float = 0.0
    viscous: float = 0.0
    exponent: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Stribeck:
    """Rise of the gear's friction towards standstill [N m], and the speed of its fall [rad/s]."""

    rise: float = 0.0
    speed: float = 0.1


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Parameters of the friction: of the table at the gear output, and of the effects.

    coulomb [N m], viscous [N m (s/rad)^exponent], exponent [1]
    temperature_coefficient : relative fall of the friction per kelvin of the shell [1/K]
    reference_temperature_celsius : shell temperature at which coulomb and viscous hold [degC]
    left_out : effects of the parameter set that the regulator cannot use
    """

    coulomb: float = 35.989
    viscous: float = 345.38
    exponent: float = 0.4418
    temperature_coefficient: float = 0.0
    reference_temperature_celsius: float = 32.0
    gear_oil_temperature: OilTemperature = OilTemperature()
    load_dependent_gear_loss: LoadLoss = LoadLoss()
    drum_bearing_friction: Bearings = Bearings()
    stribeck: Stribeck = Stribeck()
    left_out: tuple[str, ...] = ()

    @property
    def document(self) -> dict[str, object]:
        """Table of the friction as a configuration file has it, without effects that do nothing."""
        values = {
            one.name: getattr(self, one.name)
            for one in fields(self)
            if isinstance(one.default, float) or getattr(self, one.name) != one.default
        }
        told = {name: value for name, value in asdict(self).items() if name in values}
        return {k: list(v) if isinstance(v, tuple) else v for k, v in told.items()}

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that do something."""
        return tuple(name for name, value in self.document.items() if isinstance(value, dict))

    @property
    def breakaway(self) -> float:
        """Largest friction of a gear that sticks [N m]."""
        return self.coulomb + self.stribeck.rise


THESIS = Friction()


def friction_torque(
    omega: float, friction: Friction, shell: float | None = None, oil: float | None = None
) -> float:
    """Friction torque at the gear output that its speed causes [N m].

    T_f = (f_gc + f_g(T_oil) |omega|^delta_g) sgn(omega) exp(-a (T - T_0))  (thesis, eq 3.27; a = 0)
          + dT exp(-(omega / omega_s)^2) sgn(omega)
    f_g(T_oil) = f_g exp(-beta (T_oil - T_n))

    omega : speed of the gear output [rad/s]; the friction at rest is 0
    shell, oil : temperatures [K]; None: unknown, the one at which the table holds is assumed
    """
    if omega == 0.0:
        return 0.0
    f_gc, delta_g = friction.coulomb, friction.exponent
    size = f_gc + _viscous(friction, oil) * abs(omega) ** delta_g
    if shell is not None and friction.temperature_coefficient != 0.0:
        above = shell - ZERO_CELSIUS - friction.reference_temperature_celsius
        size *= exp(-friction.temperature_coefficient * above)
    if friction.stribeck.rise != 0.0:
        size += friction.stribeck.rise * exp(-((omega / friction.stribeck.speed) ** 2))
    return copysign(size, omega)


def _viscous(friction: Friction, oil: float | None) -> float:
    law = friction.gear_oil_temperature
    if oil is None or law.viscosity_coefficient == 0.0:
        return friction.viscous
    return friction.viscous * exp(-law.viscosity_coefficient * (oil - law.nominal_temperature))


def load_loss(torque: float, omega: float, friction: Friction) -> float:
    """Friction torque at the gear output that the load causes [N m].

    T = T_gd + a (1 + d) |T_gd| sgn(omega), solved for T_gd; 1 - d where the drum drives

    torque : T, that of the motor at the gear output less the friction by its speed [N m]
    omega : speed of the gear output [rad/s]
    """
    law = friction.load_dependent_gear_loss
    if omega == 0.0 or law.share == 0.0:
        return 0.0
    forward = copysign(torque, torque * omega)
    side = 1.0 if forward > 0.0 else -1.0
    transmitted = forward / (1.0 + side * law.share * (1.0 + side * law.difference))
    return copysign(forward - transmitted, omega)


def bearing_torque(omega: float, friction: Friction) -> float:
    """Friction torque of the drum's bearings at a drum speed [rad/s], in N m.

    T_dw = T_c sgn(omega) + b omega (|omega| + FILM_SPEED)^(n - 1)
    """
    law = friction.drum_bearing_friction
    film: float = law.viscous * omega * (abs(omega) + FILM_SPEED) ** (law.exponent - 1.0)
    return law.coulomb * min(max(omega / FILM_SPEED, -1.0), 1.0) + film


def idle_torque(
    omega: float, friction: Friction, shell: float | None = None, oil: float | None = None
) -> float:
    """Torque at the gear output that turns the bench steadily without a truck [N m].

    Arguments as those of `friction_torque`.
    """
    bearing, law = bearing_torque(omega, friction), friction.load_dependent_gear_loss
    loaded = bearing * (1.0 + law.share * (1.0 + law.difference))
    return friction_torque(omega, friction, shell, oil) + loaded


def oil_temperature(
    before: float | None, omega: float, shell: float | None, duration: float, friction: Friction
) -> float | None:
    """Temperature of the oil after a time at one speed [K]; None: the shell's is unknown.

    C dT/dt = T_f omega - G (T - T_shell), one implicit step

    before : at the start of the time [K]; None: unknown, the bench starts as the identified runs
    omega : speed of the gear output [rad/s]; duration [s]
    """
    law = friction.gear_oil_temperature
    if shell is None:
        return before
    if before is None:
        return shell + law.start_temperature - law.shell_temperature
    heat = friction_torque(omega, friction, shell, before) * omega
    a = duration / law.heat_capacity
    return (before + a * (heat + law.shell_conductance * shell)) / (1.0 + a * law.shell_conductance)
