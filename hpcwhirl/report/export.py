"""One case for other programs: traces as CSV or for MATLAB, the wheel for ParaView.

Numbers are in SI, frames as in the results: the centre in the static frame, tips in the
rotating one. The wheel for ParaView is in the static frame, undeformed, with its
displacement as a vector at each point, which ParaView enlarges (Warp By Vector).
"""

from __future__ import annotations

import csv
import itertools
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.analysis.wheel_motion import Frames, frames_of
from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError, csv_cell
from hpcwhirl.scene import flatten
from hpcwhirl.scene.quantities import AXES, INPUTS, ROW, TRACES
from hpcwhirl.store.atomic import make_folders, replacing, telling
from hpcwhirl.store.reading.results_file import Results

NAMED: dict[str, Sequence[Any]] = {
    "xy": ("x", "y"), "component": ("radial", "tangential"), "phase": ("cos", "sin"),
}  # fmt: skip
FRAMES = 500  # largest number of frames of a wheel
ALONG, AROUND = 9, 181  # points of a blade from hub to tip, and of the casing


def write_csv(results: Results, case: int, path: Path) -> Path:
    """Write the traces of a case as CSV, a line for each sample; return the path."""
    columns = columns_of(results.traces(case))
    make_folders(path.parent)
    with telling(path), replacing(path) as part, part.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([csv_cell(name) for name in columns])
        writer.writerows(zip(*(c.tolist() for c in columns.values()), strict=True))
    return path


def columns_of(traces: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return traces as columns, {"tips 3 radial, m": (n,)}, the time first.

    traces : {name: (n, ...)}, with `time`
    """
    columns = {f"time, {AXES['time'].unit}": traces["time"]}
    for name, values in traces.items():
        if name == "time":
            continue
        known = TRACES[name]
        axes: list[Sequence[Any]] = [
            NAMED.get(axis, range(size))
            for axis, size in zip(known.axes, values.shape[1:], strict=True)
        ]
        flat = values.reshape(len(values), -1).T
        for place, column in zip(itertools.product(*axes), flat, strict=True):
            head = " ".join(map(str, (name, *place)))
            columns[f"{head}, {known.unit}"] = column
    return columns


def write_mat(results: Results, case: int, path: Path) -> Path:
    """Write traces, results and inputs of a case for MATLAB; return the path.

    The file has the structures `traces`, `results`, `inputs` and `units`; dots in the
    names of inputs become underscores.
    """
    from scipy.io import savemat

    traces = results.traces(case)
    row = {name: _plain(results[name][case]) for name in ROW if name in results}
    inputs = {
        name.replace(".", "_"): _plain(value)
        for name, value in flatten(results.scene(case)).items()
    }
    units = {name: known.unit for name, known in (ROW | TRACES).items()}
    units |= {name.replace(".", "_"): known.unit for name, known in INPUTS.items()}
    make_folders(path.parent)
    whole = {"traces": traces, "results": row, "inputs": inputs, "units": units}
    with telling(path), replacing(path) as part, part.open("wb") as file:
        savemat(file, whole, long_field_names=True, oned_as="column")
    return path


def _plain(value: Any) -> Any:
    """Return a value as a number, a text or an array of numbers."""
    own = value.item() if hasattr(value, "item") else value
    if isinstance(own, tuple | list):
        return np.array(own, dtype=float)
    return own


def write_wheel(results: Results, case: int, path: Path) -> Path:
    """Write the wheel of a case over time for ParaView; return the path of the list.

    A .pvd file lists a .vtu file for each frame, in a folder beside it.

    Raises
    ------
    InputError
        without the package meshio, or without full traces
    """
    try:
        import meshio
    except ModuleNotFoundError:
        msg = (
            "a file for ParaView needs the package meshio: pip install 'hpcwhirl[vtk]'"
        )
        raise InputError(msg) from None
    scene = results.scene(case)
    row = {name: results[name][case] for name in ("regime", "tip_growth")}
    frames = frames_of(scene, row, results.traces(case), FRAMES)
    hub = scene.engine.rotor.disk_radius / scene.engine.rotor.radius
    folder = path.with_name(f"{path.stem}_frames")
    make_folders(folder)
    listed = ET.Element("VTKFile", type="Collection", version="0.1")
    collection = ET.SubElement(listed, "Collection")
    for n, time in enumerate(frames.time.tolist()):
        points, moved, force = mesh_of(frames, n, scene.engine.rotor.radius, hub)
        name = folder / f"{n:04d}.vtu"
        data = {"displacement": moved, "force": force}
        meshio.write(name, meshio.Mesh(points, _cells(frames), data))
        file = f"{folder.name}/{name.name}"
        ET.SubElement(collection, "DataSet", timestep=f"{time:.9g}", file=file)
    with telling(path), replacing(path) as part:
        part.write_bytes(ET.tostring(listed, xml_declaration=True))
    return path


def mesh_of(
    frames: Frames, n: int, radius: float, hub: float
) -> tuple[Floats, Floats, Floats]:
    """Return the wheel and its casing in one frame: points, displacements, forces.

    Points are those of each blade from hub to tip, then those of the casing.

    Parameters
    ----------
    frames, n : the motion; number of the frame
    radius, hub : tip radius, m; radius of the hub over it

    Returns
    -------
    points : (p, 3), m, undeformed, turned, static frame; the casing at its gap
    moved : (p, 3), m, displacement of each
    force : (p,), N, normal force on each tip, 0 elsewhere
    """
    blades = frames.tips.shape[1]
    turned = np.exp(1j * (frames.angle[n] + 2 * np.pi * np.arange(blades) / blades))
    z = np.linspace(0.0, 1.0, ALONG)
    centre = (frames.centre[n] @ [1.0, 1j]) / turned
    tip = frames.tips[n] @ [1.0, 1j] - centre
    bent = 0.5 * z**2 * (3.0 - z)  # of a clamped beam that its tip bends
    own = centre[:, None] + np.outer(tip.real, z) + 1j * np.outer(tip.imag, bent)
    at = np.outer(turned, radius * (hub + z * (1.0 - hub)))
    theta = np.linspace(0.0, 2 * np.pi, AROUND)
    waves = theta[:, None] * np.arange(frames.wall.shape[1])
    wall = np.cos(waves) @ frames.wall[n, :, 0] + np.sin(waves) @ frames.wall[n, :, 1]
    ring = np.exp(1j * theta)
    points = np.concatenate([at.ravel(), (radius + frames.gap[n]) * ring])
    moved = np.concatenate([(turned[:, None] * own).ravel(), wall * ring])
    force = np.zeros(len(points))
    force[ALONG - 1 : blades * ALONG : ALONG] = frames.force[n]
    return _in_space(points), _in_space(moved), force


def _in_space(plane: Any) -> Floats:
    """Return complex points of the plane as (p, 3)."""
    return np.column_stack([plane.real, plane.imag, np.zeros(len(plane))])


def _cells(frames: Frames) -> list[tuple[str, Any]]:
    """Return the lines between the points of `mesh_of`; a lost blade has none."""
    blades = frames.tips.shape[1]
    there = [j for j in range(blades) if j != frames.lost]
    first = np.add.outer(ALONG * np.array(there), np.arange(ALONG - 1)).ravel()
    ring = blades * ALONG + np.arange(AROUND - 1)
    start = np.concatenate([first, ring])
    return [("line", np.column_stack([start, start + 1]))]


WRITERS: dict[str, Callable[[Results, int, Path], Path]] = {
    ".csv": write_csv, ".mat": write_mat, ".pvd": write_wheel,
}  # fmt: skip
