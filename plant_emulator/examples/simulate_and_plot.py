"""Simulate the bench with and without an effect, and plot the difference.

    python simulate_and_plot.py

The effect is a lag of the torque sensor. Writes simulate_and_plot.png and lagging.csv.
"""

import matplotlib.pyplot as plt
import numpy as np

import plant_emulator as pe

nominal = pe.simulate("program1")
lagging = pe.simulate("program1", effects={"torque_sensor_lag": {"time_constant": 0.1}}, seed=1)
pe.write_log(lagging, "lagging.csv")
print(lagging)

figure, (speed, torque, gap) = plt.subplots(3, sharex=True, layout="constrained")
speed.plot(nominal.time, nominal["motor_speed"])
speed.set_ylabel("motor speed [rad/s]")
for log, label in ((lagging, "with the lag and noise"), (nominal, "nominal")):
    torque.plot(log.time, log["shaft_torque"], label=label)
torque.set_ylabel("shaft torque [N m]")
torque.legend()
residual = lagging["shaft_torque"] - nominal["shaft_torque"]
gap.plot(nominal.time, residual)
gap.set(xlabel="time [s]", ylabel="difference [N m]")
figure.savefig("simulate_and_plot.png")
print(f"rms difference of the shaft torque: {np.sqrt(np.mean(residual**2)):.2f} N m")
