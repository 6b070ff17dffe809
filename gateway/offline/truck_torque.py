"""Torque of the truck of a run, from what the gateway saw (pure).

    T_w' = (J_g + J_d) theta_d'' + T_f(theta_m' / xi) + xi T_meas           (thesis, eq 4.9)

It is the torque at the drum that the regulator computes, with all of the friction. The sensors are
read with a configuration that may know more of the bench than that of the run. Hence the states are
those of the recording: a replay under another configuration would end where the recorded bench does
not follow its setpoint.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from gateway.configuration.config import Config
from gateway.cycle import samples
from gateway.cycle.cycle import Observation
from gateway.cycle.samples import Samples
from gateway.cycle.supervisor import State
from gateway.physics.virtual_truck import VirtualTruck, truck_torque
from gateway.physics.window import Window
from register_maps.register_map import RegisterMap
from register_maps.signals import PlcState


def truck_torques(
    seen: Iterable[Observation], states: Iterable[int], config: Config, register_map: RegisterMap
) -> Iterator[tuple[Window, float]]:
    """Windows of a run in road load, each with the truck's mean torque on the drum [N m].

    states : of the supervisor in each tick of the run
    """
    params = replace(VirtualTruck.of(config), under_compensation=0.0, under_compensation_slow=0.0)
    read = Samples()
    for observation, state in zip(seen, states, strict=True):
        read = samples.take(read, observation.measurement, observation.fault, observation.now)
        read = samples.with_window(config, register_map, read)
        window, newest = read.window, read.newest
        if state != State.RUN or window is None or newest is None:
            continue
        if newest.plc_state is PlcState.ROAD_LOAD:
            yield window, truck_torque(params, window)
