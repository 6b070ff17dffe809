"""All constants of the search, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Sizes are in plausible sizes of an effect, gains in natural logarithms of probability."""

    # A column is local and nearly linear, and a law that bends shows at one of these sizes. All
    # effects are tried at the first size, and the best at the others too, but for those beside
    # effects that leave noise: they are faint. The largest one is the prior standard deviation of a
    # size in the rich model that noise is estimated beside.
    sizes: tuple[float, ...] = (0.3, 0.1, 1.0, 3.0)
    # So many effects of each score are tried at the other sizes; the true one was among three.
    tried_further: int = 6
    # Gain that an effect needs: odds of e^15, one of 30 effects by chance in 100 000 logs.
    needed: float = 15.0
    # Gain that one more effect needs: needless ones that no run refutes came to 35, or to 38 beside
    # other forms of the laws; true ones to 45 and 136.
    needed_again: float = 40.0
    # Share of what a set explains that one more effect must gain beside an approximate law, or by
    # which two effects beside it must differ: its error follows any other effect by chance, and
    # grows with what the law explains. Needless effects gained 3e-6 and 9e-6 of it (12 and 2 of
    # seed 118). Of the 39 pairs of detectable causes in the blind trials 113 to 118 one is nearer
    # (2.5e-7), the next one has 4.2e-5.
    law_error_along: float = 3e-5
    # Most effects of a set: nobody has told more than three causes apart in one set of logs.
    most_effects: int = 3
    # Relative error of an approximate law: other laws of the same effect differed by up to this. It
    # is the deviation of each form of the law.
    law_error: float = 0.1
    # Probability below which no chance makes the runs differ on a size, and the relative error of a
    # law in one run or half of one: where a slip or a presliding grows with the force, the halves
    # of a run differ by this from their mean. True second effects had 0.1 or more so, and needless
    # ones 2e-4 or less.
    agreement: float = 0.01
    run_error: float = 0.3
    # Leading effects of each score that are led along the measured outputs, or fitted beside
    # effects that leave noise: contact and limits move with the fit, so that the order by promise
    # is not yet that by fit.
    leaders: int = 3
    # Gain over the largest one that a rival needs: promised, along the measured outputs, or
    # reached. So much of what an effect needs must be predicted before it is fitted.
    rival_share: float = 0.5
    # Iterations of a first fit: of a rival, or of an effect whose state multiplies its size, enough
    # to tell a basin from a slope, and of a leader or along the measured outputs, enough to come
    # along the valley of the flux, which every voltage limit makes. Fits that may win go on.
    iterations: int = 5
    leader_iterations: int = 25
    # Cost above the best one's up to which a fit may still win [chi squared]. Where the best one
    # leaves more than noise, one that has not ended may win from further off.
    near: float = 100.0


SETTINGS = Settings()
