"""A rotor that is exported and read back: random scenes with it, before chaos."""

import numpy as np

from hpcwhirl.campaign.simulate import result_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli.export_model import arrays_of
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.store.hdf5 import write_arrays

SEED = 17
BASE = named_scene("mostly_damped")
ENGINES = ((9, 4, 27), (22, 10, 110))  # blades, elements, modes: a kernel for each
MODAL = (
    "omega", "damping_ratio", "modal_tip_radial", "modal_tip_tangential",
    "modal_centre",
)  # fmt: skip
MATRICES = ("mass", "stiffness", "damping", "tip_radial", "tip_tangential", "centre")
MORE = 1e-12  # of the gap: the twin
CHAOS = 1e-10  # difference of twins from which on numbers tell nothing
SAME = 1e-9
WAYS = {"whole": None, "modes": MODAL, "matrices": MATRICES}
NAMED = ("regime", "whirl", "folds")


def drawn(index):
    """Return the inputs of a scene, from its number alone."""
    random = np.random.default_rng([SEED, index])

    def between(low, high):
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    blades, elements, modes = ENGINES[index % len(ENGINES)]
    return {
        "blades": blades,
        "engine.rotor.elements": elements,
        "modes": modes,
        "centre": str(random.choice(["free", "free", "clamped"])),
        "speed": float(random.uniform(20.0, 520.0) * random.choice([1, 1, 1, -1])),
        "nodal_diameter": int(random.choice([0, 1, 1, 1, 2, 3])),
        "gap": between(5e-5, 4e-4),
        "friction": float(random.choice([0.0, 0.1, 0.2, 0.3])),
        "pulse": float(random.uniform(4e-4, 1e-3)),
        "casing.thickness": between(12e-3, 40e-3),
        "casing.damping": between(0.01, 0.2),
        "rotor.damping": between(2e-3, 0.05),
        "suspension_damping": float(random.choice([-1.0, between(0.01, 0.4)])),
        "rotor.centre_stiffness": between(5e6, 1e8),
        "rotor.taper": float(random.uniform(0.6, 1.0)),
        "time_step": 4e-6,
        "traces": "full",
        "interval": 4e-4,
        "duration": 1.0,
    }


def read_back(scene, path, way):
    """Export the rotor of a scene; return the scene with the rotor read back."""
    arrays, names = arrays_of(resolve(scene).model), WAYS[way]
    if names is not None:
        arrays = {f"rotor/{n}": arrays[f"rotor/{n}"] for n in names}
    write_arrays(path, arrays, {})
    return apply_settings(scene, {"file": str(path)})


def run(scene):
    """Return the words and folds of a run, its kernel, and its tips (n, N, 2)."""
    march = March(resolve(scene))
    history = march.run()
    row, kernel = result_of(march.case, history).row, march.scheme.kernel
    name = f"{kernel.__module__}.{kernel.__qualname__}"
    return [row[word] for word in NAMED], name, history.tips


def apart(one, other):
    """Return by sample (n,) how far tips differ over their largest motion so far."""
    count = min(len(one), len(other))
    miss = np.abs(one[:count] - other[:count]).max(axis=(1, 2))
    size = np.maximum.accumulate(np.abs(other[:count]).max(axis=(1, 2)))
    return miss / np.maximum(size, 1e-12)


def compared(index, folder, **more):
    """Return what a scene, its rotor read back and its twin have in common.

    Matrices are solved again; modes keep their bits, and so must motions.

    Returns
    -------
    way : by which the rotor was kept
    kernel, same, bits : whether kernels, words and folds, all bits are the same
    calm : share of the run before chaos: as long as the twin differs by less than CHAOS
    apart : largest difference of all tips until then, over their motion so far
    """
    scene, path = apply_settings(BASE, drawn(index) | more), folder / f"{index}.h5"
    way = list(WAYS)[index // 2 % len(WAYS)]
    twin = apply_settings(scene, {"gap": scene.gap * (1 + MORE)})
    scenes = scene, read_back(scene, path, way), twin
    words, kernels, tips = zip(*map(run, scenes), strict=True)
    chaotic = apart(tips[2], tips[0]) > CHAOS
    calm = int(np.argmax(chaotic)) if chaotic.any() else len(chaotic)
    return {
        "way": way, "kernel": kernels[0] == kernels[1], "same": words[0] == words[1],
        "bits": np.array_equal(tips[0], tips[1]), "calm": calm / len(chaotic),
        "apart": apart(tips[1], tips[0])[:calm].max(initial=0.0),
    }  # fmt: skip


def sound(record):
    """Return whether a scene is the same but for what chaos explains."""
    bits = record["bits"] or record["way"] == "matrices"
    explained = record["same"] or record["calm"] < 1.0
    return record["kernel"] and bits and explained and record["apart"] <= SAME
