"""The control channel: a JSON object a line, request and answer, for who started the emulator.

    {"do": "remote", "on": true}             the operator's switch
    {"do": "interlock", "open": ["GUARD"]}   exactly these are open (names of Interlock)
    {"do": "faults", "names": ["nan@2.5"]}   exactly these faults, from now or from a PLC time on
    {"do": "step", "scans": 10}              scan so many times (an emulator that is only stepped)
    {"do": "status"}                         PLC time, state, alarms, last refusal, speeds, pace,
                                             stages of the bench that did not settle
    {"do": "log"}                            what was logged so far, SI, one list a signal
    {"do": "stop"}                           end, as SIGTERM does

An answer is {"ok": ...} or {"error": "what is wrong"}. Here is what a request does; where the lines
come from, and where the answers go, is `serving.py`.
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
from plant_emulator.emulator.scan_timer import Pace
from plant_emulator.errors import EmulatorError
from register_maps.signals import Interlock


class RequestError(EmulatorError):
    """A request on the control channel that means nothing."""

    exit_code = 2


class Control:
    """Carries requests out on an emulator; `stop` is called for the request to end."""

    def __init__(self, emulator: Emulator, pace: Pace | None, stop: Callable[[], None]) -> None:
        self.emulator, self.pace, self.stop = emulator, pace, stop
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
        """Answer to one line, without its line end."""
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
        if self.pace is not None:
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
            "pace": asdict(self.pace.report()) if self.pace else None,
        }

    def _log(self, request: dict[str, Any]) -> dict[str, list[float]]:  # noqa: ARG002 - all requests have one signature
        log = self.emulator.log()
        return {"time": log.time.tolist(), **{k: v.tolist() for k, v in log.signals.items()}}

    def _stop(self, request: dict[str, Any]) -> None:  # noqa: ARG002 - all requests have one signature
        self.stop()
