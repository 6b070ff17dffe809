"""The loop: in every period read, decode, step, encode, write, and push a record.

Deadlines are absolute, so that errors do not add up. A tick that overruns skips the deadlines that
it missed, keeps the phase and counts them. All later code uses measured times.

Only this module turns an error into an action. An error of the PLC (LinkError, CodecError) becomes
the fault of this tick's observation, on which the supervisor decides. Any other exception is a
mistake in this software: it ends all writing, so that the PLC's watchdog ramps down, and ends the
run as BugError.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from gateway.configuration.config import Config
from gateway.cycle.cycle import Observation, Output, initial, step
from gateway.cycle.record import NOTHING, Layout, Tick
from gateway.cycle.supervisor import State
from gateway.errors import BugError, GatewayError
from gateway.link.plc import READ_HOLDING, READ_INPUT, LinkError, PlcLink
from gateway.plausibility.relations import shares
from gateway.reasons import Reason
from gateway.runtime.timing import Histogram
from register_maps.codec import CodecError, Refusal, decode_measurement, encode_setpoint
from register_maps.register_map import RegisterMap
from register_maps.signals import Measurement

REFUSED: Final[dict[Refusal, Reason]] = {
    "range": Reason.OUT_OF_RANGE,
    "constant": Reason.TEST_WORD,
    "not finite": Reason.NOT_FINITE,
    "not a state": Reason.OUT_OF_RANGE,
    "not available": Reason.NOT_AVAILABLE,
    "words": Reason.WRONG_COUNT,
}


class Clock(Protocol):
    """Monotonic clock that can wait."""

    def now(self) -> float:
        """Time [s]."""

    def sleep_until(self, deadline: float) -> None:
        """Return at this time [s]."""


class MonotonicClock:
    """Monotonic clock of this computer."""

    def now(self) -> float:
        """Time [s]."""
        return time.monotonic()

    def sleep_until(self, deadline: float) -> None:
        """Return at this time [s]; time.sleep itself waits for an absolute time."""
        if (remaining := deadline - time.monotonic()) > 0.0:
            time.sleep(remaining)


class Sink(Protocol):
    """Receiver of records that never waits. dropped : records lost; failed : it takes no more."""

    dropped: int
    failed: bool

    def push(self, record: bytes) -> None:
        """Take one record without waiting."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Reading of a tick: words and their measurement, or the fault and the link's words for it."""

    words: tuple[int, ...] | None = None
    measurement: Measurement | None = None
    fault: Reason | None = None
    problem: str = ""


@dataclass(frozen=True, kw_only=True)
class Writing:
    """Write of a tick: words, whether the PLC confirmed them, or the fault."""

    words: tuple[int, ...] | None = None
    confirmed: bool = False
    fault: Reason | None = None


def _ignore(_: Tick) -> None:
    """Show no tick."""


