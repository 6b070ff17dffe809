"""Options of a demo, and the configuration of the gateway that follows from them."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Final

UNLOADED: Final = 3640.0
LOADS: Final = (0.0, 1600.0)


@dataclass(frozen=True, kw_only=True)
class DemoOptions:
    """Options of a demo.

    loads : of the trucks [kg]; period : of the loop [s]; duration : of the cycle [s]
    repeats : runs of each truck, each with what the learned regulator remembers of those before
    learned : file of that memory; None: no repeat seen
    the others : as the options of the command
    """

    loads: tuple[float, ...] = LOADS
    driver: str = "none"
    regulator: str = "compensated"
    torque: str = "integrated"
    period: float = 0.01
    map: str = "bench_int16"
    bench_parameters: str = "thesis_table_3_1"
    friction: str | None = None
    repeats: int = 1
    learned: Path | None = None
    duration: float = 30.0
    fast: bool = False
    out: Path = Path("demo_output")

    def config_text(
        self, *, load_mass: float, rolling: tuple[float, float], address: tuple[str, int]
    ) -> str:
        """Configuration of the gateway for one run as TOML.

        load_mass : [kg]; rolling : C_rr [1] and C_rr,v [s] of the truck; address : of the PLC
        """
        files = {"friction": self.friction, "learned": self.learned}
        told = "".join(
            f"{key} = {json.dumps(str(Path(file).resolve()))}\n"
            for key, file in files.items()
            if file is not None
        )
        return (
            f'[plc]\nhost = "{address[0]}"\nport = {address[1]}\nmap = "{self.map}"\n\n'
            f"[loop]\nperiod_ms = {1e3 * self.period:g}\n\n"
            f"[truck]\nmass_kg = {UNLOADED!r}\nload_kg = {load_mass!r}\n"
            f"crr = {rolling[0]!r}\ncrr_v = {rolling[1]!r}\n\n"
            f'[regulator]\nname = "{self.regulator}"\ntorque = "{self.torque}"\n{told}\n'
            f"[recording]\ndir = {json.dumps(str(self.out.resolve()))}\n"
        )
