"""Both command lines: no number that is none, no output over an input, none that cannot be made."""

import os
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

import gateway.cli
import plant_emulator.cli
from register_maps.command_line import parameters

DATA = Path(__file__).parent / "data" / "bench_nominal"
FOLDERS = {"gateway": gateway.cli.main, "plant_emulator": plant_emulator.cli.main}
OUTPUTS = {
    "--csv",
    "--json",
    "--log",
    "--out",
    "--plot",
    "--save-learned",
    "--report",
    "--next-program",
    "--save",
    "--table",
    "--to",
}


def leaves(group: click.Group, path: tuple[str, ...]) -> Iterator[tuple[str, click.Command]]:
    context = click.Context(group)
    for name in group.list_commands(context):
        found = group.get_command(context, name)
        assert found is not None
        if isinstance(found, click.Group):
            yield from leaves(found, (*path, name))
        else:
            yield " ".join((*path, name)), found


COMMANDS = [
    pytest.param(found, id=name)
    for package, group in FOLDERS.items()
    for name, found in leaves(group, (package,))
]


def said(result: Result) -> str:
    """The one line of a refusal."""
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.splitlines()
    assert result.stdout == ""
    return line.removeprefix("error: ")


def run(package: str, *arguments: object) -> Result:
    return CliRunner().invoke(FOLDERS[package], [str(argument) for argument in arguments])


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "run.csv.gz"
    path.write_bytes((DATA / "program1.csv.gz").read_bytes())
    return path


@pytest.mark.parametrize("found", COMMANDS)
def test_every_number_of_a_command_is_finite_and_every_output_is_tried(
    found: click.Command,
) -> None:
    for option in found.params:
        name = option.opts[0]
        if isinstance(option.type, click.types.FloatParamType) and option.name != "value":
            assert isinstance(option.type, parameters.Number), name
        folder = isinstance(option, click.Option) and option.metavar == "DIR"
        writes = name in OUTPUTS and not folder
        assert writes == isinstance(option.type, parameters.OutputFile), name
        if writes:
            assert isinstance(found, parameters.Command), name


@pytest.mark.parametrize(
    ("package", "arguments"),
    [
        ("gateway", ("run", "-c", "a.toml", "--duration", "nan")),
        ("gateway", ("demo", "--duration", "nan")),
        ("gateway", ("demo", "--load", "inf")),
        ("gateway", ("losses", "-c", "a.toml", "--hold", "nan")),
        ("gateway", ("losses", "-c", "a.toml", "--speeds", "200,nan")),
        ("gateway", ("registers", "watch", "bench_int16", "--interval", "nan")),
        ("gateway", ("registers", "read", "bench_int16", "--timeout", "nan")),
        ("plant_emulator", ("serve", "--speed", "nan")),
        ("plant_emulator", ("serve", "--duration", "nan")),
        ("plant_emulator", ("serve", "--remote-after", "inf")),
        ("plant_emulator", ("validate", "a.csv", "--filter", "nan")),
        ("plant_emulator", ("identify-truck", "a", "b", "--mass", "nan")),
    ],
)
def test_what_is_no_number_is_refused(package: str, arguments: tuple[str, ...]) -> None:
    line = said(run(package, *arguments))
    assert f"'{arguments[-2]}'" in line
    told = ("a finite number is expected", "expected numbers", "is not in the range")
    assert any(text in line for text in told)


@pytest.mark.parametrize(
    ("package", "arguments"),
    [
        ("gateway", ("registers", "read", "bench_int16", "--unit", "-1")),
        ("gateway", ("registers", "read", "bench_int16", "--unit", "256")),
        ("gateway", ("registers", "read", "bench_int16", "--port", "0")),
        ("gateway", ("registers", "read", "bench_int16", "--port", "65536")),
        ("gateway", ("registers", "read", "bench_int16", "--timeout", "0")),
        ("gateway", ("registers", "watch", "bench_int16", "--interval", "-1")),
        ("plant_emulator", ("simulate", "--program", "program1", "--seed", "-1")),
    ],
)
def test_what_is_out_of_range_is_refused(package: str, arguments: tuple[str, ...]) -> None:
    line = said(run(package, *arguments))
    assert f"Invalid value for '{arguments[-2]}'" in line
    assert "is not in the range" in line


