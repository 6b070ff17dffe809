"""The whole gateway: link, loop, recorder, what shows the run, and the signals that stop it.

The loop runs in the calling process, for which real time is requested. The recorder has a process
of its own, and so has the terminal. The terminal reads the status block, which every tick renews.
The first SIGINT, SIGTERM or SIGHUP asks for a ramp-down. A second one ends the process at once,
and the PLC's watchdog ramps down.
"""

import os
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from gateway.configuration.config import Config
from gateway.configuration.sections import RecordingConfig
from gateway.cycle.cycle import Output
from gateway.cycle.record import Tick
from gateway.cycle.supervisor import State
from gateway.errors import GatewayError
from gateway.link import tls
from gateway.link.plc import TcpLink
from gateway.monitoring import metrics, server, terminal
from gateway.monitoring.shared import Identity, Publisher
from gateway.reasons import BY_OPERATOR, Reason
from gateway.recordings.header import Header
from gateway.recordings.parts import SUFFIX, Keeping
from gateway.recordings.recorder import Job, Recorder
from gateway.runtime.companion import Companion
from gateway.runtime.loop import Loop, MonotonicClock
from gateway.runtime.notify import Notifier
from gateway.runtime.realtime import real_time
from register_maps.register_map import RegisterMap

AT_FAULT: Final = frozenset({State.CONNECT, State.ARMED, State.RAMPDOWN, State.SAFE})
"""States whose reason is a fault of the PLC; in ARMED it is a command that does not arrive."""
SECOND_SIGNAL_AFTER: Final = 1.0
"""[s] A second signal sooner than this repeats the first: some send to process and to group."""


@dataclass(frozen=True, kw_only=True)
class RunResult:
    """The result of a run. Times in seconds; reason : of its end, None: the operator ended it."""

    recording: Path
    reason: Reason | None
    cycles: int
    missed: int
    dropped: int
    latency: dict[str, float]
    lateness: dict[str, float]
    real_time: str


class _Stop:
    """Whether to stop: after a signal, or after a time."""

    def __init__(self, until: float | None) -> None:
        self._until = until
        self._first = 0.0
        self.asked = False

    def handle_signal(self, number: int, _frame: object) -> None:
        """Handle a signal: the first asks for a stop, the second ends at once."""
        now = time.monotonic()
        if self.asked and now - self._first > SECOND_SIGNAL_AFTER:
            raise GatewayError(f"stopped at once by a second {signal.Signals(number).name}")
        self._first = now if not self.asked else self._first
        self.asked = True

    def __call__(self) -> bool:
        return self.asked or (self._until is not None and time.monotonic() >= self._until)


def _never(output: Output) -> bool:  # noqa: ARG001 - only the operator ends this run
    return False


def _is_over(loop: Loop, over: Callable[[Output], bool]) -> bool:
    return loop.before_stop is not None and over(loop.before_stop)


def run(
    config: Config,
    register_map: RegisterMap,
    *,
    shadow: bool = False,
    duration: float | None = None,
    view: bool = True,
    log_format: str = "text",
    over: Callable[[Output], bool] = _never,
) -> RunResult:
    """Run the gateway until a signal, for a duration [s], or until `over` holds after a tick.

    shadow : write nothing; view : show the run on standard output
    log_format : form of its lines, one of gateway.monitoring.lines.LINES
    """
    plc = config.plc
    link = TcpLink(
        plc.host,
        plc.port,
        plc.unit,
        plc.timeout,
        settle=plc.settle,
        probe=register_map.measurement,
        tls=tls.context(plc),
    )
    granted = real_time() if config.loop.realtime else nullcontext("not asked for")
    with granted as real:
        started = time.monotonic()
        stop = _Stop(None if duration is None else started + duration)
        head = Header.of(config, register_map, started=started, shadow=shadow, real_time=real)
        job = Job(
            path=_new_file(config),
            header=head,
            keeping=_keeping(config.recording),
        )
        listener = _listener(config)
        with _signals(stop), closing(Recorder(job)) as recorder, ExitStack() as beside:
            publisher = beside.enter_context(Publisher(_identity(job, config)))
            if view and sys.stdout is not None:  # as `gateway run >&-`
                screen = Companion("screen", terminal.show_run, publisher.path, log_format)
                beside.enter_context(closing(screen))
            if listener is not None:
                with listener:
                    web = Companion("metrics", server.serve, publisher.path, listener)
                beside.enter_context(closing(web))
            loop = Loop(
                config=config,
                register_map=register_map,
                link=link,
                sink=recorder,
                clock=MonotonicClock(),
                shadow=shadow,
                observe=_both(publisher, beside.enter_context(closing(Notifier()))),
            )
            loop.run(lambda: stop() or _is_over(loop, over))
    return _result(loop, recorder, real)


def _both(publisher: Publisher, notifier: Notifier) -> Callable[[Tick], None]:
    """Function that shows every tick to the status block and to systemd."""

    def observe(tick: Tick) -> None:
        publisher(tick)
        notifier(tick)

    return observe


def _listener(config: Config) -> socket.socket | None:
    """Socket at which metrics are served, None: they are not. Raises ConfigError."""
    if config.metrics.address is None:
        return None
    metrics.require()
    return server.listen(config.metrics.address)


def _keeping(recording: RecordingConfig) -> Keeping:
    return Keeping(
        size=recording.rotate_size,
        time=recording.rotate_time,
        age=recording.keep_age,
        total=recording.keep_size,
    )


def _identity(job: Job, config: Config) -> Identity:
    header = job.header
    return Identity(
        pid=os.getpid(),
        title=header.title,
        date=header.date,
        period=header.config["loop"]["period_ms"] * 1e-3,
        version=header.versions["gateway"],
        recording=str(job.path),
        real_time=header.real_time,
        planned=None if config.program is None else config.program.duration,
    )


def _new_file(config: Config) -> Path:
    """Path of a new recording, named after the present time."""
    return Path(config.recording.dir) / f"{datetime.now(UTC):%Y%m%dT%H%M%S.%fZ}{SUFFIX}"


@contextmanager
def _signals(stop: _Stop) -> Iterator[None]:
    before = {
        number: signal.signal(number, stop.handle_signal)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def fault_of(before: Output | None) -> Reason | None:
    """Fault that ended a run, from the last output before the stop; None: the operator ended it."""
    if before is None or before.state not in AT_FAULT or before.reason in BY_OPERATOR:
        return None
    return before.reason


def _result(loop: Loop, recorder: Recorder, real: str) -> RunResult:
    return RunResult(
        recording=recorder.path,
        reason=fault_of(loop.before_stop),
        cycles=loop.cycles,
        missed=loop.missed,
        dropped=recorder.dropped,
        latency=loop.latency.summary(),
        lateness=loop.lateness.summary(),
        real_time=real,
    )