class Loop:
    """One run of the gateway against one PLC.

    observe : is called with every tick after its write; may not wait
    before_stop : the last output before a stop was requested, None: there was none
    latency, lateness : histograms of all ticks
    cycles, missed : count of ticks and of missed deadlines
    """

    before_stop: Output | None = None

    def __init__(
        self,
        *,
        config: Config,
        register_map: RegisterMap,
        link: PlcLink,
        sink: Sink,
        clock: Clock,
        shadow: bool = False,
        observe: Callable[[Tick], object] = _ignore,
    ) -> None:
        self._config, self._map, self._link = config, register_map, link
        self._sink, self._clock, self._shadow = sink, clock, shadow
        self._observe = observe
        self._function = READ_INPUT if register_map.measurement.table == "input" else READ_HOLDING
        self._layout = Layout.of(register_map)
        self._state = initial(config, register_map)
        self._writing = Writing()
        self._before, self._latency = clock.now(), 0.0
        self.latency, self.lateness = Histogram(), Histogram()
        self.cycles = self.missed = self._overruns = 0

    def run(self, stop_requested: Callable[[], bool]) -> None:
        """Tick until a requested stop is complete, and close the connection.

        Raises BugError for a mistake in this software.
        """
        deadline, stopping = self._clock.now(), False
        try:
            while True:
                self._clock.sleep_until(deadline)
                stopping = stopping or stop_requested() or self._sink.failed
                output = self.tick(deadline, stop_requested=stopping)
                if not stopping:
                    self.before_stop = output
                elif output.state is State.OFF:
                    return
                deadline = self._next(deadline)
        except GatewayError:
            raise
        except Exception as error:
            raise BugError(f"tick {self.cycles}: {type(error).__name__}: {error}") from error
        finally:
            self._link.close()

    def tick(self, deadline: float, *, stop_requested: bool) -> Output:
        """Run one tick: read, step, write, record; deadline : at which the tick was due [s]."""
        woken = self._clock.now()
        reading = self._read()
        observation = Observation(
            now=self._clock.now(),
            measurement=reading.measurement,
            fault=reading.fault or self._writing.fault,
            shadow=self._shadow,
            stop_requested=stop_requested,
            overruns=self._overruns,
            latency=self._latency,
        )
        self._state, output = step(self._config, self._map, self._state, observation)
        unseen = self._writing.fault if reading.measurement is None else None
        self._writing = self._write(output, unseen)
        latency, lateness = self._clock.now() - woken, woken - deadline
        self._latency = latency
        self.latency.add(latency)
        self.lateness.add(lateness)
        tick = self._tick(observation, reading, output, latency=latency, lateness=lateness)
        self._sink.push(self._layout.pack(tick))
        self._observe(tick)
        self._before = observation.now
        self.cycles += 1
        return output

    def _next(self, deadline: float) -> float:
        """Next deadline in the future [s]; the deadlines before it count as missed."""
        period = self._config.loop.period
        late = max(0, int((self._clock.now() - deadline) / period))
        self.missed += late
        self._overruns = self._overruns + late if late else 0
        return deadline + (late + 1) * period

    def _read(self) -> Reading:
        """Read the measurement; read a torn image again, because the next scan is whole."""
        try:
            self._link.connect()
            reading = self._read_once()
            whole = reading.measurement
            if whole is not None and whole.sequence_start != whole.sequence_end:
                reading = self._read_once()
        except LinkError as error:
            return Reading(fault=error.reason, problem=str(error))
        return reading

    def _read_once(self) -> Reading:
        block = self._map.measurement
        words = self._link.read(block.start, block.count, self._function)
        try:
            return Reading(words=words, measurement=decode_measurement(self._map, words))
        except CodecError as error:
            return Reading(words=words, fault=REFUSED[error.kind])

    def _write(self, output: Output, unseen: Reason | None) -> Writing:
        """Write the command block, unless there is none or the run is in shadow mode.

        unseen : fault of the write before, which the fault of this tick's reading has hidden
        """
        if output.setpoint is None or self._shadow:
            return Writing(fault=unseen)
        try:
            words = encode_setpoint(self._map, output.setpoint)
        except CodecError:
            return Writing(fault=Reason.NOT_ENCODABLE)
        try:
            self._link.write(self._map.command.start, words)
        except LinkError as error:
            return Writing(words=words, fault=error.reason)
        return Writing(words=words, confirmed=True)

    def _tick(
        self,
        observation: Observation,
        reading: Reading,
        output: Output,
        *,
        latency: float,
        lateness: float,
    ) -> Tick:
        writing = self._writing
        return Tick(
            tick=self.cycles,
            now=observation.now,
            period=observation.now - self._before,
            lateness=lateness,
            latency=latency,
            age=output.age,
            demand=output.demand,
            missed=self.missed,
            overruns=observation.overruns,
            dropped=self._sink.dropped,
            fault=NOTHING if observation.fault is None else observation.fault,
            reason=NOTHING if output.reason is None else output.reason,
            state=output.state,
            shadow=self._shadow,
            stop_requested=observation.stop_requested,
            written=writing.confirmed,
            words_read=reading.words,
            words_written=writing.words,
            measurement=reading.measurement,
            setpoint=output.setpoint,
            problem=reading.problem,
            implausible=shares(self._state.watched.relations, self._state.watched.sensors),
        )
