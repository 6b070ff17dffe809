"""What the README files tell to type has to work, and what they link to has to be there."""

import re
import shlex
import tomllib
from pathlib import Path

import click
import pytest

import gateway.cli
import plant_emulator.cli
from gateway.configuration.config import from_document

ROOT = Path(__file__).parents[1]
PAGES = sorted(
    page.relative_to(ROOT).as_posix()
    for folder in ("", "gateway", "plant_emulator", "register_maps", "tests")
    for page in (ROOT / folder).glob("**/*.md" if folder else "*.md")
    if page.name != "CHANGELOG.md"
)
PROGRAMS = {"gateway": gateway.cli.main, "plant-emulator": plant_emulator.cli.main}
TYPED = re.compile(r"\.venv/bin/(gateway|plant-emulator) (.*)")


def text(page: str) -> str:
    return (ROOT / page).read_text("utf-8")


def typed(page: str) -> list[tuple[str, str]]:
    """Program and arguments of every command line on a page."""
    return TYPED.findall(re.sub(r"\\\n\s*", " ", text(page)).replace("`", "\n"))


@pytest.mark.parametrize("page", PAGES)
def test_every_link_leads_to_a_file_or_folder(page: str) -> None:
    links = re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", text(page))
    missing = [link for link in links if not ((ROOT / page).parent / link).exists()]
    assert not missing


@pytest.mark.parametrize("page", [page for page in PAGES if typed(page)])
def test_every_command_line_has_a_known_command_and_known_options(page: str) -> None:
    for program, line in typed(page):
        command: click.Command = PROGRAMS[program]
        context = click.Context(command, info_name=program)
        arguments = shlex.split(line, comments=True)
        while isinstance(command, click.Group) and arguments and arguments[0][0] != "-":
            name = arguments.pop(0)
            found = command.get_command(context, name)
            assert found is not None, f"{program} knows no {name}: {line}"
            command, context = found, click.Context(found, info_name=name, parent=context)
        command.make_parser(context).parse_args(arguments)


@pytest.mark.parametrize("page", [page for page in PAGES if "plant_emulator/" in page])
def test_every_named_file_of_the_package_exists(page: str) -> None:
    folder = (ROOT / page).parent
    places = (folder, ROOT, ROOT / page.partition("/")[0])
    names = re.findall(r"`([\w/]+(?:/|\.py))`", text(page))
    assert [name for name in names if not any((place / name).exists() for place in places)] == []


@pytest.mark.parametrize("page", PAGES)
def test_every_name_of_the_library_exists(page: str) -> None:
    assert set(re.findall(r"\bpe\.(\w+)", text(page))) <= set(dir(plant_emulator))


@pytest.mark.parametrize("page", [page for page in PAGES if "```toml" in text(page)])
def test_every_configuration_is_valid(page: str) -> None:
    for block in re.findall(r"```toml\n(.*?)```", text(page), flags=re.DOTALL):
        document = tomllib.loads(block)
        if "truck" in document:
            assert from_document(document).truck.total_mass == 3640.0


def test_the_first_page_is_short() -> None:
    assert len(text("README.md").splitlines()) <= 150


def test_the_python_of_the_first_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    for block in re.findall(r"```python\n(.*?)```", text("README.md"), flags=re.DOTALL):
        exec(compile(block, "README.md", "exec"), {})
    assert "shaft_torque" in capsys.readouterr().out
