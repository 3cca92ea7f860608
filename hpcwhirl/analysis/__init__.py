"""Analysis of motion: whirl (Eq. 12), spectra, regimes, critical speeds (Eq. 13).

Every run keeps an energy ledger: energy + damping + impact - pulse - friction -
rotation = residual, exact for the discrete scheme (some 1e-12 of the throughput). The
words of a case follow only from numbers stored with them, so that results can be
relabelled with other thresholds (`regimes`). Whirl is judged in the static frame, Z
= (x_o + i y_o) exp(i Omega t): a wave that runs backward in the rotating frame at 256
rad/s is forward in the static frame when Omega > 256 rad/s.

`late_friction` and `late_rotation` are the two energy inputs late in a run: friction,
and the transport of contacts over the deformed ring, -lambda Omega dw/dtheta.
`stability` checks the measured growth by a linear model: all N tips held on the ring,
sliding, one nodal diameter at a time. `participation` reconstructs modal amplitudes q_k
from the traces of tips and centre alone; of 1F and suspension they differ from the
integrated ones by less than 8 % (`pytest tests/analysis/test_analysis.py -k
integrated`).
"""
