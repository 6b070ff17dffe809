"""What runs and shows the gateway in a plant: the unit of systemd, the board of Grafana."""

import sys
from importlib import resources
from pathlib import Path
from typing import Final

from gateway.errors import GatewayError

NAME: Final = "gateway.service"
BOARD: Final = "grafana_board.json"
FOLDER: Final = Path("/etc/systemd/system")


def unit(config: Path) -> str:
    """Text of the unit that runs this installation with a configuration."""
    template = resources.files(__package__).joinpath(NAME).read_text("utf-8")
    words = (sys.executable, "-m", "gateway", "run", "-c", str(config.resolve()))
    command = " ".join((*map(_quote, words), "--log-format", "json"))
    return template.replace("{command}", command)


def board() -> str:
    """Text of a board for Grafana over the metrics of the gateway."""
    return resources.files(__package__).joinpath(BOARD).read_text("utf-8")


def install(config: Path, folder: Path) -> Path:
    """Write the unit into a folder; its path. Raises GatewayError."""
    path = folder / NAME
    try:
        path.write_text(unit(config), encoding="utf-8")
    except OSError as error:
        raise GatewayError(
            f"{path}: {error.strerror}; expected a folder of units that can be written"
        ) from error
    return path


def _quote(word: str) -> str:
    """Word of a command line as systemd reads it: no specifiers, no variables."""
    if word.replace("/", "").replace("-", "").replace(".", "").replace("_", "").isalnum():
        return word
    escaped = word.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + escaped.replace("%", "%%").replace("$", "$$") + '"'
