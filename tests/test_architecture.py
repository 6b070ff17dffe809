"""Who may import whom: the contracts of pyproject.toml, and what they cannot say themselves."""

import subprocess
import sys
import tomllib
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("register_maps", "gateway", "plant_emulator")

# Rooms and modules that touch the world, and what they touch. Every other module has to be pure.
SHELL = {
    "gateway.config_file": "files",
    "gateway.demo": "processes, files, terminal",
    "gateway.link": "network",
    "gateway.monitoring": "shared memory, clock, terminal, network",
    "gateway.recordings": "files, processes",
    "gateway.reports": "files",
    "gateway.twin": "files",
    "gateway.runtime": "clock, processes, operating system",
    "gateway.workflows": "files, processes",
    "plant_emulator.effects": "files: it finds its effects by their names",
    "plant_emulator.emulator": "clock, network, processes",
    "plant_emulator.logs": "files",
    "plant_emulator.parameter_sets": "files",
    "plant_emulator.workflows": "files, date, clock, processes, network",
    "register_maps": "files: it finds its maps by their names",
    "register_maps.command_line.folder": "files, terminal: what both command lines share",
    "register_maps.command_line.parameters": "files, terminal: what both command lines share",
}
# Folders and entry points: no code of their own to judge.
ENTRANCES = {
    f"{package}{part}" for package in PACKAGES for part in ("", ".__main__", ".regulators")
}
# Rooms in which a new module has to be pure, whatever stands beside it.
MIXED = ("plant_emulator.effects.", "register_maps.")
CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"][
    "contracts"
]


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph(*PACKAGES, include_external_packages=True, cache_dir=None)


def own_modules(graph: grimp.ImportGraph) -> set[str]:
    return {name for name in graph.modules if name.partition(".")[0] in PACKAGES}


def listed_as_pure(graph: grimp.ImportGraph) -> set[str]:
    """The modules that the contract about purity names, a room with its face."""
    [contract] = [contract for contract in CONTRACTS if contract["name"].startswith("Pure")]
    return {
        module
        for expression in contract["source_modules"]
        for module in (
            *graph.find_matching_modules(expression),
            expression.removesuffix(".**"),
        )
        if module in graph.modules
    }


def test_every_import_contract_is_kept() -> None:
    run = subprocess.run(
        [str(Path(sys.executable).with_name("lint-imports")), "--no-logo", "--no-cache"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr


def touches_the_world(name: str) -> bool:
    """Whether a module is in a room, or is a module, that is known to touch the world."""
    return any(
        name == room or (name.startswith(f"{room}.") and not name.startswith(MIXED))
        for room in SHELL
    )


def test_every_module_is_either_listed_as_pure_or_known_to_touch_the_world(
    graph: grimp.ImportGraph,
) -> None:
    pure = listed_as_pure(graph)
    commands = {name for name in own_modules(graph) if ".cli" in name}
    shell = {name for name in own_modules(graph) if touches_the_world(name)}
    undecided = own_modules(graph) - pure - shell - ENTRANCES - commands
    assert not undecided, "list its room in pyproject.toml as pure, or in SHELL here with a reason"
    assert not pure & set(SHELL)


def test_every_module_that_calls_itself_pure_is_listed(graph: grimp.ImportGraph) -> None:
    claimed = {
        name
        for name in own_modules(graph)
        if (file := ROOT / f"{name.replace('.', '/')}.py").is_file()
        and "(pure)" in file.read_text("utf-8").partition("\n")[0]
    }
    assert claimed <= listed_as_pure(graph)


def test_nobody_imports_tools_or_tests(graph: grimp.ImportGraph) -> None:
    assert not {"tools", "tests"} & graph.modules


@pytest.mark.parametrize(
    ("package", "never"),
    [
        ("register_maps", {"numba", "scipy", "matplotlib", "pymodbus", "click", "numpy"}),
        ("gateway", {"numba", "scipy", "matplotlib", "plant_emulator"}),
        ("plant_emulator", {"matplotlib"}),
    ],
)
def test_importing_every_module_leaves_heavy_packages_alone(
    graph: grimp.ImportGraph, package: str, never: set[str]
) -> None:
    modules = sorted(
        name
        for name in own_modules(graph)
        if name.partition(".")[0] == package
        and not name.startswith(("gateway.demo.", "gateway.twin.", "register_maps.command_line."))
    )
    program = (
        "import importlib, sys\n"
        f"for name in {modules}: importlib.import_module(name)\n"
        "print(*sys.modules)"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert not never & set(run.stdout.split())
