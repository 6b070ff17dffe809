"""One fit done twice: by our identification, and by lmfit on scipy's LSODA."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmark import peers
from plant_emulator import logs, parameter_sets
from plant_emulator.estimation.free_parameters import free_parameters
from plant_emulator.identification.identify import identify
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import recording
from plant_emulator.simulation import programs

if TYPE_CHECKING:
    from collections.abc import Mapping

    from plant_emulator.identification.identify import Identification
    from plant_emulator.signals.log import Array

LOG = Path(__file__).resolve().parents[2] / "tests/data/bench_practice/practice_008"
PROGRAM = "program1"
# At this tolerance the solver's error is far below the noise. The step of lmfit's differences has
# to be larger than that error. lmfit's epsfcn is the square of the step.
TOLERANCE, DIFFERENCE = 1e-6, 1e-8
# Bounds of the search over the nominal values, as in our identification.
FACTOR = 5.0


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """An optimum: parameter values by name [SI], and the sum of squared whitened residuals."""

    values: Mapping[str, float]
    cost: float


class Fits:
    """One log of the independent bench; both fits start from the nominal parameters."""

    def __init__(self, log: Path = LOG / f"{PROGRAM}.csv.gz") -> None:
        self.nominal = parameter_sets.load()
        self.recording = recording(logs.read(log))
        self.free = free_parameters(self.nominal)
        program = programs.PROGRAMS[PROGRAM]
        assert isinstance(program, programs.SpeedProgram)
        last = program.corners[-1][1]
        self.corners = ((0.0, program.corners[0][1]), *program.corners, (program.duration, last))

    def ours(self) -> Identification:
        """Fit as a user does."""
        return identify([self.recording], self.nominal)

    def residual(self, values: Mapping[str, float], gap_position: float) -> Array:
        """Whitened residual of the log, simulated by LSODA, shape (channels, n)."""
        p = {**self.nominal.values(), **values}
        solver = peers.Lsoda(self.recording.log.time, peers.plain(self.corners, p), p)
        found = solver(TOLERANCE, gap_position * p["backlash_half_gap"])
        names = [peers.CHANNELS.index(name) for name in self.recording.channels]
        measured = np.stack([self.recording.log[name] for name in self.recording.channels])
        return np.asarray((measured - found.T[names]) / self.recording.noise[:, None])

    def lmfit(self, start: Mapping[str, float] | None = None, gap: float = 0.0) -> Fitted:
        """Fit by lmfit's leastsq (MINPACK): log parameters and the backlash gap position."""
        import lmfit

        unknowns = lmfit.Parameters()
        for name in self.free:
            value, nominal = (start or {}).get(name), self.nominal.value(name)
            unknowns.add(
                name,
                value=np.log(value or nominal),
                min=np.log(nominal / FACTOR),
                max=np.log(nominal * FACTOR),
            )
        unknowns.add(GAP_POSITION, value=gap, min=-1.0, max=1.0)

        def residual(trial: Any) -> Array:
            values = {name: float(np.exp(trial[name].value)) for name in self.free}
            return self.residual(values, float(trial[GAP_POSITION].value)).ravel()

        found = lmfit.minimize(residual, unknowns, method="leastsq", epsfcn=DIFFERENCE)
        values = {name: float(np.exp(found.params[name].value)) for name in self.free}
        return Fitted(values=values, cost=float(found.chisqr))
