"""A calibration as a picture: the residuals after it, and the changes of the parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.checks import require_method
from ...common.drawing import SMALL, new_figure
from .calibration import Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BEFORE, AFTER = "#b0b0b0", "#0b5fa5"
MOST_NAMED = 45
"""Parameters whose names are written; more would not be legible."""


def plot_calibration(calibration: Calibration) -> Figure:
    """Residuals of every measurement before and after, and changes of the parameters with their deviations.

    Changes are in the scale of each parameter (L, 1 rad, or of a dimension its size or what moves a joint so far), so
    that they fit one axis; those that the data leave open have hollow markers.

    Parameters
    ----------
    calibration : Calibration
        What `calibrate` returned.

    Raises
    ------
    MissingLibrary
        Matplotlib is not installed.
    """
    require_method("calibration", calibration, "suggest", "a Calibration, as `calibrate` returns")
    figure = new_figure(7.0, 2.4 + 0.13 * min(len(calibration.names), MOST_NAMED))
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.2))
    _residuals(left, calibration)
    _changes(right, calibration)
    figure.suptitle(f"{calibration._parameters.mechanism.name}: calibration", fontsize=SMALL + 2.0)
    return figure


def _residuals(ax: Axes, calibration: Calibration) -> None:
    before, after = calibration.sizes
    rows = np.arange(1, len(after) + 1)
    ax.plot(rows, before, "o", color=BEFORE, markersize=3.0, label=f"before, rms {calibration.rms_before:.3g}")
    ax.plot(rows, after, "o", color=AFTER, markersize=3.0, label=f"after, rms {calibration.rms:.3g}")
    ax.set_yscale("log")
    ax.set_xlabel("measurement", fontsize=SMALL)
    ax.set_ylabel(f"residual [{calibration.residual_unit}]", fontsize=SMALL)
    ax.tick_params(labelsize=SMALL)
    above: dict[str, Any] = {
        "loc": "lower left",
        "bbox_to_anchor": (0.0, 1.0),
        "borderaxespad": 0.0,
        "ncols": 2,
        "columnspacing": 1.0,
    }
    ax.legend(fontsize=SMALL, frameon=False, handletextpad=0.1, **above)


def _changes(ax: Axes, calibration: Calibration) -> None:
    own = calibration._parameters
    changes = (calibration.values - own.values) / own.scales
    spread = np.where(np.isfinite(calibration.deviations), calibration.deviations / own.scales, 0.0)
    places = np.arange(len(own))
    for place, change, width, determined in zip(places, changes, spread, calibration.determined, strict=True):
        face = AFTER if determined else "white"
        ax.errorbar(
            change,
            place,
            xerr=width,
            fmt="o",
            color=AFTER,
            markerfacecolor=face,
            markersize=3.0,
            elinewidth=0.8,
            capsize=1.5,
        )
    ax.locator_params(axis="x", nbins=4)
    ax.axvline(0.0, color=BEFORE, linewidth=0.8)
    if len(own) <= MOST_NAMED:
        ax.set_yticks(places, own.names, fontsize=SMALL - 1.0)
    ax.invert_yaxis()
    hollow = "" if calibration.determined.all() else " (hollow: not determined)"
    ax.set_xlabel(f"change, share of its scale{hollow}", fontsize=SMALL)
    ax.tick_params(axis="x", labelsize=SMALL)
