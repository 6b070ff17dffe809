"""Certify a bench from its recordings: one page that can be printed, and verified again."""

from pathlib import Path
from typing import Any

import click

from gateway.cli._shared.options import write_json
from register_maps.command_line.parameters import Command, OutputFile

EXAMPLE = """
\b
Examples:
  gateway certificate READY.rlrec VERIFY.rlrec TRUCK.rlrec --parameters set.toml --save bench.html
  gateway certificate --verify bench.html
"""


@click.command(cls=Command, epilog=EXAMPLE)
@click.argument("recordings", metavar="[RECORDING]...", type=click.Path(path_type=Path), nargs=-1)
@click.option(
    "--parameters",
    default="thesis_table_3_1",
    show_default=True,
    metavar="SET",
    help="parameter set of the bench: a shipped name or a file, as diagnose saves it",
)
@click.option("--save", type=OutputFile(), help="page of the certificate, HTML")
@click.option("--json", "json_file", type=OutputFile(dash=True), help="certificate/1; - = stdout")
@click.option(
    "--verify",
    "verified",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="certificate to verify: the page or the document",
)
def command(
    recordings: tuple[Path, ...],
    *,
    parameters: str,
    save: str | None,
    json_file: str | None,
    verified: Path | None,
) -> int:
    """Bind map, parameter set, checks and recordings of a bench into one certificate.

    A RECORDING is one of `ready`, of `verify`, or of a truck in road load, which gives the error
    budget and the indices of SAE J2951. The page names every file by its digest and holds the
    document certificate/1. --verify computes all values again from these files.

    Exit code 1: a value lies outside of its limit, a check of `ready` or `verify` is not in the
    recordings, or the verified certificate says otherwise than its files.
    """
    if (verified is None) == (not recordings):
        raise click.UsageError("expected recordings, or --verify FILE")
    if verified is not None:
        return _verify(verified)
    if save is None and json_file is None:
        raise click.UsageError("expected --save FILE or --json FILE")
    from gateway.twin.recorded import parameter_file
    from gateway.workflows.certificate import certify

    made = certify(
        recordings,
        parameters,
        parameter_file(parameters),
        _budget,
        folder=Path(save or ("." if json_file in (None, "-") else str(json_file))).parent,
    )
    if save is not None:
        Path(save).write_text(made.page, encoding="utf-8")
    if json_file is not None:
        write_json(json_file, made.document, indent=2)
    if json_file != "-":
        click.echo(
            "every value lies within its limit"
            if made.holds
            else f"not certified: see {save or json_file}"
        )
    return 0 if made.holds else 1


def _verify(path: Path) -> int:
    from gateway.twin.recorded import parameter_file
    from gateway.workflows.certificate import differences

    lines = differences(path, _budget, parameter_file)
    click.echo("\n".join(lines) or "the certificate agrees with its files")
    return 1 if lines else 0


# Entries of a budget that name files by their paths. The certificate names them by their digests.
BY_PATH = ("schema", "recording", "parameters")


def _budget(recording: Path, file: Path) -> dict[str, Any]:
    """Entries of the error budget of a recording with the parameter set in a file."""
    from gateway.twin.recorded import budget_of

    told = budget_of(recording, str(file)).to_json()
    return {key: value for key, value in told.items() if key not in BY_PATH}
