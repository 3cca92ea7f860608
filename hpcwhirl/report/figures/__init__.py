"""Figures of motions, of many speeds, of engines, of indices; `kinds` lists them.

Over the speed: `frequency`, maps of a tip and of the centre after revolution 5,
rotating frame, mm; `cascade`, full spectrum of the centre, static frame, backward < 0 <
forward; `bifurcation`, the centre once a revolution; `interaction`, k Omega +- omega_bd
and +- n omega_c in the casing's frame, Eq. 13, over the regimes; `growth`, measured
beside that of closed contacts, friction and transport over losses. Of a case: `orbit`,
`section`, `ledger` (energy, losses, work of friction and of transport over time),
`contributions` (q_k of 1F, 2F and suspension, k = 0 ... N/2, m sqrt(kg)), `contacts`
(which blade, where on the casing, when, with what impulse).
"""
