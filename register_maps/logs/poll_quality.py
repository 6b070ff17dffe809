"""Poll quality: how regularly a poller saw the samples of a PLC, from their times (pure)."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

SHOWN: Final = 4
"""Number of the periods that are told, the most frequent first."""


@dataclass(kw_only=True)
class PollQuality:
    """Quality of the polling of a PLC's samples.

    interval : time between two samples of the PLC [s]
    periods : number of times that a sample came so many intervals after the one before
    repeated : samples that were read again
    """

    interval: float
    periods: Counter[int] = field(default_factory=Counter)
    repeated: int = 0

    def count(self, steps: Iterable[float]) -> None:
        """Count the times between new samples [s]."""
        self.periods.update(max(1, round(step / self.interval)) for step in steps)

    @property
    def skipped(self) -> int:
        """Samples of the PLC that were not seen."""
        return sum((times - 1) * count for times, count in self.periods.items())

    def entries(self) -> Mapping[str, str]:
        """The numbers as texts by name, for the metadata of a file."""
        total = max(1, sum(self.periods.values()))
        told = [
            f"{1e3 * times * self.interval:g} ms {100.0 * count / total:.1f} %"
            for times, count in self.periods.most_common(SHOWN)
        ]
        return {
            "periods": ", ".join(told) or "none",
            "repeated samples": str(self.repeated),
            "skipped samples": str(self.skipped),
        }

    def __str__(self) -> str:
        found = self.entries()
        repeated, skipped = found["repeated samples"], found["skipped samples"]
        return f"polled every {found['periods']}; {repeated} samples repeated, {skipped} skipped"