@pytest.mark.parametrize(
    ("package", "before", "option"),
    [
        ("gateway", ("replay",), "--out"),
        ("gateway", ("replay",), "--plot"),
        ("gateway", ("replay",), "--json"),
        ("gateway", ("losses",), "--save"),
        ("gateway", ("losses",), "--csv"),
        ("gateway", ("export",), "--to"),
        ("gateway", ("check", "-c"), "--json"),
        ("gateway", ("registers", "verify"), "--json"),
        ("plant_emulator", ("validate",), "--table"),
        ("plant_emulator", ("validate",), "--json"),
        ("plant_emulator", ("identify",), "--save"),
        ("plant_emulator", ("identify",), "--json"),
        ("plant_emulator", ("identify",), "--table"),
        ("plant_emulator", ("identify", DATA / "program1.csv.gz", "--parameters"), "--save"),
        ("plant_emulator", ("diagnose",), "--report"),
        ("plant_emulator", ("detectability",), "--json"),
        ("plant_emulator", ("simulate", "--program"), "--out"),
        ("plant_emulator", ("serve", "--parameters"), "--log"),
    ],
)
@pytest.mark.parametrize("alias", ["the same name", "a way round", "a link", "a hard link"])
def test_no_output_is_written_over_what_is_read(
    tmp_path: Path, package: str, before: tuple[object, ...], option: str, alias: str
) -> None:
    read = tmp_path / ("run.png" if option == "--plot" else "run.csv")
    read.write_bytes(b"kept")
    other = tmp_path / f"other{read.suffix}"
    match alias:
        case "the same name":
            other = read
        case "a way round":
            other = tmp_path / ".." / tmp_path.name / read.name
        case "a link":
            other.symlink_to(read)
        case "a hard link":
            other.hardlink_to(read)
    line = said(run(package, *before, read, option, other))
    assert f"Invalid value for '{option}'" in line
    assert "would be lost" in line
    assert read.read_bytes() == b"kept"


def test_a_file_in_a_set_value_is_read_too(tmp_path: Path) -> None:
    config, friction = tmp_path / "bench.toml", tmp_path / "friction.toml"
    for path in (config, friction):
        path.write_text("")
    line = said(
        run("gateway", "check", "-c", config, "--set", f"regulator.friction={friction}",
            "--json", friction)
    )  # fmt: skip
    assert "'--set', which would be lost" in line


def test_two_outputs_are_not_written_to_one_file(log: Path, tmp_path: Path) -> None:
    both = tmp_path / "both"
    line = said(run("plant_emulator", "validate", log, "--table", both, "--json", both))
    assert line.endswith(f"'{both}': --table is written there too")
    assert not both.exists()


def test_a_device_may_take_two_outputs(log: Path) -> None:
    """Both outputs go where nothing is kept; what the operator reads is that of no output."""
    result = run("gateway", "replay", log, "--out", os.devnull, "--json", os.devnull)
    assert result.exit_code == 0, result.output
    assert result.stdout == run("gateway", "replay", log).stdout
    assert "1851 of 1851 samples compared" in result.stdout


@pytest.mark.parametrize(
    ("package", "arguments"),
    [
        ("gateway", ("replay", "LOG", "--json")),
        ("gateway", ("replay", "LOG", "--plot")),
        ("gateway", ("registers", "verify", "bench_int16", "--json")),
        ("plant_emulator", ("validate", "LOG", "--plot")),
        ("plant_emulator", ("effects", "--json")),
        ("plant_emulator", ("serve", "--port", "0", "--duration", "0.1", "--log")),
    ],
)
def test_what_cannot_be_written_is_refused_before_any_work(
    log: Path, tmp_path: Path, package: str, arguments: tuple[str, ...]
) -> None:
    before = sorted(tmp_path.iterdir())
    given = [log if argument == "LOG" else argument for argument in arguments]
    assert "is a directory" in said(run(package, *given, tmp_path))
    assert "No such file or directory" in said(run(package, *given, tmp_path / "no" / "x"))
    assert "the name of a file is expected" in said(run(package, *given, ""))
    assert sorted(tmp_path.iterdir()) == before


def test_an_output_that_was_tried_is_neither_left_behind_nor_changed(tmp_path: Path) -> None:
    new, old = tmp_path / "new", tmp_path / "old"
    old.write_text("kept")
    assert parameters.obstacle(new) == parameters.obstacle(old) == ""
    assert not new.exists()
    assert old.read_text() == "kept"


@pytest.mark.slow
@pytest.mark.parametrize(("name", "begins"), [("picture", b"\x89PNG"), ("p.PDF", b"%PDF")])
def test_a_picture_is_drawn_to_exactly_the_name_given(
    log: Path, tmp_path: Path, name: str, begins: bytes
) -> None:
    for package, command in (("gateway", "replay"), ("plant_emulator", "validate")):
        folder = tmp_path / package
        folder.mkdir()
        assert run(package, command, log, "--plot", folder / name).exit_code == 0
        assert [path.name for path in folder.iterdir()] == [name]
        assert (folder / name).read_bytes().startswith(begins)


@pytest.mark.parametrize("package", FOLDERS)
def test_a_picture_of_an_unknown_form_is_refused(package: str, log: Path) -> None:
    command = "replay" if package == "gateway" else "validate"
    assert "ends in .png, .pdf, .svg" in said(run(package, command, log, "--plot", "a.xlsx"))


def test_an_error_about_an_argument_names_the_option_of_the_command() -> None:
    log = DATA / "program1.csv.gz"
    free = said(run("plant_emulator", "identify", log, "--free", "inertia"))
    assert free.startswith("--free inertia: no parameter of the bench; known: ")
    without = said(run("plant_emulator", "diagnose", log, "--without", "stribek"))
    assert without.startswith("--without stribek: no effect of that name; known: ")
