"""The daemon: reads a roller bench over Modbus TCP and sets its speed until it feels like road.

    import gateway

    result = gateway.replay("program6.csv.gz", values={"truck.load_kg": 1600})
    print(result.summary(), result.to_json())

A name is imported when it is first used, so that `import gateway` loads nothing heavy.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gateway.config_file import load as load_config
    from gateway.configuration.config import Config
    from gateway.errors import ConfigError, GatewayError, RecordingError
    from gateway.recordings.log import LogError
    from gateway.review.finding import Review
    from gateway.workflows.check import check
    from gateway.workflows.replay import Replay, replay
    from register_maps.register_map import MapError

__all__ = [
    "Config",
    "ConfigError",
    "GatewayError",
    "LogError",
    "MapError",
    "RecordingError",
    "Replay",
    "Review",
    "check",
    "load_config",
    "replay",
]

_PLACES = {
    "Config": ("gateway.configuration.config", "Config"),
    "ConfigError": ("gateway.errors", "ConfigError"),
    "GatewayError": ("gateway.errors", "GatewayError"),
    "LogError": ("gateway.recordings.log", "LogError"),
    "MapError": ("register_maps.register_map", "MapError"),
    "RecordingError": ("gateway.errors", "RecordingError"),
    "Replay": ("gateway.workflows.replay", "Replay"),
    "Review": ("gateway.review.finding", "Review"),
    "check": ("gateway.workflows.check", "check"),
    "load_config": ("gateway.config_file", "load"),
    "replay": ("gateway.workflows.replay", "replay"),
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, attribute = _PLACES[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return __all__
