"""Who may import whom: the contracts of pyproject.toml, and what they cannot say themselves."""

import subprocess
import sys
import tomllib
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("register_maps", "gateway", "plant_emulator")

# The modules that touch the world, and what they touch. Every other module has to be pure.
SHELL = {
    "register_maps": "files",
    "gateway.config_file": "files",
    "gateway.connector": "network",
    "gateway.daemon": "processes",
    "gateway.demo": "processes",
    "gateway.demo_operator": "processes",
    "gateway.demo_options": "files",
    "gateway.demo_plot": "files",
    "gateway.demo_view": "terminal",
    "gateway.device": "network",
    "gateway.export": "files",
    "gateway.header": "files, date",
    "gateway.live": "terminal",
    "gateway.log": "files",
    "gateway.loop": "clock",
    "gateway.losses_report": "files",
    "gateway.losses_source": "files",
    "gateway.plc": "network",
    "gateway.realtime": "operating system",
    "gateway.recorder": "files, processes",
    "gateway.recording": "files",
    "gateway.replay_report": "files",
    "plant_emulator.admission": "files",
    "plant_emulator.axis_log": "files",
    "plant_emulator.blind.examiner": "files, processes",
    "plant_emulator.blind.folder": "files",
    "plant_emulator.blind.trial": "clock, threads",
    "plant_emulator.compiler": "files",
    "plant_emulator.control": "the running emulator",
    "plant_emulator.diagnosis_session": "files, date",
    "plant_emulator.effects": "files",
    "plant_emulator.emulator": "clock",
    "plant_emulator.identification": "files, date, processor time",
    "plant_emulator.logs": "files",
    "plant_emulator.logs._files": "files",
    "plant_emulator.logs.csv": "files",
    "plant_emulator.logs.mdf4": "files",
    "plant_emulator.logs.parquet": "files",
    "plant_emulator.pace": "clock",
    "plant_emulator.known_set": "files",
    "plant_emulator.parameter_sets": "files",
    "plant_emulator.planning": "files",
    "plant_emulator.plots": "files",
    "plant_emulator.process": "processes",
    "plant_emulator.road_log": "files",
    "plant_emulator.road_plot": "files",
    "plant_emulator.server": "network",
    "plant_emulator.serving": "network",
    "plant_emulator.session": "files",
    "plant_emulator.workers": "processes, network",
}
# Folders and entry points: no code of their own to judge.
ENTRANCES = {
    f"{package}{part}" for package in PACKAGES for part in ("", ".__main__", ".cli", ".regulators")
} | {"plant_emulator.blind"}
CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"][
    "contracts"
]


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph(*PACKAGES, include_external_packages=True, cache_dir=None)


def own_modules(graph: grimp.ImportGraph) -> set[str]:
    return {name for name in graph.modules if name.partition(".")[0] in PACKAGES}


def listed_as_pure(graph: grimp.ImportGraph) -> set[str]:
    """The modules that the contract about purity names, wildcards resolved."""
    [contract] = [contract for contract in CONTRACTS if contract["name"].startswith("Pure")]
    return {
        module
        for expression in contract["source_modules"]
        for module in graph.find_matching_modules(expression)
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


def test_every_module_is_either_listed_as_pure_or_known_to_touch_the_world(
    graph: grimp.ImportGraph,
) -> None:
    pure = listed_as_pure(graph)
    commands = {name for name in own_modules(graph) if ".cli." in name}
    undecided = own_modules(graph) - pure - set(SHELL) - ENTRANCES - commands
    assert not undecided, "list it in pyproject.toml as pure, or in SHELL here with a reason"
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
        if name.partition(".")[0] == package and name != "gateway.demo"
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
