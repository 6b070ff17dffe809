"""The control channel: requests and answers, one JSON object per line.

    {"do": "remote", "on": true}             turn the operator's remote switch
    {"do": "interlock", "open": ["GUARD"]}   open these members of Interlock, close the others
    {"do": "faults", "names": ["nan@2.5"]}   replace all faults; @ gives the PLC time they begin
    {"do": "step", "scans": 10}              run so many scans (only without a scan timer)
    {"do": "status"}                         PLC time, state, alarms, last refusal, speeds, timing,
                                             bench steps that did not converge
    {"do": "log"}                            the log so far: SI units, one list per signal
    {"do": "stop"}                           end the emulator, like SIGTERM

An answer is {"ok": ...} or {"error": "what is wrong"}. This module carries requests out.
`serving.py` reads the requests and writes the answers.
"""

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import reduce
from math import isfinite
from operator import and_
from typing import Any

from plant_emulator.emulator.emulator import Emulator
from plant_emulator.emulator.plc import faults
from plant_emulator.emulator.plc.surroundings import CLOSED
from plant_emulator.emulator.scan_timer import ScanTimer
from plant_emulator.errors import EmulatorError
from register_maps.signals import Interlock


class RequestError(EmulatorError):
    """A request on the control channel is unknown or cannot be carried out now."""

    exit_code = 2


class ControlChannel:
    """Carries out requests on an emulator.

    timer : None for an emulator that scans only on request
    stop : called when a request asks for the end
    """

    def __init__(
        self, emulator: Emulator, timer: ScanTimer | None, stop: Callable[[], None]
    ) -> None:
        self.emulator, self.timer, self.stop = emulator, timer, stop
        self._requests: dict[str, Callable[[dict[str, Any]], Any]] = {
            "remote": self._remote,
            "interlock": self._interlock,
            "faults": self._faults,
            "step": self._step,
            "status": self._status,
            "log": self._log,
            "stop": self._stop,
        }

    def answer(self, line: str) -> str:
        """Carry out one request line; return the answer line, without its line end."""
        try:
            return json.dumps({"ok": self._do(json.loads(line))})
        except (EmulatorError, ValueError, KeyError, TypeError) as error:
            return json.dumps({"error": f"{line.strip()}: {error}"})

    def _do(self, request: dict[str, Any]) -> Any:
        known = ", ".join(self._requests)
        if request.get("do") not in self._requests:
            raise RequestError(f"unknown request {request.get('do')!r}; known: {known}")
        return self._requests[request["do"]](request)

    def _remote(self, request: dict[str, Any]) -> None:
        emulator = self.emulator
        emulator.switches = replace(emulator.switches, remote=bool(request["on"]))

    def _interlock(self, request: dict[str, Any]) -> None:
        closed = reduce(and_, (~Interlock[name] for name in request["open"]), CLOSED)
        self.emulator.switches = replace(self.emulator.switches, interlock=closed)

    def _faults(self, request: dict[str, Any]) -> None:
        self.emulator.faults = tuple(faults.parse(text) for text in request["names"])

    def _step(self, request: dict[str, Any]) -> None:
        if self.timer is not None:
            raise RequestError("this emulator runs in real time; only a stepped one can be stepped")
        for _ in range(request["scans"]):
            self.emulator.scan()

    def _status(self, request: dict[str, Any]) -> dict[str, Any]:  # noqa: ARG002 - all requests have one signature
        plc = self.emulator.plc
        return {
            "time": plc.time,
            "state": plc.state.name,
            "remote": plc.switches.remote,
            "alarms": [alarm.name for alarm in plc.alarm],
            "refusal": plc.inbox.refusal,
            "command_age": plc.inbox.age(plc.time) if isfinite(plc.inbox.age(plc.time)) else None,
            "road_load_since": plc.road_load_since,
            "speed_reference": plc.reference,
            "motor_speed": float(plc.samples.motor_speed[-1]),
            "drum_speed": float(plc.samples.drum_speed[-1]),
            "unsettled": plc.bench.unsettled,
            "pace": asdict(self.timer.report()) if self.timer else None,
        }

    def _log(self, request: dict[str, Any]) -> dict[str, list[float]]:  # noqa: ARG002 - all requests have one signature
        log = self.emulator.log()
        return {"time": log.time.tolist(), **{k: v.tolist() for k, v in log.signals.items()}}

    def _stop(self, request: dict[str, Any]) -> None:  # noqa: ARG002 - all requests have one signature
        self.stop()
