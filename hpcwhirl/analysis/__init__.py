"""Reading motion: whirl (Eq. 12), spectra, regimes, critical speeds (Eq. 13).

Every run keeps an energy ledger: energy + damping + impact - pulse - friction -
rotation = residual, exact for the discrete scheme (some 1e-12 of the throughput). Words
follow from numbers that are stored beside them and from nothing else, so that they can
be given anew with other thresholds (`regimes`). Whirl is judged in the static frame, Z
= (x_o + i y_o) exp(i Omega t): a wave that runs backward in the rotating frame at 256
rad/s is forward in the static frame when Omega > 256 rad/s.

`late_friction` and `late_rotation` say what feeds a motion: friction, or the transport
of contacts over the deformed ring, -lambda Omega dw/dtheta. `stability` is a linear
check beside the measured growth: all N tips held on the ring, sliding, one nodal
diameter at a time. `participation` reads q_k from tips and centre alone; against the
modes that were integrated, 1F and suspension are off by less than 8 %
(`pytest tests/test_analysis.py -k integrated`).
"""
