"""A shaft with sections of two kinds, a disk and three places for bearings."""

SECTIONS_AND_DISK = {
    "sections": [
        {"length": 0.3, "outer": 0.08, "inner": 0.03},
        {"length": 0.5, "outer": 0.1, "outer_end": 0.07},
        {"length": 0.4, "outer": 0.07},
    ],
    "disks": [{"station": 2, "mass": 40.0, "polar": 0.9, "diametral": 0.5}],
}
