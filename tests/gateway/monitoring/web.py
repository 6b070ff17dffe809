"""A web server over a published status, for tests that ask it."""

import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from prometheus_client.parser import text_string_to_metric_families

from gateway.cycle.record import Tick
from gateway.monitoring.server import listen, make_server
from gateway.monitoring.shared import Observer, Publisher
from tests.gateway.monitoring.identities import IDENTITY


class Web:
    """A server over a published status."""

    def __init__(self, publisher: Publisher) -> None:
        self.publisher = publisher
        self.server = make_server(Observer(publisher.path), listen("127.0.0.1:0"))
        self.url = f"http://127.0.0.1:{self.server.server_port}/"
        self.ticks = 0

    def publish(self, made: Tick) -> None:
        self.publisher(replace(made, tick=self.ticks, now=time.monotonic()))
        self.ticks += 1

    def get(self, path: str) -> tuple[int, str]:
        try:
            with urllib.request.urlopen(self.url + path, timeout=10) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.read().decode()

    def samples(self) -> dict[tuple[str, ...], float]:
        """Value of each sample by its name and the values of its labels."""
        _, text = self.get("metrics")
        return {
            (sample.name, *sample.labels.values()): sample.value
            for family in text_string_to_metric_families(text)
            for sample in family.samples
        }


@contextmanager
def serving() -> Iterator[Web]:
    with Publisher(IDENTITY) as publisher:
        made = Web(publisher)
        thread = threading.Thread(target=made.server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield made
        finally:
            made.server.shutdown()
            made.server.server_close()
            thread.join()
