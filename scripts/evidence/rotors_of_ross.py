#!/usr/bin/env python3
"""What ROSS says of the rotors of `rotors.py`; it runs in an environment of its own.

    ROSS_PYTHON scripts/evidence/rotors_of_ross.py GIVEN.json FOUND.json

GIVEN: {name: {"example": function of ROSS} or {"rotor": data as in `rotor_table.py`}},
each with "speeds" (rad/s) and "unbalance" [node, kg m]. FOUND: {name: {"file": rotor
saved beside FOUND, "roots": at each speed [[growth, frequency], ...], "circles": at
each speed [forward, backward], m}}.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import ross

COEFFICIENTS = "kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"


def built(given: dict[str, Any]) -> Any:
    """Return the rotor of ROSS that plain data describe."""
    shaft = []
    for place, t in enumerate(given["tubes"]):  # one after the other
        material = ross.Material(
            name=f"m{place}", rho=t["density"], E=t["young"], G_s=t["shear"]
        )
        shaft.append(ross.ShaftElement(
            L=t["length"], idl=t["inner"][0], odl=t["outer"][0], idr=t["inner"][1],
            odr=t["outer"][1], material=material, shear_effects=t["sheared"],
            rotary_inertia=t["rotary"], gyroscopic=t["rotary"], n=place,
        ))  # fmt: skip
    disks = [
        ross.DiskElement(
            n=d["node"], m=d["mass"], Ip=d["polar"], Id=d["about_diameter"]
        )
        for d in given["disks"]
    ]
    bearings = []
    for b in given["bearings"]:
        table = np.array(b["rows"]).T
        own = dict(zip(COEFFICIENTS, table[1:].tolist(), strict=True))
        if len(table[0]) > 1:
            own["frequency"] = table[0].tolist()
        else:
            own = {name: values[0] for name, values in own.items()}
        bearings.append(ross.BearingElement(
            n=b["node"], n_link=b.get("to"), mxx=b.get("mass", 0.0), **own
        ))  # fmt: skip
    masses = [ross.PointMass(n=node, m=mass) for node, mass in given.get("masses", ())]
    return ross.Rotor(shaft, disks, bearings, point_mass_elements=masses or None)


def found_of(given: dict[str, Any], file: Path) -> dict[str, Any]:
    """Return what ROSS says of one rotor, and save the rotor in a file."""
    rotor = (
        getattr(ross, given["example"])()
        if "example" in given
        else built(given["rotor"])
    )
    rotor.save(file)
    speeds, (node, size) = given["speeds"], given["unbalance"]
    roots, circles = [], []
    for speed in speeds:
        own = rotor.run_modal(speed, num_modes=48, sparse=False)
        rates = -np.asarray(own.wn) * np.asarray(own.damping_ratio)
        roots.append(np.column_stack([rates, own.wd]).tolist())
        answer = rotor.run_unbalance_response(
            node, size, 0.0, frequency=np.array([speed])
        ).forced_resp
        x, y = np.asarray(answer).reshape(-1)[[6 * node, 6 * node + 1]]
        # X = Re(x e^{iwt}), Y = Re(y e^{iwt}): Z = f e^{iwt} + b e^{-iwt}
        circles.append([abs(x + 1j * y) / 2, abs(x - 1j * y) / 2])
    return {"file": str(file), "roots": roots, "circles": circles,
            "version": ross.__version__}  # fmt: skip


def main() -> int:
    """Read rotors from one file, write what ROSS says of them into another."""
    given, found = map(Path, sys.argv[1:])
    rotors = json.loads(given.read_text())
    answers = {
        name: found_of(one, found.with_name(f"rotor{place}.toml"))
        for place, (name, one) in enumerate(rotors.items())
    }
    found.write_text(json.dumps(answers))
    return 0


if __name__ == "__main__":
    sys.exit(main())
