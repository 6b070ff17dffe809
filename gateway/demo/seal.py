"""A truth that is drawn by a seed and sealed: its hash is told before, its text afterwards.

The effects are those that the diagnosis names from runs without a truck, and that the regulator can
use. The salt keeps the few possible truths from being told by their hashes.
"""

import hashlib
import json
import random
from dataclasses import dataclass
from typing import Final

SIZES: Final = {
    "torque_sensor_offset": ("offset", 0.55, 1.0),
    "torque_sensor_gain": ("error", 0.066, 0.1),
    "torque_sensor_lag": ("time_constant", 0.02, 0.04),
    "gear_oil_temperature": ("viscosity_coefficient", 0.026, 0.03),
    "load_dependent_gear_loss": ("share", 0.04, 0.08),
    "drum_bearing_friction": ("coulomb", 30.0, 80.0),
}
"""Effect -> the parameter that is drawn, and its smallest and largest size [SI].

The smallest size leaves a trace in the demo's logs of which no parameter can follow a norm of 100,
in the noise (`plant-emulator detectability program1 program2 program3`). In 9353 samples of five
channels, at least one channel then shows 1.1 times its noise after the parameters were estimated
again: 5 (1.1^2 - 1) 9353 = 99^2. Below that, `diagnose` tells no share of the gap.

Parameters follow a cold oil further than their tangents show: 0.018 1/K left 1.05 times the noise,
0.98 with the oil. As the square of the size, that is 1.1 times the noise at 0.025 1/K.
"""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What a bench hides: an effect, its drawn parameter and value [SI], and the salt."""

    effect: str
    parameter: str
    value: float
    salt: str

    @property
    def text(self) -> str:
        """Text that is sealed."""
        return json.dumps(vars(self), sort_keys=True)

    @property
    def seal(self) -> str:
        """SHA-256 of the text."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def option(self) -> str:
        """The effect as `plant-emulator serve --effect` takes it; the rest has plausible sizes."""
        return f"{self.effect}:{self.parameter}={self.value!r}"


def draw(seed: int) -> Truth:
    """Truth of this seed."""
    drawn = random.Random(seed)
    effect = drawn.choice(sorted(SIZES))
    parameter, low, high = SIZES[effect]
    value = round(drawn.uniform(low, high), 5)
    return Truth(
        effect=effect, parameter=parameter, value=value, salt=f"{drawn.getrandbits(128):032x}"
    )
