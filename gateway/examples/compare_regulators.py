"""What would the regulators thesis and compensated have asked of the motor in this run?

    python compare_regulators.py program6.csv.gz regulators.png

Prints how closely each setpoint follows the logged reference, and draws all three.
"""

import sys

from matplotlib.figure import Figure

import gateway
from register_maps.units import RPM


def main(log: str, picture: str) -> None:
    """Replay the log through both regulators, print their agreement and draw their setpoints."""
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    axes = figure.subplots()
    axes.set(xlabel="time [s]", ylabel="motor setpoint [rpm]")
    for name in ("thesis", "compensated"):
        result = gateway.replay(log, values={"regulator.name": name})
        print(f"{name:12}", result.to_json()["velocity"])
        axes.plot(result.comparison.time, result.comparison.found / RPM, label=name)
    axes.plot(
        result.comparison.time, result.comparison.wanted / RPM, ":", label="reference in the log"
    )
    axes.legend(frameon=False)
    figure.savefig(picture)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        print("usage: python compare_regulators.py LOG PICTURE", file=sys.stderr)
        sys.exit(2)
    main(*sys.argv[1:])
