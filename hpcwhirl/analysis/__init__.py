"""Analysis of motion: whirl (Eq. 12), spectra, regimes, critical speeds (Eq. 13).

Every run has an energy ledger: energy + damping + impact - pulse - friction - rotation
= residual, which is 0 for the discrete scheme except for round-off, some 1e-12 of the
throughput. The words of a case follow only from numbers stored with them, so that
results can be relabelled with other thresholds (`regimes`). Whirl is determined in the
static frame, Z = (x_o + i y_o) exp(i Omega t): a wave that turns backward in the
rotating frame at 256 rad/s is forward in the static frame if Omega > 256 rad/s.

The results `late_friction` and `late_rotation` are the two energy inputs in a run's
window, its last 40 %: work of friction, and of the transport of contacts over the
deformed ring, -lambda Omega dw/dtheta. `stability` gives the growth of a linear model,
with all N tips held on the ring and sliding, one nodal diameter at a time.
`participation` reconstructs modal amplitudes q_k from the traces of tips and centre
alone; those of 1F and suspension differ from the integrated ones by less than 8 %
(`pytest tests/analysis/test_analysis.py -k integrated`).
"""
