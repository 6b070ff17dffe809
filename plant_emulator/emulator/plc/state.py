"""The PLC's state machine as a table. Any pair of state and event outside it changes nothing."""

from enum import Enum

from register_maps.signals import PlcState


class Event(Enum):
    """Events that may change the state, by falling priority: only the first one acts."""

    TRIPPED = "interlock open or overspeed"
    RESET = "fault reset, or remote switch moved, after the cause is gone"
    STARTED = "first scan done"
    STOP = "not enabled, not remote, or watchdog"
    STOPPED = "the bench stands"
    START_SPEED = "enable edge in mode speed"
    START_ROAD_LOAD = "enable edge in mode road-load"
    TO_SPEED = "mode speed"
    TO_ROAD_LOAD = "mode road-load"


TRANSITIONS: dict[tuple[PlcState, Event], PlcState] = {
    **{(state, Event.TRIPPED): PlcState.FAULT for state in PlcState},
    (PlcState.FAULT, Event.RESET): PlcState.READY,
    (PlcState.INIT, Event.STARTED): PlcState.READY,
    (PlcState.SPEED, Event.STOP): PlcState.RAMP_DOWN,
    (PlcState.ROAD_LOAD, Event.STOP): PlcState.RAMP_DOWN,
    (PlcState.RAMP_DOWN, Event.STOPPED): PlcState.READY,
    (PlcState.READY, Event.START_SPEED): PlcState.SPEED,
    (PlcState.READY, Event.START_ROAD_LOAD): PlcState.ROAD_LOAD,
    (PlcState.ROAD_LOAD, Event.TO_SPEED): PlcState.SPEED,
    (PlcState.SPEED, Event.TO_ROAD_LOAD): PlcState.ROAD_LOAD,
}
RUNNING = (PlcState.SPEED, PlcState.ROAD_LOAD)
