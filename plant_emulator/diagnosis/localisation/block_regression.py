"""All that measured signals tell of the blocks, as one linear model with a group of laws a block.

Rows: the whitened relations of every run, then the drum's speed of every run over its noise.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation import block_basis, drum_basis, parameter_sensitivities
from plant_emulator.diagnosis.localisation.ard_evidence import (
    Evidence,
    Linear,
    Products,
    variance_gain,
)
from plant_emulator.diagnosis.localisation.drum_subsystem import (
    TORQUE,
    DrumSide,
    expected,
    is_torque,
)
from plant_emulator.diagnosis.localisation.parity_covariance import relations
from plant_emulator.diagnosis.localisation.parity_relations import (
    ARMATURE,
    DRIVE,
    GEAR,
    Relations,
    base_speed,
    measured,
    middle,
    values,
)
from plant_emulator.diagnosis.localisation.stacked_rows import Table
from plant_emulator.errors import UnsettledError
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import voltage_errors
from plant_emulator.simulation.simulate import simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

# Blocks that only the drum's speed can show.
BESIDE = ("drum", "speed_sensor", "backlash_shaft")
# Variance that the draws of the smoothing's noise do not span, over what they do, next to impacts.
UNSPANNED = 3.0
# Deviations of a sum of squares that are no chance.
SURPRISING_DEVIATIONS = 3.0


class Site:
    """The blocks of a bench with the measured signals at their borders."""

    def __init__(
        self, recordings: Sequence[Recording], parameters: ParameterSet, null: FitResult
    ) -> None:
        self.recordings, self.parameters, self.null = recordings, parameters, null
        self.fitted = {**parameters.values(), **null.values}
        self.base_speed = base_speed(self.fitted)
        self.stds = parameter_sensitivities.priors(parameters, list(null.values))
        p = parameter_sensitivities.assumed(parameters, null.values, self.stds)
        self.signals = [measured(r, p) for r in recordings]
        if "dead_time" in self.stds:
            p["dead_time"] = parameter_sensitivities.dead_time(
                self.signals, p, parameters["dead_time"]
            )
        self.prior = parameter_sensitivities.prior(parameters, p, self.stds)
        self.values = p
        top = max(float(np.max(np.abs(m.speed))) for m in self.signals)
        unknown = [drum_basis.torque(m, p["gear_ratio"], top) for m in self.signals]
        self.side = DrumSide(recordings, self.signals, parameters, p, unknown)
        self.products = Products()
        self.plain = self.side.null(null.values, [s[GAP_POSITION] for s in null.states])
        self.relations = [self._relations(k) for k in range(len(recordings))]
        self.blocks = tuple(
            name
            for name in (*block_basis.BLOCKS, *BESIDE)
            if name != "wheel_contact" or any(m.truck for m in self.signals)
        )

    def _relations(self, run: int) -> Relations:
        return relations(self.signals[run], self.values, self._simulated(run))

    def _simulated(self, run: int) -> tuple[Array, NDArray[np.bool_]] | None:
        """What the fit without effects leaves of the relations, their error between samples.

        And where its drive is limited.
        """
        recording, gap = self.recordings[run], self.null.states[run][GAP_POSITION]
        try:
            log = simulate(recording.inputs, self.fitted, gap_position=gap)
        except UnsettledError:
            return None
        m = measured(replace(recording, log=log), self.fitted)
        left, limited = values(replace(m, speed=m.motor_speed), self.fitted)
        left[DRIVE, limited] = 0.0
        return left, limited

    @cached_property
    def inside(self) -> list[block_basis.Inside]:
        """Quantities inside the blocks of every run."""
        found = self.plain.parameters()
        return [
            block_basis.inside(
                m,
                self.side.simulated(k, {**found, **self.plain.states(k)}),
                self.values,
            )
            for k, m in enumerate(self.signals)
        ]

    @cached_property
    def spread(self) -> list[Array]:
        """Noise of the smoothed motor speed in the drum's speed, see `DrumSide.spread`."""
        found = self.plain.parameters()
        return [
            self.side.spread(k, {**found, **self.plain.states(k)}) for k in range(len(self.signals))
        ]

    @cached_property
    def weights(self) -> list[Array]:
        """Of the drum's speed; few draws span little of the noise of a flight through the gap."""
        from scipy.ndimage import maximum_filter1d

        return [
            1.0 / np.sqrt(1.0 + UNSPANNED * maximum_filter1d((s**2).sum(-1), 11))
            for s in self.spread
        ]

    @cached_property
    def table(self) -> Table:
        """Where columns stand in the rows of all runs."""
        return Table(self.relations, self.weights)

    @cached_property
    def drifting(self) -> list[Array]:
        """Columns of the parameters that drift in the relations of every run."""
        return [
            parameter_sensitivities.columns(m, q, self.values, self.stds)
            for m, q in zip(self.signals, self.inside, strict=True)
        ]

    @cached_property
    def nuisance(self) -> tuple[Array, ...]:
        """Columns of drift in the relations, of the smoothing's noise in the drum's speed, and of
        what the sensor of a logged voltage may be off by.
        """
        none = [None] * len(self.signals)
        found = self.table.shared(self.drifting, none), self.table.own_speed(self.spread)
        if all(m.voltage is None for m in self.signals):
            return found
        p, known = self.values, [float(m.voltage is not None) for m in self.signals]
        told = [p["armature_resistance"] * q.current + q.flux * q.speed for q in self.inside]
        sensor = [
            block_basis.acting({ARMATURE: there}, voltage_errors(voltage))
            for there, voltage in zip(known, told, strict=True)
        ]
        return (*found, self.table.own_relations(sensor))

    def linear(self, fitted: Estimate) -> Linear:
        """Data and drift, the drum's speed linearise at a fit of the drum's side."""
        runs = range(len(self.signals))
        away = fitted.z - expected(fitted)
        speed = [fitted.residuals[k][0] - fitted.jacobians[k][0] @ away for k in runs]
        relation = [
            (r.value - (d @ self.prior)[: len(r.value)])[..., None]
            for r, d in zip(self.relations, self.drifting, strict=True)
        ]
        y = self.table.shared(relation, [s[:, None] for s in speed])
        scale = np.array([min(u.scaled_std, 1.0) for u in fitted.unknowns])
        bent = [(fitted.jacobians[k][0] * scale)[:, ~is_torque(fitted)] for k in runs]
        own = self.table.shared([None] * len(self.signals), bent)
        return Linear(y[:, 0], [*self.nuisance, own], self.products)

    @cached_property
    def data(self) -> Linear:
        """Linearised without an unknown torque on the drum."""
        return self.linear(self.plain)

    @cached_property
    def groups(self) -> dict[str, list[Array]]:
        """Columns of the laws of every block."""
        top = block_basis.largest(self.inside)
        own = {name: self._block(law, top) for name, law in block_basis.BLOCKS.items()}
        return own | {"speed_sensor": self._speed_sensor(), "backlash_shaft": self._backlash()}

    def _block(
        self,
        block: Callable[[block_basis.Inside, Mapping[str, float]], list[block_basis.Law]],
        top: Mapping[str, float],
    ) -> list[Array]:
        none = [None] * len(self.signals)
        runs = [block(q, top) for q in self.inside]
        return [
            self.table.own_relations([law.rows for law in group])
            if group[0].own
            else self.table.shared([law.rows for law in group], none)
            for group in zip(*runs, strict=True)
            if any(
                law.rows[: len(r.value)].any() for law, r in zip(group, self.relations, strict=True)
            )
        ]

    def _speed_sensor(self) -> list[Array]:
        """Errors of the measuring wheel."""
        none = [None] * len(self.signals)
        laws_of = [drum_basis.speed_sensor(m, self.values["gear_ratio"]) for m in self.signals]
        *shared, own = zip(*laws_of, strict=True)
        return [*(self.table.shared(none, group) for group in shared), self.table.own_speed(own)]

    def _backlash(self) -> list[Array]:
        """Gap and damping that differ from one contact to the next."""
        laws_of = [
            drum_basis.backlash(m, self.plain.jacobians[k][0]) for k, m in enumerate(self.signals)
        ]
        return [self.table.own_speed(group) for group in zip(*laws_of, strict=True)]

    def _drum(self, fitted: Estimate) -> list[Array]:
        """An unknown torque on the drum, in the gear's relation and in the drum's speed."""
        speed = [-fitted.jacobians[k][0][:, is_torque(fitted)] for k in range(len(self.signals))]
        return [self.table.shared(self._on_gear(), speed) * TORQUE]

    @cached_property
    def with_torque(self) -> list[tuple[Linear, list[Array]]]:
        """Data and laws of the drum, linearise at no torque, and at the best if that is far."""
        start = {**self.plain.parameters(), **self.side.torques(0.0)}
        gaps = [self.plain.states(k)[GAP_POSITION] for k in range(len(self.signals))]
        near = self.side.at(start, gaps)
        fits = [near]
        count = sum(len(m.time) for m in self.signals)
        if self.data.left(slice(-count, None)) > count + SURPRISING_DEVIATIONS * np.sqrt(
            2.0 * count
        ):
            fits.append(self.side.far(self.plain.parameters(), gaps, self._told_torque()))
        return [(self.linear(f), self._drum(f)) for f in fits]

    def _on_gear(self) -> list[Array]:
        """The unknown torque on the drum in the gear's relation."""
        xi = self.values["gear_ratio"]
        return [block_basis.acting({GEAR: 1.0 / xi}, middle(law)) for law in self.side.laws]

    def _told_torque(self) -> Array:
        """Sizes of the torque on the drum that the gear's relation tells of, all else silent."""
        group = TORQUE * self.table.shared(self._on_gear(), [None] * len(self.signals))
        return np.asarray(TORQUE * self.data.evidence([group]).mean[-group.shape[1] :])

    def evidence(self, blocks: Sequence[str]) -> Evidence:
        """The evidence with unknown laws in these blocks."""
        groups = [g for name in blocks if name != "drum" for g in self.groups[name]]
        if "drum" not in blocks:
            return self.data.evidence(groups)
        found = [data.evidence([*groups, *drum]) for data, drum in self.with_torque]
        return max(found, key=lambda e: e.log)

    def log_evidence(self, blocks: Sequence[str]) -> float:
        """Log probability of all measurements with unknown laws in these blocks.

        The drive's dead time may also vary from scan to scan.
        """
        found = self.evidence(blocks)
        if "drive" not in blocks:
            return found.log
        ends = np.cumsum([r.value.size for r in self.relations])
        own = [
            part[DRIVE :: len(r.value)]
            for part, r in zip(np.split(found.left, ends)[:-1], self.relations, strict=True)
        ]
        slope = np.concatenate([q.demand_rate for q in self.inside])
        return found.log + variance_gain(np.concatenate(own), slope)
