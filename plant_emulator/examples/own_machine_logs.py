"""Write three runs of an arm on a geared motor, as a logger would: own names, degrees, current.

    python own_machine_logs.py

The files are the example of diagnosis/OWN_MACHINE.md. The arm has weight.
"""

from math import cos, pi, radians, tanh
from pathlib import Path

import numpy as np

INERTIA, VISCOUS, COULOMB = 0.012, 0.08, 0.25  # kg m2, N m s/rad, N m at the arm
WEIGHT, TORQUE_CONSTANT, RATIO = 0.9, 0.040, 20.0  # N m, N m/A, motor turns per arm turn
STEP, STEPS, SAMPLES = 0.00025, 20, 4000  # s, steps from sample to sample, samples of a run


def main() -> None:
    """Simulate and write the runs."""
    sizes, rates = np.array([0.6, 0.5, 0.3]), 2.0 * pi * np.array([0.25, 0.9, 2.3])
    for run in (1, 2, 3):
        noise = np.random.default_rng(run)
        angle, speed, rows = radians(-60.0), 0.0, []
        phases = noise.uniform(0.0, 2.0 * pi, 3)
        for k in range(SAMPLES * STEPS):
            time = k * STEP
            drive = float(sizes @ np.sin(rates * time + phases)) + WEIGHT * cos(angle)
            if k % STEPS == 0:
                current = drive / (TORQUE_CONSTANT * RATIO) + noise.normal(0.0, 0.01)
                rows.append((1e3 * time, angle * 180.0 / pi, current))
            friction = VISCOUS * speed + COULOMB * tanh(speed / 0.005)
            speed += (drive - friction - WEIGHT * cos(angle)) / INERTIA * STEP
            angle += speed * STEP
        text = "".join(f"{time:.1f},{enc:.2f},{iq:.4f}\n" for time, enc, iq in rows)
        Path(f"run{run}.csv").write_text(f"# arm, run {run}\nt_ms,enc,iq\n{text}", "utf-8")
        print(f"run{run}.csv: {len(rows)} samples")


if __name__ == "__main__":
    main()
