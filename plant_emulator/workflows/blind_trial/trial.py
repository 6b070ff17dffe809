"""The blind trial: seal all answers, then case by case write logs, diagnose, unseal, score.

Cases run side by side, each diagnosis as one process. What is done is on disk: an interrupted trial
goes on where it was.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor, as_completed
from time import perf_counter
from typing import TYPE_CHECKING, Any

from plant_emulator import logs, parameter_sets
from plant_emulator.blind import laws, score, summary, table
from plant_emulator.blind.detectable import norms
from plant_emulator.blind.draw import draw
from plant_emulator.blind.generate import measured, true_logs
from plant_emulator.blind.shrinkage import true_closed_fraction
from plant_emulator.errors import EmulatorError
from plant_emulator.solver.kernel import kernel, know
from plant_emulator.workflows.blind_trial.examiner import Examiner
from plant_emulator.workflows.blind_trial.folder import Folder, program_hash, write

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Progress = Callable[[str, float], None]


class Trial:
    """A trial in its folder; the folder may hold a part of it."""

    def __init__(self, path: Path, seed: int, count: int) -> None:
        self.seed, self.count, self.program = seed, count, program_hash()
        self.folder = Folder(path, seed, self.program)
        know(*(laws.load(name) for name in laws.names()))
        self.nominal = parameter_sets.load()
        self._examiner = Examiner()

    def seal(self) -> str:
        """Draw and seal all answers; the SHA-256 of the manifest that holds their hashes."""
        known = kernel().effects
        self.folder.seal([draw(self.seed, k, self.nominal, known) for k in range(self.count)])
        return self.folder.manifest_hash

    def run(self, workers: int, progress: Progress | None = None) -> list[dict[str, Any]]:
        """Do what is not done yet; the details of all cases."""
        left = [k for k in range(self.count) if self.folder.kept(k) is None]
        executor = ThreadPoolExecutor(workers)
        left.sort(key=self._logs, reverse=True)  # long ones last would leave workers idle
        waiting = [executor.submit(self._do, number) for number in left]
        try:
            for done, future in enumerate(as_completed(waiting)):
                future.result()
                if progress is not None:
                    progress(f"case {done + 1} of {len(left)}", (done + 1) / len(left))
        finally:
            self._examiner.stop()
            executor.shutdown(cancel_futures=True)
        return self._closed()

    def _logs(self, number: int) -> int:
        """How many logs a case has."""
        return len(draw(self.seed, number, self.nominal, kernel().effects).programs)

    def _do(self, number: int) -> None:
        """One case from its logs to its score."""
        self._unchanged()
        begun = perf_counter()
        case = draw(self.seed, number, self.nominal, kernel().effects)
        true = true_logs(case, self.nominal)
        place = self.folder.logs(number)
        files = [place / f"{name}.csv.gz" for name in case.programs]
        for run, (log, file) in enumerate(zip(true, files, strict=True)):
            logs.write(measured(case, log, run), file)
        found = self._examiner.diagnose(files)
        if self._examiner.stopped:
            return
        self._unchanged()
        case = self.folder.unseal(number)  # nobody has read it since it was sealed
        closed = None
        if found.answer is not None and found.saved is not None:
            closed = true_closed_fraction(found.answer, found.saved, true)
        unsealed = score.Unsealed(
            case=case,
            norms=norms(case, true, self.nominal),
            answer=found.answer,
            closed=closed,
        )
        detail = score.detail(unsealed, kernel().effects)
        detail |= {"seconds": round(perf_counter() - begun, 1), "error": found.error}
        self.folder.keep(number, {"detail": detail, "answer": found.answer})

    def _unchanged(self) -> None:
        """Refuse to mix answers of two programs."""
        if program_hash() != self.program:
            raise EmulatorError(
                f"{self.folder.path}: the program's source changed while the trial ran; what is "
                "done belongs to the old one"
            )

    def _closed(self) -> list[dict[str, Any]]:
        """All details, written as tables and as the answer."""
        found = [self.folder.kept(number) for number in range(self.count)]
        details = [result["detail"] for result in found if result is not None]
        path = self.folder.path
        write(path / "cases.csv", table.cases(details))
        write(path / "evidence.csv", table.evidence(details))
        return details

    def answer(self, details: list[dict[str, Any]]) -> dict[str, Any]:
        """The machine-readable answer."""
        return summary.answer(details, self.seed, self.folder.manifest_hash, self.program)
