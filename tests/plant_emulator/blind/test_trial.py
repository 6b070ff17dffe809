"""The whole trial: the diagnosis sees only logs, and an interrupted trial can be continued."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from plant_emulator import logs
from plant_emulator.cli import main
from plant_emulator.model.parameters import ParameterSet
from plant_emulator.signals.log import Log
from plant_emulator.simulation.run_inputs import inputs_of
from plant_emulator.simulation.sensor_noise import add_noise
from plant_emulator.simulation.simulate import simulate
from plant_emulator.workflows.blind_trial.examiner import Examiner
from plant_emulator.workflows.blind_trial.folder import ROOT, program_hash
from plant_emulator.workflows.blind_trial.trial import BlindTrial
from tests.plant_emulator.blind.conftest import finished
from tests.plant_emulator.runs import linear

# Records every file that a process opens, and every module that it has imported at its end.
WITNESS = """
import atexit, sys
out = open({out!r}, "w")
def record(event, arguments):
    if event in ("open", "os.listdir", "os.scandir"):
        out.write(f"{{event}} {{arguments[0]}}\\n")
sys.addaudithook(record)
atexit.register(lambda: (out.write("\\n".join(f"module {{m}}" for m in sys.modules)), out.close()))
"""


@pytest.fixture
def short_log(tmp_path: Path, nominal: ParameterSet) -> Path:
    """A log of a few seconds of the nominal bench."""
    run = linear((0.2, 0.0), (2.0, 230.0), (2.5, 230.0), (4.0, 60.0), duration=5.0)
    found = simulate(inputs_of(run), nominal.values())
    signals = {k: v for k, v in found.signals.items() if k != "armature_voltage"}
    file = tmp_path / "given" / "program1.csv.gz"
    file.parent.mkdir()
    logs.write(add_noise(Log(found.time, signals), 1), file)
    return file


@pytest.mark.slow
def test_diagnosis_opens_no_answer_and_imports_no_law_of_the_trial(
    tmp_path: Path, short_log: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial = BlindTrial(folder, 1, 2)
    trial.seal()
    witness = tmp_path / "witness"
    witness.mkdir()
    record = witness / "record.txt"
    (witness / "sitecustomize.py").write_text(WITNESS.format(out=str(record)))
    monkeypatch.setenv("PYTHONPATH", str(witness))
    found = Examiner().diagnose([short_log])
    assert found.error == ""
    assert found.answer is not None
    assert found.answer["schema"] == "gap-diagnosis/1"
    seen = record.read_text().splitlines()
    assert "module plant_emulator.diagnosis.fitting.joint_fit" in seen
    assert any(line.startswith("open ") and "program1.csv.gz" in line for line in seen)
    assert not [line for line in seen if str(folder) in line or "sealed" in line]
    assert not [line for line in seen if "plant_emulator/blind" in line]
    assert not [line for line in seen if "plant_emulator.blind" in line]


def test_witness_would_record_an_opened_answer(tmp_path: Path, folder: Path) -> None:
    BlindTrial(folder, 1, 1).seal()
    record = tmp_path / "record.txt"
    answer = folder / "sealed" / "case_001.json"
    program = f"{WITNESS.format(out=str(record))}\nopen({str(answer)!r})"
    subprocess.run([sys.executable, "-c", program], check=True)
    assert f"open {answer}" in record.read_text()


def test_refused_log_is_reported_by_its_one_line(tmp_path: Path, nominal: ParameterSet) -> None:
    still = simulate(inputs_of(linear((0.0, 0.0), duration=1.0)), nominal.values())
    file = tmp_path / "program1.csv.gz"
    logs.write(still, file)
    found = Examiner().diagnose([file])
    assert found.answer is None
    assert found.error.startswith("error: program1.csv.gz: motor_speed_rad_s moves by 0.0 rad/s")


def test_stopped_examiner_starts_nothing(short_log: Path) -> None:
    examiner = Examiner()
    examiner.stop()
    assert examiner.diagnose([short_log]).error == "stopped"


def done(folder: Path, *right: bool) -> BlindTrial:
    """A trial with finished cases only."""
    trial = BlindTrial(folder, 1, len(right))
    trial.seal()
    for number, one in enumerate(right):
        trial.folder.write_result(number, finished(number, right=one), None)
    return trial


def test_a_finished_case_is_not_repeated(folder: Path) -> None:
    done(folder, True, False)
    again = BlindTrial(folder, 1, 2)
    again.seal()
    found = again.run(1).to_json()
    assert (found["cases"], found["correct"], found["false_alarms"]) == (2, 1, 1)
    assert len((folder / "cases.csv").read_text().splitlines()) == 3
    assert (folder / "evidence.csv").read_text() == (
        "kind,log_odds,right\nnone,12.0,True\nunknown,12.0,False\n"
    )


def test_cases_of_many_logs_come_first(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trial, order = BlindTrial(folder, 5, 30), []
    trial.seal()

    def do(self: BlindTrial, number: int) -> None:
        order.append(len(self.folder.unseal(number).programs))
        self.folder.write_result(number, finished(number, right=True), None)

    monkeypatch.setattr(BlindTrial, "_run_case", do)
    trial.run(1)
    assert order == sorted(order, reverse=True)
    assert len(set(order)) > 1


def test_command_shows_the_table_and_writes_the_answer(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    done(folder, True, True)
    target = folder.parent / "answer.json"
    with pytest.raises(SystemExit) as stop:
        main(["blind-trial", "--cases", "2", "--out", str(folder), "--json", str(target)])
    assert stop.value.code == 0
    shown = capsys.readouterr()
    assert "Every case is right." in shown.out
    assert "2 answers sealed, SHA-256 of the manifest" in shown.err
    found = json.loads(target.read_text())
    assert found["schema"] == "blind-trial/1"
    assert found["confusion"] == {"none": {"none": 2}}


def diagnoses_of(process: int) -> list[str]:
    """Ids of the child processes that run a diagnosis."""
    of_threads = Path(f"/proc/{process}/task").glob("*/children")
    children = [child for listed in of_threads for child in listed.read_text().split()]
    return [
        child for child in children if "\0diagnose\0" in Path(f"/proc/{child}/cmdline").read_text()
    ]


@pytest.mark.slow
def test_ended_trial_leaves_no_diagnosis_behind(folder: Path) -> None:
    command = [sys.executable, "-m", "plant_emulator", "blind-trial", "--cases", "1"]
    trial = subprocess.Popen([*command, "--out", str(folder)], stderr=subprocess.PIPE, text=True)
    children: list[str] = []
    limit = time.monotonic() + 120.0
    while not children and time.monotonic() < limit:
        children = diagnoses_of(trial.pid)
        time.sleep(0.1)
    trial.terminate()
    _, errors = trial.communicate(timeout=30)
    assert children
    assert "the same command continues this trial" in errors
    assert not any(Path("/proc", child).exists() for child in children)


def test_command_refuses_a_folder_of_another_seed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    done(folder, True)
    with pytest.raises(SystemExit) as stop:
        main(["blind-trial", "--cases", "1", "--seed", "2", "--out", str(folder)])
    assert stop.value.code == 2
    assert capsys.readouterr().err.startswith("error: ")


def test_program_hash_follows_the_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from plant_emulator.workflows.blind_trial import folder as module

    assert (ROOT / "plant_emulator" / "solver" / "kernel.py").is_file()
    for package in ("plant_emulator", "register_maps"):
        (tmp_path / package).mkdir()
    source = tmp_path / "plant_emulator" / "laws.py"
    source.write_text("a = 1")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    before = program_hash()
    source.write_text("a = 2")
    assert program_hash() != before


@pytest.mark.slow
def test_a_bench_without_effect_is_diagnosed_unsealed_and_scored(
    folder: Path, nominal: ParameterSet
) -> None:
    """One whole case, the first of its seed without an effect."""
    trial = BlindTrial(folder, 2, 20)
    trial.seal()
    [number] = [k for k in range(20) if trial.folder.unseal(k).kind == "none"][:1]
    for other in set(range(20)) - {number}:
        trial.folder.write_result(other, finished(other, right=True), None)
    result = trial.run(1).results[number]
    assert result.error == ""
    assert result.verdict in {"none", "parameter"}
    assert not result.false_alarm
    assert result.evidence is not None
    assert np.isfinite(result.evidence)
