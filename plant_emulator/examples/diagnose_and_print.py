"""Diagnose the gap between the bench and its model, and print what causes it.

    python diagnose_and_print.py [LOG...]

Without a log the script simulates a bench whose torque sensor is off by 0.5 N m. It then tests two
effects only, which takes some seconds; the whole library takes some minutes.
"""

import os
import sys

import plant_emulator as pe

TESTED = {"torque_sensor_offset", "torque_sensor_gain"}


def main(logs: list[str]) -> None:
    """Diagnose these logs, or a simulated one."""
    if logs:
        found = pe.diagnose(logs, workers=os.cpu_count() or 1)
    else:
        hidden = {"torque_sensor_offset": {"offset": 0.5}}
        fitted = pe.simulate("program1", effects=hidden, seed=1)
        predicted = pe.simulate("program2", effects=hidden, seed=2)
        left_out = [name for name in pe.effects.names() if name not in TESTED]
        found = pe.diagnose([fitted], hold_out=[predicted], without=left_out)
    print(found)
    for effect in found.answer.ranking:
        if effect.accepted:
            for size in effect.parameters:
                print(f"{effect.effect}: {size.name} = {size.value:.3f} {size.unit}")
    found.write_report("diagnosis.html")


if __name__ == "__main__":  # the worker processes import this script
    main(sys.argv[1:])
