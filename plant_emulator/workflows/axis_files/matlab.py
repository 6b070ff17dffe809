"""MATLAB files up to version 7 as tables: vectors by name, columns of a matrix as `data(:,3)`.

A field of a structure has a name like `log.position`. The variables of two known benches say
themselves which quantity they are:

    t, qm, vir, gtau    a position-controlled screw: position [m], command [V], gain [N/V];
                        force = gtau vir, which already includes `pulses_N`
    data, Cu            a motor bench: seven columns time [s], reference, position [rad], speed,
                        torque command, torque [N m], current [A]; torque = Cu current
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_emulator.errors import LogError
from plant_emulator.workflows.axis_files.columns import Choice
from plant_emulator.workflows.axis_files.table import Table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from plant_emulator.signals.log import Array

MAGIC = b"MATLAB"
SCREW = {"t", "qm", "vir", "gtau"}
MOTOR = {"data(:,1)", "data(:,3)", "data(:,7)", "Cu"}
# Variables of the known benches that are factors.
FACTORS = ("gtau", "Cu")


def table(path: str) -> Table:
    """The table of a MATLAB file; raises LogError."""
    from scipy.io import loadmat

    try:
        found = loadmat(path, struct_as_record=False, squeeze_me=True)
    except NotImplementedError as error:
        raise LogError(f"{path}: MATLAB file of version 7.3; save it with -v7") from error
    except Exception as error:
        raise LogError(f"{path}: no readable MATLAB file up to version 7 ({error})") from error
    held = {name: value for name, value in found.items() if not name.startswith("__")}
    arrays = dict(_arrays(held))
    samples = Counter(len(values) for values in arrays.values() if values.size > 1)
    count = samples.most_common(1)[0][0] if samples else 0
    columns = {name: values for name, values in arrays.items() if len(values) == count}
    seen = {name.partition(".")[0].partition("(")[0] for name in columns}
    numbers = {name: float(values[0]) for name, values in arrays.items() if values.size == 1}

    def take(wanted: Sequence[str]) -> list[Array]:
        return [columns[name] for name in wanted]

    return Table(
        path=path,
        header="variables",
        names=tuple(columns),
        take=take,
        row=lambda row: f"row {row + 1}",
        known=(known := _known_columns(arrays, numbers)),
        others=tuple(name for name in held if name not in (*seen, *(FACTORS if known else ()))),
    )


def _arrays(held: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Array]]:
    """Vectors and columns of matrices that are numbers, by name."""
    for name, value in held.items():
        if hasattr(value, "_fieldnames"):
            fields = {field: getattr(value, field) for field in value._fieldnames}  # noqa: SLF001 - scipy lists them so
            yield from _arrays(fields, f"{prefix}{name}.")
            continue
        array = np.asarray(value)
        if array.dtype.kind not in "fiub" or array.ndim > 2 or array.size == 0:
            continue
        if array.ndim < 2:
            yield f"{prefix}{name}", np.atleast_1d(array).astype(np.float64)
            continue
        for k, column in enumerate(array.T, start=1):
            yield f"{prefix}{name}(:,{k})", column.astype(np.float64)


def _known_columns(arrays: Mapping[str, Array], numbers: Mapping[str, float]) -> tuple[Choice, ...]:
    """The choice of columns of a known bench; none for any other file."""
    if arrays.keys() >= SCREW and "gtau" in numbers:
        return (
            Choice(quantity="time", column="t", unit="s"),
            Choice(quantity="position", column="qm", unit="m"),
            Choice(quantity="force", column="vir", factor=numbers["gtau"], unit="N"),
        )
    if arrays.keys() >= MOTOR and "Cu" in numbers:
        return (
            Choice(quantity="time", column="data(:,1)", unit="s"),
            Choice(quantity="position", column="data(:,3)", unit="rad"),
            Choice(quantity="force", column="data(:,7)", factor=numbers["Cu"], unit="N m"),
        )
    return ()
