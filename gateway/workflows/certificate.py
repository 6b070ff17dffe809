"""The certificate of a bench: made from recordings, and made again from them to be verified.

A certificate is a document (certificate/1) and its page. It names every file that it rests on by a
digest, and holds no value that does not follow from these files. What only the live device could
show (map and disk of `ready`) is not in a recording, hence not in a certificate.
"""

import hashlib
import math
import os
import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from gateway.commissioning import readiness
from gateway.commissioning.verification import CHECKS
from gateway.configuration.config import Config
from gateway.errors import ConfigError
from gateway.recordings import recording, step_runs
from gateway.recordings.header import config_of
from gateway.recordings.parts import find_later_parts
from gateway.recordings.recording import GatewayRecording
from gateway.reports import certificate as report
from gateway.workflows.run_quality import quality_of
from gateway.workflows.verify import evaluate_recording

SCHEMA: Final = "certificate/1"
DIGITS: Final = 9
"""Significant digits of a value in the document."""
EQUAL: Final = 1e-6
"""Share by which a value may differ when another computer computes it again."""
VERIFICATION, READINESS = "verification", "readiness"
"""Names of the programs whose runs have checks."""

Budget = Callable[[Path, Path], dict[str, Any]]
"""Entries of the document budget/1 for a recording with the file of a parameter set."""


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """A certificate; document : certificate/1."""

    document: dict[str, Any]

    @property
    def holds(self) -> bool:
        """Whether every check was made, and every value of them lies within its limit."""
        return bool(self.document["holds"])

    @property
    def page(self) -> str:
        """The page in HTML, with the document inside."""
        return report.html(self.document)


def certify(
    recordings: Sequence[Path],
    parameters: str,
    file: Path,
    budget: Budget,
    *,
    folder: Path,
    date: str | None = None,
) -> Certificate:
    """Certificate of a bench from recordings of `ready`, `verify`, and of trucks in road load.

    parameters : parameter set of the bench, a shipped name or a path; file : in which it stands
    budget : error budget of a truck's run
    folder : of the certificate; the document names the files from there on
    date : of the certificate, ISO 8601; None: now

    Raises ConfigError for recordings of different benches, or for the run of another program.
    """
    found = [recording.read(path) for path in recordings]
    configs = [config_of(one.header) for one in found]
    _refuse_other_bench(found, configs)
    pairs = zip(found, configs, strict=True)
    runs = [_run(one, config, lambda path: budget(path, file), folder) for one, config in pairs]
    checks = [check for run in runs for check in run["checks"]]
    shown = {check["name"] for check in checks}
    not_shown = [name for name in (*readiness.NAMES, *CHECKS) if name not in shown]
    document = {
        "schema": SCHEMA,
        "date": date or datetime.now(UTC).isoformat(timespec="seconds"),
        "program": "gateway " + version("road-load-bench"),
        "holds": not not_shown and all(check["holds"] for check in checks),
        "not_shown": not_shown,
        "bench": configs[0].document["bench"],
        "map": {"name": found[0].header.map, "sha256": found[0].header.map_hash},
        "parameters": _parameters(parameters, file, folder),
        "runs": runs,
    }
    return Certificate(document=_plain(document))


def _refuse_other_bench(found: Sequence[GatewayRecording], configs: Sequence[Config]) -> None:
    first, known = found[0], configs[0].document["bench"]
    for one, config in zip(found, configs, strict=True):
        if one.header.map_hash != first.header.map_hash:
            raise ConfigError(
                "another register map",
                file=one.path,
                value=one.header.map,
                expected=f"that of {first.path}, {first.header.map}, with the same hash",
            )
        if config.document["bench"] != known:
            raise ConfigError(
                "another [bench] in the configuration",
                file=one.path,
                expected=f"that of {first.path}",
            )


def _run(
    found: GatewayRecording, config: Config, budget: Callable[[Path], dict[str, Any]], folder: Path
) -> dict[str, Any]:
    """Entry of one recording: its digests, and what it shows."""
    name = config.program.name if config.program is not None else None
    checks, causes, quality = [], None, None
    if name == VERIFICATION:
        checks = evaluate_recording(found.path).to_json()["checks"]
    elif name == READINESS:
        checks = [one.to_json() for one in readiness.evaluate(step_runs.read(found.path))]
    elif name is not None:
        raise ConfigError(
            f"the run of {name}",
            file=found.path,
            expected="a recording of ready, of verify, or of a truck in road load",
        )
    else:
        causes, indices = budget(found.path), quality_of(found, config)
        quality = None if indices is None else indices.to_json()
    return {
        "files": _digests(found.path, folder),
        "run": name or "road load",
        "date": found.header.date,
        "plc": f"{config.plc.host}:{config.plc.port}, unit {config.plc.unit}",
        "config_sha256": found.header.config_hash,
        "gateway": found.header.versions["gateway"],
        "truck": {"mass_kg": config.truck.mass, "load_kg": config.truck.load},
        "checks": checks,
        "budget": causes,
        "j2951": quality,
    }


