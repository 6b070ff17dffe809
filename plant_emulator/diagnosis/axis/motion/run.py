"""The smoothed motion of a run, along which the laws of friction are evaluated.

The acceleration comes from the relations (`relations`), exactly. A law needs position and velocity
only, for which a smooth curve is enough. The force already tells how the axis accelerates, so the
curve is drawn through what the force leaves of the position: a force that changes within few
samples is not smoothed away.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.diagnosis.axis.motion.kernel import Kernel, stride_of
from plant_emulator.diagnosis.axis.motion.spline import smooth
from plant_emulator.diagnosis.axis.settings import SETTINGS
from plant_emulator.errors import LogError
from plant_emulator.signals.noise import noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from plant_emulator.signals.axis_log import AxisLog
    from plant_emulator.signals.log import Array

# Nothing is said of an axis from fewer samples.
FEWEST = 100
# Times that the motion is drawn, each time with the force of the model before.
PASSES = 2
STRIDES = (1, 2, 4, 8, 16)
# Errors of the velocity within which its sign is not known (95 %).
UNCERTAIN = 2.0


@dataclass(frozen=True, kw_only=True)
class Base:
    """The nominal parameters: inertia, viscous and Coulomb friction, and offset."""

    inertia: float
    viscous: float
    coulomb: float
    offset: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Motion:
    """The motion of a run at the nodes of its kernel [SI], shape (nodes,) each.

    direction : sign of the velocity, between -1 and 1 near standstill; see `with_width`
    slope : of the smoothed force [N/s or N m/s]
    slow : whether the sign of the velocity is uncertain; deviation : of the velocity's error
    """

    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    direction: Array
    slope: Array
    slow: NDArray[np.bool_]
    deviation: float
    load: Array | None = None
    temperature: Array | None = None

    def friction(self, base: Base) -> Array:
        """Nominal friction at the nodes."""
        return np.asarray(base.viscous * self.velocity + base.coulomb * self.direction)


@dataclass(frozen=True, kw_only=True)
class Run:
    """A log ready for the regression.

    force : spline through the samples; net : less the load; motion : at the kernel's nodes
    measured : position, or velocity of a log without a position
    position_noise, force_noise : standard deviations of a sample
    """

    log: AxisLog
    kernel: Kernel
    motion: Motion
    force: Any
    net: Any
    measured: Array
    position_noise: float
    force_noise: float

    @property
    def period(self) -> float:
        """Usual time between two samples [s]."""
        return float(np.median(np.diff(self.log.time)))


def prepare(log: AxisLog) -> Run:
    """Prepare a run; raises LogError where it is too short, or does not move."""
    from scipy.interpolate import make_interp_spline

    if len(log.time) < FEWEST:
        raise LogError(f"{log.source}: {len(log.time)} samples; {FEWEST} or more are needed")
    time = log.time - log.time[0]
    of_velocity = log.velocity is not None
    measured = log.position if log.velocity is None else log.velocity
    what = "velocity" if of_velocity else "position"
    for name, values in ((what, measured), ("force", log.force)):
        if np.ptp(values) <= 0.0:
            raise LogError(f"{log.source}: {name} does not move; a run that moves is needed")
    drive = make_interp_spline(time, log.force, k=5)
    net = log.force if log.load is None else log.force - log.load
    force = make_interp_spline(time, net, k=5)
    nodes = Kernel(time, of_velocity, 1).nodes
    drawn = _curve(time, measured, nodes, np.zeros(len(nodes)), of_velocity=of_velocity)
    for _ in range(PASSES):
        # The motion's noise only lowers an inertia.
        rough = [_rough(Kernel(time, of_velocity, m), drawn, measured, force) for m in STRIDES]
        base = max(rough, key=lambda one: one.inertia)
        allowed = noise(net) / max(base.inertia, 1e-300)
        wanted = stride_of(
            time,
            measured,
            of_velocity=of_velocity,
            noise=drawn.noise,
            allowed=allowed,
            share=SETTINGS.worth,
        )
        friction = base.viscous * drawn.velocity + base.coulomb * np.sign(drawn.velocity)
        driven = (force(nodes) - friction - base.offset) / (base.inertia or 1.0)
        found = _curve(time, measured, nodes, driven, of_velocity=of_velocity)
        drawn = min(drawn, found, key=lambda one: one.noise)
    deviation = max(drawn.uncertainty, 1e-9 * float(np.abs(drawn.velocity).max()))
    at_nodes = [
        None if c is None else np.interp(nodes, time, c) for c in (log.load, log.temperature)
    ]
    return Run(
        log=log,
        kernel=Kernel(time, of_velocity, wanted),
        motion=Motion(
            time=nodes,
            position=drawn.position,
            velocity=drawn.velocity,
            acceleration=drawn.acceleration,
            direction=np.tanh(drawn.velocity / deviation),
            slope=smooth(time, log.force).curve.derivative(1)(nodes),
            slow=np.abs(drawn.velocity) < UNCERTAIN * deviation,
            deviation=deviation,
            load=at_nodes[0],
            temperature=at_nodes[1],
        ),
        force=drive,
        net=force,
        measured=measured,
        position_noise=drawn.noise,
        force_noise=noise(net),
    )


@dataclass(frozen=True, kw_only=True)
class _Curve:
    """Motion at the nodes; uncertainty : of the velocity; noise : of a measured sample."""

    position: Array
    velocity: Array
    acceleration: Array
    uncertainty: float
    noise: float


def _curve(
    time: Array, measured: Array, nodes: Array, driven: Array, *, of_velocity: bool
) -> _Curve:
    """Motion through measured samples; driven : acceleration at the nodes that is known."""
    from scipy.interpolate import make_interp_spline

    known = make_interp_spline(nodes, driven, k=3)
    once, twice = known.antiderivative(1), known.antiderivative(2)
    if of_velocity:
        left = smooth(time, measured - once(time))
        velocity = left.curve(nodes) + once(nodes)
        position = left.curve.antiderivative(1)(nodes) + twice(nodes)
        acceleration = left.curve.derivative(1)(nodes) + driven
        return _Curve(
            position=position,
            velocity=velocity,
            acceleration=acceleration,
            uncertainty=left.deviation(0),
            noise=left.noise,
        )
    left = smooth(time, measured - twice(time))
    return _Curve(
        position=left.curve(nodes) + twice(nodes),
        velocity=left.curve.derivative(1)(nodes) + once(nodes),
        acceleration=left.curve.derivative(2)(nodes) + driven,
        uncertainty=left.deviation(1),
        noise=left.noise,
    )


def _rough(kernel: Kernel, motion: _Curve, measured: Array, force: Any) -> Base:
    """Nominal parameters from relations without weights, good enough to start."""
    v = motion.velocity
    laws = [kernel.average(law) for law in (v, np.sign(v), np.ones(len(v)))]
    columns = np.stack([kernel.acceleration(measured), *laws], axis=1)
    found = np.linalg.lstsq(columns, averaged_force(kernel, force), rcond=None)[0]
    inertia, viscous, coulomb, offset = map(float, found)
    return Base(inertia=inertia, viscous=viscous, coulomb=coulomb, offset=offset)


def averaged_force(kernel: Kernel, force: Any) -> Array:
    """Exact average of a spline of the force, shape (rows,) [N or N m].

    The kernel is a difference of the spline's integral.
    """
    order = 1 if kernel.of_velocity else 2
    return kernel.acceleration(force.antiderivative(order)(kernel.time))


def with_width(run: Run, width: float) -> Run:
    """The run with a Coulomb friction that changes its sign over a speed: F_c tanh(q' / width).

    The width is a nominal parameter: no friction jumps.
    """
    motion = run.motion
    return replace(run, motion=replace(motion, direction=np.tanh(motion.velocity / width)))
