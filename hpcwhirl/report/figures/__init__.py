"""Figures of motions, many speeds, engines and Sobol' indices; `kinds` lists them.

A line of cases is the numbers of cases that differ only in speed, in ascending order.
A case's row is {name of result: value}.

Figures over the speed: `frequency`, spectra of a tip and of the centre after revolution
5, rotating frame, mm; `cascade`, full spectra of the centre, static frame, backward < 0
< forward; `bifurcation`, position of the centre once a revolution; `interaction`, k
Omega +- omega_bd and +- n omega_c in the casing's frame (Eq. 13), with a strip of
regimes; `growth`, growth rates as measured and by linear theory, and the work of
friction and of transport over the losses. Figures of a case: `orbit`, `section`,
`ledger` (energy, losses, work of friction and of transport over time), `contributions`
(q_k of 1F, 2F and suspension, k = 0 ... N/2, m sqrt(kg)), `contacts` (which blade,
where on the casing, when, with what impulse), `loads` (force of each support and
torque of the drive over time).
"""
