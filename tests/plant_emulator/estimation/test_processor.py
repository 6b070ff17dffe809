"""Figures come from the processor's code that was asked for; `.ci/run` asks for two."""

import os

import scipy.linalg  # noqa: F401 - brings an OpenBLAS of its own
from threadpoolctl import threadpool_info


def test_linear_algebra_is_that_of_the_core_type_asked_for() -> None:
    asked = os.environ.get("OPENBLAS_CORETYPE")
    running = {
        one["architecture"] for one in threadpool_info() if one["internal_api"] == "openblas"
    }
    assert asked is None or running == {asked}
