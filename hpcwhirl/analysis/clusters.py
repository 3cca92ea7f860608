"""Clusters of points that are clearly separated, by single linkage; else one cluster.

Single linkage (`scipy.cluster.hierarchy`) joins points that no gap separates, so that
it follows clusters of any shape; scattered points around a cluster are joined to it
instead of forming their own. A partition counts only if its mean silhouette is "strong"
(Kaufman and Rousseeuw, Finding Groups in Data, 1990, Table 4: above 0.7) and if any two
clusters differ by more than a given tolerance; otherwise all points are one cluster.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

STRONG = 0.7  # least mean silhouette
FEWEST = 3  # least number of points of a cluster
MOST = 2000  # points whose distances are computed; others join the nearest one
WIDER = 2.5  # least ratio of the gap between two clusters to the widest inside either
CUTS = 12  # largest number of partitions tried, those at the widest gaps
NORMAL = 1.4826  # ratio of standard deviation to median absolute deviation, normal law
Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


def clusters(features: Floats) -> Ints:
    """Return the cluster of each point, (n,), numbered from 0 by decreasing size.

    Parameters
    ----------
    features : (n, d), d features, each in units of its smallest significant difference
    """
    count = len(features)
    if count < 2 * FEWEST:
        return np.zeros(count, dtype=np.intp)
    scaled = features
    chosen = np.arange(count)
    if count > MOST:
        chosen = np.sort(np.random.default_rng(0).permutation(count)[:MOST])
    found = _parted(scaled[chosen], features[chosen])
    return _by_size(_joined(scaled, chosen, found))


def _parted(scaled: Floats, features: Floats) -> Ints:
    """Return the labels of the best partition, (n,), zeros if none is good enough."""
    from scipy.cluster.hierarchy import fcluster, linkage
    from scipy.spatial.distance import pdist, squareform

    between = pdist(scaled)
    tree = linkage(between, "single")
    away = squareform(between)
    best, score = np.zeros(len(scaled), dtype=np.intp), STRONG
    for height in _gaps(tree):
        labels = fcluster(tree, np.nextafter(height, 0.0), criterion="distance")
        large = np.flatnonzero(np.bincount(labels) >= FEWEST)
        core = np.flatnonzero(np.isin(labels, large))
        labels = _joined(scaled, core, labels[core])
        if len(large) > 1 and _differ(features, labels):
            own = silhouette(away, labels)
            if own > score:
                best, score = labels, own
    return best


def _gaps(tree: Floats) -> Floats:
    """Return the heights in the tree at which clusters may be separated, widest first.

    At such a height both parts are large enough, and the gap between them is more than
    `WIDER` times any gap inside them.
    """
    count = len(tree) + 1
    size = np.concatenate([np.ones(count), tree[:, 3]])
    inside = np.concatenate([np.zeros(count), tree[:, 2]])
    parts = tree[:, :2].astype(int)
    good = (size[parts] >= FEWEST).all(axis=1)
    good &= tree[:, 2] > np.maximum(WIDER * inside[parts].max(axis=1), 1.0)
    return np.unique(tree[good, 2])[::-1][:CUTS]


def _joined(scaled: Floats, core: Ints, labels: Ints) -> Ints:
    """Return the label of every point, (n,): that of the nearest core point.

    Parameters
    ----------
    scaled : (n, d), all points
    core : (m,), indices of the core points
    labels : (m,), labels of the core points
    """
    from scipy.spatial import cKDTree

    found = np.empty(len(scaled), dtype=np.intp)
    found[core] = labels
    rest = np.setdiff1d(np.arange(len(scaled)), core)
    if len(rest):
        found[rest] = labels[cKDTree(scaled[core]).query(scaled[rest])[1]]
    return found


def _differ(features: Floats, labels: Ints) -> bool:
    """Return whether the medians of every two clusters are more than 1 apart."""
    middle = np.array([np.median(features[labels == k], axis=0)
                       for k in np.unique(labels)])  # fmt: skip
    apart = np.abs(middle[:, None] - middle[None]).max(axis=2)
    return bool((apart[np.triu_indices(len(middle), 1)] > 1.0).all())


def silhouette(away: Floats, labels: Ints) -> float:
    """Return the mean silhouette of two or more clusters.

    The silhouette of a point is (b - a) / max(a, b), with a its mean distance to the
    other points of its cluster and b the least of its mean distances to another
    cluster; 0 for the only point of a cluster (Rousseeuw, J. Comput. Appl. Math. 20,
    1987, 53-65).

    Parameters
    ----------
    away : (n, n), distances between points
    labels : (n,), cluster of each point
    """
    known, own = np.unique(labels, return_inverse=True)
    member = own[:, None] == np.arange(len(known))
    size, rows = member.sum(axis=0), np.arange(len(labels))
    total = away @ member
    inner = total[rows, own] / np.maximum(size[own] - 1, 1)
    mean = total / size
    mean[rows, own] = np.inf
    outer = mean.min(axis=1)
    widest = np.maximum(inner, outer)
    each = np.divide(outer - inner, widest, out=np.zeros(len(rows)), where=widest > 0)
    return float(np.where(size[own] > 1, each, 0.0).mean())


def _by_size(labels: Ints) -> Ints:
    """Return labels renumbered from 0 by decreasing size; in a tie by occurrence."""
    _, first, own, size = np.unique(
        labels, return_index=True, return_inverse=True, return_counts=True
    )
    rank = np.empty(len(size), dtype=np.intp)
    rank[np.lexsort([first, -size])] = np.arange(len(size))
    return np.asarray(rank[own])
