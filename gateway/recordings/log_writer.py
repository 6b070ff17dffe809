"""Writing of an export to a file, in the format of the file's ending, block by block."""

import csv
import gzip
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.errors import ConfigError
from gateway.recordings.export import SUFFIXES, Columns, Export
from register_maps.logs import mdf4_log, parquet_log
from register_maps.logs.log_table import Column, LogTableError
from register_maps.signals import LOG_COLUMNS

FORMS: Final = (".csv", ".csv.gz", ".parquet", ".mf4")


def write(path: Path, export: Export) -> None:
    """Write an export to a file. Raises ConfigError for an ending without a format."""
    forms: dict[tuple[str, ...], Callable[[Path, Export], None]] = {
        (".csv", ".csv.gz"): _write_csv,
        (".parquet",): _write_parquet,
        (".mf4",): _write_mdf4,
    }
    for endings, form in forms.items():
        if path.name.endswith(endings):
            try:
                form(path, export)
            except LogTableError as error:
                path.unlink(missing_ok=True)
                raise ConfigError(str(error), place="--to") from error
            return
    raise ConfigError(
        "unknown format", place="--to", value=str(path), expected=f"one of {', '.join(FORMS)}"
    )


def _write_csv(path: Path, export: Export) -> None:
    """Write CSV so that reading gives the same numbers again."""
    opened: Callable[..., Any] = gzip.open if path.name.endswith(".gz") else open
    with opened(path, "wt", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        for k, block in enumerate(export.blocks()):
            if k == 0:
                writer.writerow(block)
            texts = (map(_text, values.tolist()) for values in block.values())
            writer.writerows(zip(*texts, strict=True))


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(int(value))
    return "" if value != value else str(value)  # noqa: PLR0124 - true for NaN, which is written as nothing


def _write_parquet(path: Path, export: Export) -> None:
    with path.open("wb") as file:
        parquet_log.write(_with_units(export.blocks()), file, export.survey.quality.entries())


def _write_mdf4(path: Path, export: Export) -> None:
    """Write MDF4, whose package takes whole columns."""
    blocks = list(export.blocks())
    whole = {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}
    (columns,) = _with_units(iter([whole]))
    path.write_bytes(mdf4_log.encode(columns, export.start_date, str(export.survey.quality)))


def _with_units(blocks: Iterator[Columns]) -> Iterator[Sequence[Column]]:
    """Columns with signal and unit apart, for files that keep the unit as metadata."""
    for block in blocks:
        yield [
            Column(name=signal, unit=unit, values=values)
            for (signal, unit), values in zip(map(split_unit, block), block.values(), strict=True)
        ]


def split_unit(column: str) -> tuple[str, str]:
    """Signal and unit in the name of a column."""
    if column in LOG_COLUMNS:
        return LOG_COLUMNS[column].signal, LOG_COLUMNS[column].unit
    # The longest, because _rad_s ends in _s; no suffix fits every name.
    fitting = {suffix: unit for unit, suffix in SUFFIXES.items() if column.endswith(suffix)}
    suffix = max(fitting, key=len)
    return column.removesuffix(suffix), fitting[suffix]
