"""How would the gateway have driven the drum if the truck had been heavier?

    python replay_with_another_mass.py program6.csv.gz 0 800 1600

The log or recording goes through the gateway's regulator once for each load [kg]. The torque of the
truck is the logged one, so that a heavier virtual truck gains less speed from it.
"""

import sys

import numpy as np

import gateway
from register_maps.units import RPM


def main(log: str, *loads: str) -> None:
    """Print the fastest setpoint of each load, and how far it is from that of the first load."""
    first = None
    for load in loads or ("0", "1600"):
        result = gateway.replay(log, values={"truck.load_kg": float(load)})
        setpoint = result.comparison.found
        first = setpoint if first is None else first
        apart = np.nanmax(np.abs(setpoint - first))
        print(result)
        print(f"  up to {np.nanmax(setpoint) / RPM:.0f} rpm, at most {apart / RPM:.0f} rpm apart")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        print("usage: python replay_with_another_mass.py LOG [LOAD...]", file=sys.stderr)
        sys.exit(2)
    main(*sys.argv[1:])
