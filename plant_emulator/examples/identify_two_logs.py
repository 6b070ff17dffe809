"""Identify the bench from two logs, predict a third one, and save the parameters.

    python identify_two_logs.py

The logs are simulated with a drum that is 5 % heavier than nominal. For your bench, put the paths
of its logs into `logs`. Writes identified.toml and identify_two_logs.png.
"""

import plant_emulator as pe

nominal = pe.load_parameters("thesis_table_3_1")
inertia = nominal.value("drum_inertia")
heavy = nominal.with_values({"drum_inertia": 1.05 * inertia})
logs = [pe.simulate(f"program{k}", parameters=heavy, seed=k) for k in (1, 2, 3)]

found = pe.identify(logs[:2], hold_out=logs[2:])
print(found)
for parameter in found.parameters:
    change = 100.0 * (parameter.value / parameter.nominal - 1.0)
    error = 100.0 * parameter.standard_error / parameter.nominal
    print(f"{parameter.name}: {change:+.2f} +- {error:.2f} %")

pe.save_parameters(found.parameter_set, "identified.toml")
found.plot("identify_two_logs.png")
after = pe.validate(logs, parameters="identified.toml")
print(repr(pe.validate(logs)), repr(after), sep="\n")
