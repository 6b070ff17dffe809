"""Torque of the truck of a run, from what the gateway saw (pure).

    T_w' = (J_g + J_d) theta_d'' + T_f(theta_m' / xi) + xi T_meas           (thesis, eq 4.9)

It is the torque at the drum that the regulator computes, with all of the friction.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from gateway.configuration.config import Config
from gateway.cycle.cycle import Observation, initial, step
from gateway.cycle.supervisor import State
from gateway.physics.virtual_truck import VirtualTruck, truck_torque
from gateway.physics.window import Window
from register_maps.register_map import RegisterMap
from register_maps.signals import PlcState


def truck_torques(
    seen: Iterable[Observation], config: Config, register_map: RegisterMap
) -> Iterator[tuple[Window, float]]:
    """Windows of a run in road load, each with the truck's mean torque on the drum [N m]."""
    params = replace(VirtualTruck.of(config), under_compensation=0.0, under_compensation_slow=0.0)
    state = initial(config, register_map)
    for observation in seen:
        state, output = step(config, register_map, state, observation)
        window, newest = state.samples.window, state.samples.newest
        if output.state is not State.RUN or window is None or newest is None:
            continue
        if newest.plc_state is PlcState.ROAD_LOAD:
            yield window, truck_torque(params, window)
