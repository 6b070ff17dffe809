"""Runs a blind trial: seals all cases, then simulates, diagnoses, unseals and scores each.

Several cases run at once, and each diagnosis is a process. Results are on disk, so an interrupted
trial continues with the cases that are not finished.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor, as_completed
from time import perf_counter
from typing import TYPE_CHECKING

from plant_emulator import logs, parameter_sets
from plant_emulator.blind import laws, table
from plant_emulator.blind.closed_fraction import true_closed_fraction
from plant_emulator.blind.draw import draw
from plant_emulator.blind.generate import measure, simulate_truth
from plant_emulator.blind.orthogonal_norm import norms
from plant_emulator.blind.score import Unsealed, score
from plant_emulator.blind.summary import TrialAnswer
from plant_emulator.diagnosis.report import document
from plant_emulator.errors import EmulatorError
from plant_emulator.solver.kernel import kernel, use_own_effects
from plant_emulator.workflows.blind_trial.examiner import Examiner
from plant_emulator.workflows.blind_trial.folder import Folder, program_hash, write

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from plant_emulator.blind.case import Case
    from plant_emulator.signals.log import Log
    from plant_emulator.workflows.blind_trial.examiner import Outcome

    Progress = Callable[[str, float], None]


class BlindTrial:
    """A trial of `count` cases in its folder, which may already hold a part of it."""

    def __init__(self, path: Path, seed: int, count: int) -> None:
        self.seed, self.count, self.program = seed, count, program_hash()
        self.folder = Folder(path, seed, self.program)
        use_own_effects(*(laws.load(name) for name in laws.names()))
        self.nominal = parameter_sets.load()
        self._examiner = Examiner()

    def seal(self) -> str:
        """Draw and seal all cases; return the SHA-256 of the manifest with their hashes."""
        self.folder.seal([self._draw(number) for number in range(self.count)])
        return self.folder.manifest_hash

    def run(self, workers: int, progress: Progress | None = None) -> TrialAnswer:
        """Run the cases that are not finished, `workers` at once; return the answer of all."""
        open_cases = [k for k in range(self.count) if self.folder.read_result(k) is None]
        executor = ThreadPoolExecutor(workers)
        # The longest cases come first, because a long last case would leave workers idle.
        open_cases.sort(key=lambda number: len(self._draw(number).programs), reverse=True)
        waiting = [executor.submit(self._run_case, number) for number in open_cases]
        try:
            for done, future in enumerate(as_completed(waiting), start=1):
                future.result()
                if progress is not None:
                    progress(f"case {done} of {len(open_cases)}", done / len(open_cases))
        finally:
            self._examiner.stop()
            executor.shutdown(cancel_futures=True)
        return self._collect()

    def _draw(self, number: int) -> Case:
        return draw(self.seed, number, self.nominal, kernel().effects)

    def _run_case(self, number: int) -> None:
        """Simulate, diagnose, unseal and score one case."""
        self._check_program()
        begin = perf_counter()
        case = self._draw(number)
        truth = simulate_truth(case, self.nominal)
        outcome = self._examiner.diagnose(self._write_logs(case, truth))
        if self._examiner.stopped:
            return
        self._check_program()
        unsealed = self._unseal(number, truth, outcome)
        seconds = round(perf_counter() - begin, 1)
        result = score(unsealed, kernel().effects, seconds=seconds, error=outcome.error)
        self.folder.write_result(number, result, outcome.answer)

    def _write_logs(self, case: Case, truth: Sequence[Log]) -> list[Path]:
        """Write the measured logs of a case."""
        folder = self.folder.logs(case.number)
        files = [folder / f"{name}.csv.gz" for name in case.programs]
        for run, (log, file) in enumerate(zip(truth, files, strict=True)):
            logs.write(measure(case, log, run, self.nominal), file)
        return files

    def _unseal(self, number: int, truth: Sequence[Log], outcome: Outcome) -> Unsealed:
        """Unseal a case, which nobody has read since it was sealed, beside its diagnosis."""
        case = self.folder.unseal(number)
        answer = None if outcome.answer is None else document.from_json(outcome.answer)
        closed = None
        if answer is not None and outcome.saved is not None:
            closed = true_closed_fraction(answer, outcome.saved, truth)
        return Unsealed(
            case=case, norms=norms(case, truth, self.nominal), answer=answer, closed=closed
        )

    def _check_program(self) -> None:
        """Refuse to mix results of two programs."""
        if program_hash() != self.program:
            raise EmulatorError(
                f"{self.folder.path}: the program's source changed during the trial; the finished "
                "cases belong to the old source"
            )

    def _collect(self) -> TrialAnswer:
        """Read all results and write the tables."""
        found = [self.folder.read_result(number) for number in range(self.count)]
        results = tuple(result for result in found if result is not None)
        write(self.folder.path / "cases.csv", table.cases(results))
        write(self.folder.path / "evidence.csv", table.evidence_table(results))
        return TrialAnswer(
            results=results,
            seed=self.seed,
            manifest_sha256=self.folder.manifest_hash,
            program_sha256=self.program,
        )
