"""The simulation as a library call: a drive program or the inputs of a log in, a log out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from plant_emulator import effects as library
from plant_emulator import logs
from plant_emulator.errors import InputError
from plant_emulator.estimation.initial_states import fit_states, states_of, with_logged_values
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.model.stage import split_gap_position
from plant_emulator.parameter_sets import DEFAULT, with_effects
from plant_emulator.recordings.recording import recording
from plant_emulator.recordings.wheel_torque import with_estimated_torque
from plant_emulator.signals.log import Log, without_voltage
from plant_emulator.simulation import simulate as kernel_level
from plant_emulator.simulation.programs import PROGRAMS, SpeedProgram, TravelProgram, program
from plant_emulator.simulation.run_inputs import Hold, inputs_of
from plant_emulator.simulation.sensor_noise import add_noise
from plant_emulator.simulation.simulate import values_of
from plant_emulator.simulation.start_in_gap import fit_start
from plant_emulator.simulation.travel_program import simulate_travel
from plant_emulator.solver.kernel import kernel
from plant_emulator.workflows.arguments import (
    check_count,
    check_reference,
    check_signals,
    check_start,
)
from plant_emulator.workflows.next_program import read_drive_program

if TYPE_CHECKING:
    from plant_emulator.simulation.programs import Program

Effects = Mapping[str, Mapping[str, float]]
Start = Literal["fit", "middle"]


def simulate(
    source: str | Path | Log | Program,
    *,
    parameters: ParameterSet | str | Path = DEFAULT,
    effects: Effects | Sequence[str] = (),
    seed: int | None = None,
    reference: Hold | None = None,
    start: Start = "fit",
) -> Log:
    """Simulate a drive program, or the bench under the inputs of a log; all signals are SI.

    source : a drive program or its name ("program1"), a log, or the path of a file: of a log, or of
        a drive program that holds times and references alone. The inputs of a log are its speed
        reference and, if it has one, its wheel torque.
    parameters : a parameter set, the name of a shipped one, or the path of its file
    effects : effects beyond those of the set, by effect and parameter [SI], or as the texts
        "NAME[:PARAM=VALUE,...]" of the command line. A parameter without value takes its plausible
        size.
    seed : seed of the sensors' noise and quantisation; None: the log has neither
    reference : what holds between samples of the speed reference; None: "staircase" in a log with a
        wheel torque, else "linear"
    start : "fit" fits the position in the backlash gap at the start to a log, and with it the start
        states of the set's effects; "middle" starts in the middle of the gap, as a program does

    Returns a log with the inputs, `motor_speed` and `drum_speed` [rad/s], `armature_current` [A],
    `armature_voltage` [V], `shaft_torque` [N m] and `shell_temperature` [K], shape (samples,) each.
    Raises InputError for a source, a set or an effect that cannot be used, and UnsettledError where
    the equations cannot be solved.
    """
    check_reference(reference)
    check_start(start)
    if seed is not None:
        check_count("seed", seed, 0)
    bench = parameter_set(parameters)
    values = effect_values(effects)
    source = read_source(source)
    if isinstance(source, Log):
        log = simulate_log(source, bench, values, reference, start)
    elif isinstance(source, TravelProgram):
        log = simulate_travel(source, bench, values)
    else:
        run = inputs_of(source.inputs(), reference, bench.sensors)
        log = kernel_level.simulate(run, values_of(bench, values))
    return log if seed is None else add_noise(log, seed, bench.sensors)


def parameter_set(parameters: ParameterSet | str | Path) -> ParameterSet:
    """The parameter set itself, or the set of that name or file; ParameterError where none is."""
    if isinstance(parameters, ParameterSet):
        return parameters
    return with_effects.load(parameters)


def effect_values(effects: Effects | Sequence[str]) -> Effects:
    """Values of effects by effect and parameter [SI]; see `simulate` for what may be given.

    Raises InputError for anything else.
    """
    if isinstance(effects, Mapping):
        return library.complete(effects)
    texts = [effects] if isinstance(effects, str) else effects
    if not _are_texts(texts):
        raise InputError(f"effects={effects!r}; a mapping by effect, or texts, are expected")
    return library.parse(list(texts))


def _are_texts(given: object) -> bool:
    return isinstance(given, Sequence) and all(isinstance(one, str) for one in given)


def read_source(source: str | Path | Log | Program) -> Log | Program:
    """The log or the program that `source` is or names; InputError where there is none."""
    if isinstance(source, Log | SpeedProgram | TravelProgram):
        return source
    if not isinstance(source, str | Path):
        raise InputError(f"{source!r}: a log, a program, or the name of one is expected")
    name = str(source)
    if name not in PROGRAMS and Path(name).exists():
        return read_drive_program(name) or logs.read(name)
    return program(name)


def simulate_log(
    log: Log, parameters: ParameterSet, effects: Effects, reference: Hold | None, start: Start
) -> Log:
    """Simulate the bench under the inputs of a log.

    Start states of the set's own effects are fitted to the log, as its position in the gap is. An
    effect in `effects` keeps every value that is given.

    reference, start : see `simulate`
    Raises LogError for a log without a speed reference.
    """
    check_signals(log, ("speed_reference",))
    log = with_estimated_torque(log, parameters.values())
    values = values_of(parameters, effects)
    own = {name: table for name, table in parameters.effects.items() if name not in effects}
    library = kernel().effects if own else {}
    if start == "fit" and any(p.per_run for e in own for p in library[e].parameters.values()):
        measured = recording(without_voltage(log), reference, sensors=parameters.sensors)
        measured = with_logged_values(measured, own)
        states = fit_states(measured, values, states_of(own))
        values, gap = split_gap_position({**values, **measured.logged_values, **states})
        return kernel_level.simulate(measured.inputs, values, gap_position=gap)
    run = inputs_of(log, reference, parameters.sensors)
    gap = fit_start(log, run, values) if start == "fit" else 0.0
    return kernel_level.simulate(run, values, gap_position=gap)
