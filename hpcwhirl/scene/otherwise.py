"""Answers for words that users look up as if they were names of inputs."""

_UNIT = "it is a unit, which the text of a value may contain"
_LEFT_OUT = "it is not modelled; hpcwhirl manual trust lists what is left out"
_SHAFT = (
    "the shaft is modelled by springs, see centre_stiffness, suspension_damping, "
    "cross_coupling and stiffness_difference; by a table over speed, see bearing; or "
    "by a beam, see shaft"
)
OTHERWISE = {  # {word that users look up but that is no input: answer}
    "rpm": f'{_UNIT}: speed = "3000 rpm"',
    "mm": f'{_UNIT}: gap = "0.8 mm"',
    "kn": f'{_UNIT}: force = "30 kN"',
    "hz": f'{_UNIT}: support_frequency = "3 Hz"',
    "imbalance": 'it is the input unbalance: unbalance = "20 g mm"',
    "blade-off": "it is the input lost_blade, the number of the blade",
    "bearings": _SHAFT,
    **dict.fromkeys(
        ("coating", "wear"), "it is the input contact_law: hpcwhirl manual layer"
    ),
    "squeeze film": "it is film_viscosity, film_length, film_radius, film_clearance",
    **dict.fromkeys(
        ("temperature", "thermal", "seal", "aerodynamics", "flutter"),
        _LEFT_OUT,
    ),
}  # fmt: skip
