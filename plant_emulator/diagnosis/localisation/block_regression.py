"""The block regression: all that the measured signals say of the blocks, as one linear model.

The rows are the whitened parity relations of all runs, then the drum speeds of all runs over their
noise. The nuisance columns are the deviations of the parameters, the noise of the smoothed motor
speed in the drum speed, and the errors of a logged voltage. Each block adds columns of its unknown
laws. The marginal likelihood of the model says how much more probable the columns of a block make
all measurements.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from plant_emulator.diagnosis.localisation import block_basis, drum_basis, parameter_sensitivities
from plant_emulator.diagnosis.localisation.drum_subsystem import (
    TORQUE_STD,
    DrumSubsystem,
    is_torque_size,
    prior_means,
)
from plant_emulator.diagnosis.localisation.marginal_likelihood import (
    GroupRegression,
    LinearModel,
    variance_gain,
)
from plant_emulator.diagnosis.localisation.measured_signals import interval_means, measured_signals
from plant_emulator.diagnosis.localisation.parity_covariance import whitened_relations
from plant_emulator.diagnosis.localisation.parity_relations import (
    ARMATURE,
    DRIVE,
    GEAR,
    simulated_relations,
)
from plant_emulator.diagnosis.localisation.stacked_rows import (
    ColumnGroup,
    GroupedColumns,
    StackedRows,
)
from plant_emulator.model.array_laws import base_speed
from plant_emulator.model.stage import GAP_POSITION
from plant_emulator.recordings.recording import voltage_errors

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from plant_emulator.diagnosis.fit_result import FitResult
    from plant_emulator.estimation.unknowns import Estimate
    from plant_emulator.model.parameters import ParameterSet
    from plant_emulator.recordings.recording import Recording
    from plant_emulator.signals.log import Array

# Blocks that only the drum speed can show.
DRUM_SIDE_BLOCKS = ("drum", "speed_sensor", "backlash_shaft")
# Next to impacts, the variance that the draws of the smoothed speed's noise do not span, over the
# variance that they span.
UNSPANNED_VARIANCE = 3.0
# A sum of squares is no chance from so many of its standard deviations on.
SURPRISING_DEVIATIONS = 3.0


class BlockRegression:
    """The blocks of a bench, with the measured signals at their borders.

    fitted : parameter values of the fit without effects [SI]
    values : parameter values at which the relations are taken [SI]
    stds : prior standard deviations of the free parameters by name
    drum : subsystem of gap, shaft and drum; drum_fit : its fit without an unknown torque
    """

    def __init__(
        self, recordings: Sequence[Recording], parameters: ParameterSet, null: FitResult
    ) -> None:
        self.recordings, self.null = recordings, null
        self.fitted = {**parameters.values(), **null.values}
        self.base_speed = base_speed(self.fitted)
        self.stds = parameter_sensitivities.prior_deviations(parameters, list(null.values))
        p = parameter_sensitivities.believed_values(parameters, null.values, self.stds)
        self.signals = [measured_signals(r, p) for r in recordings]
        if "dead_time" in self.stds:
            p["dead_time"] = parameter_sensitivities.estimate_dead_time(
                self.signals, p, parameters["dead_time"]
            )
        self.values = p
        self.prior_offsets = parameter_sensitivities.prior_offsets(parameters, p, self.stds)
        top = max(float(np.max(np.abs(m.speed))) for m in self.signals)
        torques = [drum_basis.torque(m, p["gear_ratio"], top) for m in self.signals]
        self.drum = DrumSubsystem(recordings, self.signals, parameters, p, torques)
        self.drum_fit = self.drum.fit_null(null.values, [s[GAP_POSITION] for s in null.states])
        self.relations = [
            whitened_relations(m, p, simulated_relations(r, self.fitted, states[GAP_POSITION]))
            for m, r, states in zip(self.signals, recordings, null.states, strict=True)
        ]
        self.blocks = tuple(
            name
            for name in (*block_basis.BLOCKS, *DRUM_SIDE_BLOCKS)
            if name != "wheel_contact" or any(m.truck for m in self.signals)
        )

    def drum_values(self, run: int) -> dict[str, float]:
        """Values and states of the drum subsystem in a run, at its fit."""
        return {**self.drum_fit.parameters(), **self.drum_fit.states(run)}

    @cached_property
    def samples(self) -> list[block_basis.BlockQuantities]:
        """Quantities inside the blocks at the samples, one record a run."""
        return [
            block_basis.block_quantities(m, self.drum.simulate(k, self.drum_values(k)), self.values)
            for k, m in enumerate(self.signals)
        ]

    @cached_property
    def quantities(self) -> list[block_basis.BlockQuantities]:
        """Quantities inside the blocks over the intervals, one record a run."""
        return [one.means() for one in self.samples]

    @cached_property
    def speed_noise(self) -> list[Array]:
        """Noise of the smoothed motor speed in the drum speed; see `DrumSubsystem.speed_noise`."""
        return [self.drum.speed_noise(k, self.drum_values(k)) for k in range(len(self.signals))]

    @cached_property
    def weights(self) -> list[Array]:
        """Weights of the drum speed samples, shape (n,) each; near a large noise they are small."""
        from scipy.ndimage import maximum_filter1d

        return [
            1.0 / np.sqrt(1.0 + UNSPANNED_VARIANCE * maximum_filter1d((s**2).sum(-1), 11))
            for s in self.speed_noise
        ]

    @cached_property
    def rows(self) -> StackedRows:
        """The stacked rows of all runs."""
        return StackedRows(self.relations, self.weights)

    @cached_property
    def deviations(self) -> list[Array]:
        """Columns of the parameters' deviations in the relations, one array a run."""
        return [
            parameter_sensitivities.deviation_columns(m, q, self.values, self.stds)
            for m, q in zip(self.signals, self.quantities, strict=True)
        ]

    @cached_property
    def nuisance(self) -> tuple[Array, ...]:
        """The nuisance columns that no linearisation of the drum subsystem changes."""
        none = [None] * len(self.signals)
        found = (
            self.rows.shared_columns(self.deviations, none),
            self.rows.own_speed(self.speed_noise),
        )
        if all(m.voltage is None for m in self.signals):
            return found
        return (*found, self._voltage_sensor())

    def _voltage_sensor(self) -> Array:
        """Columns of the errors of the sensor of a logged voltage."""
        resistance = self.values["armature_resistance"]
        logged = [float(m.voltage is not None) for m in self.signals]
        voltages = [resistance * q.current + q.flux * q.speed for q in self.quantities]
        return self.rows.own_relations(
            [
                block_basis.acting_in({ARMATURE: there}, voltage_errors(voltage))
                for there, voltage in zip(logged, voltages, strict=True)
            ]
        )

    def linear_model(self, fitted: Estimate) -> LinearModel:
        """The linear model with the drum subsystem linearised at one of its fits."""
        runs = range(len(self.signals))
        away = fitted.z - prior_means(fitted)
        speed = [fitted.residuals[k][0] - fitted.jacobians[k][0] @ away for k in runs]
        relation = [
            (r.value - (d @ self.prior_offsets)[: len(r.value)])[..., None]
            for r, d in zip(self.relations, self.deviations, strict=True)
        ]
        y = self.rows.shared_columns(relation, [s[:, None] for s in speed])
        scale = np.array([min(u.scaled_std, 1.0) for u in fitted.unknowns])
        slopes = [(fitted.jacobians[k][0] * scale)[:, ~is_torque_size(fitted)] for k in runs]
        own = self.rows.shared_columns([None] * len(self.signals), slopes)
        return LinearModel(y[:, 0], [*self.nuisance, own])

    @cached_property
    def model(self) -> LinearModel:
        """The linear model without an unknown torque on the drum."""
        return self.linear_model(self.drum_fit)

    @cached_property
    def groups(self) -> dict[str, list[ColumnGroup]]:
        """Columns of the unknown laws of every block but the drum, a group a law."""
        top = block_basis.largest(self.quantities)
        own = {name: self._block(laws, top) for name, laws in block_basis.BLOCKS.items()}
        return own | {"speed_sensor": self._speed_sensor(), "backlash_shaft": self._backlash()}

    @cached_property
    def laws(self) -> GroupedColumns:
        """The whitened columns of these groups."""
        return self.rows.grouped([g for groups in self.groups.values() for g in groups])

    def _block(
        self,
        block: Callable[
            [block_basis.BlockQuantities, Mapping[str, float]], list[block_basis.UnknownLaw]
        ],
        top: Mapping[str, float],
    ) -> list[ColumnGroup]:
        """Columns of a block's laws; a law that acts in no relation of the runs has none."""
        runs = [block(q, top) for q in self.quantities]
        return [
            ColumnGroup([law.rows for law in group], own=group[0].own)
            for group in zip(*runs, strict=True)
            if any(
                law.rows[: len(r.value)].any() for law, r in zip(group, self.relations, strict=True)
            )
        ]

    def _speed_sensor(self) -> list[ColumnGroup]:
        """Columns of the errors of the drum's speed sensor."""
        laws = [drum_basis.speed_sensor(m, self.values["gear_ratio"]) for m in self.signals]
        *shared, own = zip(*laws, strict=True)
        return [*map(ColumnGroup, shared), ColumnGroup(own, own=True)]

    def _backlash(self) -> list[ColumnGroup]:
        """Columns of a gap and a damping that change in time."""
        slopes = [jacobian[0] for jacobian in self.drum_fit.jacobians]
        laws = [drum_basis.backlash(m, s) for m, s in zip(self.signals, slopes, strict=True)]
        return [ColumnGroup(group, own=True) for group in zip(*laws, strict=True)]

    def _drum_torque(self, fitted: Estimate) -> Array:
        """Columns of an unknown torque on the drum, in the gear's relation and the drum speed."""
        torque = is_torque_size(fitted)
        speed = [-fitted.jacobians[k][0][:, torque] for k in range(len(self.signals))]
        return self.rows.shared_columns(self._torque_on_gear(), speed) * TORQUE_STD

    @cached_property
    def without_torque(self) -> GroupRegression:
        """The regression on the unknown laws of all blocks but the drum."""
        return GroupRegression(self.model, [], self.laws)

    @cached_property
    def with_torque(self) -> list[GroupRegression]:
        """The regressions that have an unknown torque on the drum too, at each of its fits."""
        return [
            GroupRegression(self.linear_model(f), [self._drum_torque(f)], self.laws)
            for f in self.torque_fits
        ]

    @cached_property
    def torque_fits(self) -> list[Estimate]:
        """Fits of the drum subsystem with an unknown torque on the drum.

        The drum subsystem is linearised without the torque and, where it leaves more than chance
        does, also at its best fit with the torque.
        """
        start = {**self.drum_fit.parameters(), **self.drum.torque_sizes(0.0)}
        gaps = [self.drum_fit.states(k)[GAP_POSITION] for k in range(len(self.signals))]
        fits = [self.drum.linearise(start, gaps)]
        count = sum(len(m.time) for m in self.signals)
        chance = count + SURPRISING_DEVIATIONS * np.sqrt(2.0 * count)
        if self.model.left(slice(-count, None)) > chance:
            sizes = self._torque_sizes_by_gear()
            fits.append(self.drum.fit_torque(self.drum_fit.parameters(), gaps, sizes))
        return fits

    def _torque_on_gear(self) -> list[Array]:
        """Columns of the unknown torque on the drum in the gear's relation."""
        xi = self.values["gear_ratio"]
        return [
            block_basis.acting_in({GEAR: 1.0 / xi}, interval_means(law)) for law in self.drum.laws
        ]

    def _torque_sizes_by_gear(self) -> Array:
        """Sizes of the torque on the drum that the gear's relation alone says [10 N m]."""
        none = [None] * len(self.signals)
        group = TORQUE_STD * self.rows.shared_columns(self._torque_on_gear(), none)
        mean = self.model.marginal_likelihood([group]).mean
        return np.asarray(TORQUE_STD * mean[-group.shape[1] :])

    def log_marginal_likelihood(self, blocks: Sequence[str]) -> float:
        """Log probability of all measurements with unknown laws in these blocks [1].

        With the drive among them, its dead time may also vary from scan to scan.
        """
        drum = ["drum"] * ("drum" in blocks)
        names = [*drum, *(name for name, groups in self.groups.items() for _ in groups)]
        order = [*(name for name in blocks if name != "drum"), *drum]
        chosen = [k for block in order for k, name in enumerate(names) if name == block]
        trials = self.with_torque if drum else [self.without_torque]
        found, regression = max(
            ((one.search.largest(chosen), one) for one in trials), key=lambda pair: pair[0].log
        )
        if "drive" not in blocks:
            return found.log
        rows = [slice(DRIVE, None, len(r.value)) for r in self.relations]
        slope = np.concatenate([q.demand_rate for q in self.quantities])
        return found.log + variance_gain(regression.residual(found.mean, rows), slope)
