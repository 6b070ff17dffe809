"""Reader and writer of a Parquet log in bytes: one column a signal.

The metadata of a field has its unit under the key `unit`. Without metadata, the name of the column
may contain the unit as in CSV, which is how data frames are written. The package pyarrow is loaded
when the first such log is read or written. No file is opened here.
"""

import contextlib
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib import import_module
from typing import Any, BinaryIO, Final

from register_maps.logs.log_table import (
    Column,
    LogTable,
    LogTableError,
    table,
    with_metadata,
    without_package,
)

MAGIC: Final = b"PAR1"


def recognises(head: bytes) -> bool:
    """Whether bytes with this begin are a Parquet file."""
    return head.startswith(MAGIC)


def parse(data: bytes) -> LogTable:
    """Log in these bytes. Raises LogTableError."""
    with _open(data) as (arrow, file, fields):
        return table(
            [with_metadata(field.name, _unit(field)) for field in fields],
            lambda k: _numbers(arrow, file, fields, k),
        )


def units(data: bytes) -> dict[str, str]:
    """Units of all columns by name, empty where there is none. Raises LogTableError."""
    with _open(data) as (_, _, fields):
        return {field.name: _unit(field) for field in fields}


def values(data: bytes, names: Sequence[str]) -> list[list[float]]:
    """Values of these columns, NaN where one is missing. Raises LogTableError."""
    with _open(data) as (arrow, file, fields):
        places = {field.name: k for k, field in enumerate(fields)}
        return [_numbers(arrow, file, fields, places[name]) for name in names]


@contextlib.contextmanager
def _open(data: bytes) -> Iterator[tuple[Any, Any, list[Any]]]:
    """The package, the file and its fields; a damaged file raises LogTableError."""
    arrow, parquet = _packages()
    try:
        file = parquet.ParquetFile(arrow.BufferReader(data))
        yield arrow, file, list(file.schema_arrow)
    except (arrow.ArrowException, OSError, ValueError) as error:
        raise LogTableError(f"damaged Parquet file ({_line(error)})") from error


def encode(columns: Sequence[Column]) -> bytes:
    """Return the columns as a Parquet file."""
    sink = io.BytesIO()
    write([columns], sink, {})
    return sink.getvalue()


def write(blocks: Iterable[Sequence[Column]], sink: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write blocks of rows with the same columns one after the other as a Parquet file.

    metadata : of the file, by name
    """
    arrow, parquet = _packages()
    with contextlib.ExitStack() as opened:
        writer = None
        for columns in blocks:
            arrays = [arrow.array(column.values) for column in columns]
            fields = [
                arrow.field(column.name, array.type, metadata={"unit": column.unit})
                for column, array in zip(columns, arrays, strict=True)
            ]
            if writer is None:
                schema = arrow.schema(fields, metadata=dict(metadata))
                writer = opened.enter_context(parquet.ParquetWriter(sink, schema))
            writer.write_table(arrow.Table.from_arrays(arrays, schema=schema))


def _packages() -> tuple[Any, Any]:
    try:
        return import_module("pyarrow"), import_module("pyarrow.parquet")
    except ModuleNotFoundError:
        raise without_package("Parquet", "pyarrow", "parquet") from None


def _unit(field: Any) -> str:
    unit: bytes = (field.metadata or {}).get(b"unit", b"")
    return unit.decode("utf-8", "replace")


def _numbers(arrow: Any, file: Any, fields: Sequence[Any], k: int) -> list[float]:
    """Values of a column, NaN where one is missing."""
    name, kind = fields[k].name, fields[k].type
    if not (arrow.types.is_floating(kind) or arrow.types.is_integer(kind)):
        raise LogTableError(f"column {name}: holds {kind}; expected numbers")
    namesakes = [field.name for field in fields[:k]].count(name)
    column = file.read([name]).column(namesakes).cast(arrow.float64(), safe=False)
    values: list[float] = column.to_numpy().tolist()
    return values


def _line(error: Exception) -> str:
    return " ".join(str(error).split())
