"""What one integrated case leaves behind: samples, ledger, how it stopped."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LEDGER_TERMS = (
    "energy",  # kinetic + strain of both bodies at the end, J
    "damping",  # lost in modal damping, J, >= 0
    "pulse",  # work of the loading, J
    "impact",  # lost in inelastic impacts, J, >= 0
    "friction",  # work of friction on both bodies (rotation's share included), J
    "rotation",  # work of the rotation: -lambda * Omega * dw/dtheta and rigid casing, J
    "residual",  # energy + damping + impact - pulse - friction - rotation, J
)


@dataclass(frozen=True)
class Evidence:
    """What words are given by, at a rate of its own whatever is kept, see `beat_of`.

    Attributes
    ----------
    time : (b,), s
    centre : (b, 2), m, ROTATING frame: x_o, y_o
    rotor, casing : (b,), J, kinetic + strain energy of each body
    fed, friction, lost : (b,), J, cumulative works, as in `History`
    """

    time: Floats
    centre: Floats
    rotor: Floats
    casing: Floats
    fed: Floats
    friction: Floats
    lost: Floats

    @property
    def energy(self) -> Floats:
        """Energy of both bodies, (b,), J."""
        return self.rotor + self.casing


@dataclass(frozen=True)
class History:
    """Samples of one run at `time`; everything in SI units, every number finite.

    Attributes
    ----------
    time : (n,), s
    centre : (n, 2), m, ROTATING frame: x_o, y_o
    energy : (n,), J, kinetic + strain of both bodies
    impulse : (n,), N s, cumulative normal contact impulse of all blades
    fed : (n,), J, cumulative work of rotation and friction
    friction : (n,), J, its part by friction; the rest of `fed` is the transport of
        contacts over the deformed ring
    lost : (n,), J, cumulative damping and impact loss
    tips : (n, N, 2), m, rotating frame: radial, tangential; (0, N, 2) unless asked
    blade_impulse : (n, N), N s, cumulative per blade; (0, N) unless asked
    casing : (n, H + 1, 2), m, STATIC frame: c_h, s_h of the casing's radial
        displacement w = sum_h c_h cos(h theta) + s_h sin(h theta); (0, H + 1, 2)
        unless asked
    ledger : {term: J} over the whole run, see `LEDGER_TERMS`; where that is not finite
        any more, at the last row of evidence
    gap_error : largest difference between gaps as solved and gaps of the bodies, over
        the lengths that they are made of, of all rows of evidence in contact
    step_share : time step over the stability limit, of the faster body
    stop : "end", "amplitude", "nonfinite", "complementarity", or "certain" where the
        word was proved and no more was asked for
    steps : steps taken
    contacts : touchdowns of blades on the casing
    last_contact : s, the last instant with contact; -1 if there was none
    certificate : s, from when on no contact can recur; -1 if that is not certain
    certificate_reach : m, bound of all displacements from then on; below the gap
    centre_peak : m, greatest centre displacement of the evidence
    seconds : wall time in the kernel
    interval : s between samples
    contact_impulse : N s, normal impulse of all contacts of the run
    end : s, of the last step
    judged : what words are given by
    folds : sectors that move alike, of which one was marched; 1 for all of them
    """

    time: Floats
    centre: Floats
    energy: Floats
    impulse: Floats
    fed: Floats
    friction: Floats
    lost: Floats
    tips: Floats
    blade_impulse: Floats
    ledger: dict[str, float]
    gap_error: float
    step_share: float
    stop: str
    steps: int
    contacts: int
    last_contact: float
    certificate: float
    certificate_reach: float
    centre_peak: float
    seconds: float
    interval: float
    contact_impulse: float
    end: float
    judged: Evidence
    casing: Floats = field(default_factory=lambda: np.zeros((0, 1, 2)))
    folds: int = 1
