"""What the learned regulator remembers after a recorded run (pure)."""

from collections.abc import Iterable

from gateway.configuration.config import Config
from gateway.configuration.memory import Memory
from gateway.cycle.cycle import Observation, initial, step
from gateway.errors import ConfigError
from gateway.regulators import learned
from register_maps.register_map import RegisterMap


def memory_after(config: Config, register_map: RegisterMap, seen: Iterable[Observation]) -> Memory:
    """Memory after the last repeat of the cycle; without one, the memory of the configuration.

    Raises ConfigError for another regulator.
    """
    if config.regulator.name != "learned" or config.program is not None:
        raise ConfigError(
            "this regulator learns nothing",
            place="regulator.name",
            value=config.regulator.name,
            expected="learned, in a run with a truck",
        )
    memory, state = config.regulator.learned, initial(config, register_map)
    for observation in seen:
        state, _ = step(config, register_map, state, observation)
        if (
            isinstance(state.regulator, learned.State)
            and state.regulator.memory != config.regulator.learned
        ):
            memory = state.regulator.memory
    return memory