def _digests(path: Path, folder: Path) -> dict[str, str]:
    """SHA-256 of every part of a recording, by its path from the folder on."""
    return {_relative(part, folder): _digest(part) for part in (path, *find_later_parts(path))}


def _relative(path: Path, folder: Path) -> str:
    return os.path.relpath(path.absolute(), folder.absolute())


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _parameters(name: str, file: Path, folder: Path) -> dict[str, Any]:
    """Name, digest and origin of the parameter set; origin : as `identify` has written it."""
    table = tomllib.loads(file.read_text("utf-8"))
    return {
        "set": _relative(file, folder) if file == Path(name) else name,
        "sha256": _digest(file),
        "origin": table.get("origin"),
        "effects": sorted(table.get("effects", {})),
    }


def _plain(value: Any) -> Any:
    """Document whose numbers are finite and of nine digits, so that its text does not change."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int, str)) else str(value)


def differences(path: Path, budget: Budget, file_of: Callable[[str, Path], Path]) -> list[str]:
    """Differences between a certificate and its files, in lines; none: it is verified.

    path : of the page or of the document; budget : of a recording with the file of a parameter set
    file_of : file of a parameter set, given by its shipped name or its path from a folder on

    Raises ConfigError for a file that is no certificate.
    """
    text = _text(path)
    document = report.document_in(text)
    if document is None or not _is_certificate(document):
        raise ConfigError("no certificate", file=path, expected=f"a page or document {SCHEMA}")
    folder, name = path.parent, document["parameters"]["set"]
    file = file_of(name, folder)
    changed = list(_changed_files(document, file, folder))
    if changed:
        return changed
    recordings = [folder / next(iter(run["files"])) for run in document["runs"]]
    shown = name if file != folder / name else str(file)
    again = certify(recordings, shown, file, budget, folder=folder, date=document["date"])
    skipped = {"program": document["program"]}
    lines = list(_differences(document, {**again.document, **skipped}, ""))
    if not lines and not report.is_written(text, document):
        return ["the page differs from its document"]
    return lines


def _is_certificate(document: dict[str, Any]) -> bool:
    """Whether a document names its date, its program, and files with their digests."""
    texts = [document.get(key) for key in ("schema", "date", "program")]
    known, runs = document.get("parameters"), document.get("runs")
    if not isinstance(known, dict) or not isinstance(runs, list):
        return False
    texts += [known.get("set"), known.get("sha256")]
    files = [one.get("files") if isinstance(one, dict) else None for one in runs]
    return (
        all(isinstance(one, str) for one in texts)
        and texts[0] == SCHEMA
        and bool(files)
        and all(isinstance(one, dict) and one for one in files)
    )


def _text(path: Path) -> str:
    try:
        return path.read_text("utf-8")
    except UnicodeDecodeError as error:
        raise ConfigError("no certificate", file=path, expected="a text in UTF-8") from error


def _changed_files(document: dict[str, Any], parameters: Path, folder: Path) -> Iterator[str]:
    known = {folder / n: digest for run in document["runs"] for n, digest in run["files"].items()}
    for path, digest in (known | {parameters: document["parameters"]["sha256"]}).items():
        if not path.is_file():
            yield f"{path}: missing"
        elif _digest(path) != digest:
            yield f"{path}: changed since the certificate was made"


def _differences(told: Any, found: Any, place: str) -> Iterator[str]:
    """Lines for the places at which two documents differ."""
    if isinstance(told, dict) and isinstance(found, dict):
        for key in told | found:
            yield from _differences(told.get(key), found.get(key), f"{place}.{key}".lstrip("."))
    elif isinstance(told, list) and isinstance(found, list) and len(told) == len(found):
        for index, pair in enumerate(zip(told, found, strict=True)):
            yield from _differences(*pair, f"{place}[{index}]")
    elif not _alike(told, found):
        yield f"{place}: {told!r} in the certificate, {found!r} from the files"


def _alike(told: Any, found: Any) -> bool:
    if isinstance(told, float) and isinstance(found, float):
        return math.isclose(told, found, rel_tol=EQUAL, abs_tol=EQUAL)
    return bool(told == found)
