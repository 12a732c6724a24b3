"""Every threshold of the library, with its unit and the reason for its value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerances:
    """How exact things are. Lengths are relative to the mechanism's characteristic length L; angles are in radians.

    Attributes
    ----------
    position : pose and closure tolerance [L]. Machine precision leaves three decimal orders of room below it.
    rotation : rotation tolerance [rad], the same in angle.
    limit : excess up to which a limit counts as kept [L or rad].
    home_slack : how far home may lie outside its own limits [L or rad]: files are written with rounded numbers, so
        home on a bound must not be refused for its last digit.
    active : distance from a bound below which a limit is reported as active [L or rad]; above the inward margin that
        projected answers keep, below anything a machine could resolve.
    rotation_matrix : largest deviation of R^T R from I accepted in a target: matrices typed with 7 digits pass,
        scaled or sheared ones do not.
    alignment : sine of the angle up to which two axes of a description count as parallel, and offset [L] up to which
        points count as aligned: descriptions are often typed with four to six digits.
    """

    position: float = 1e-9
    rotation: float = 1e-9
    limit: float = 1e-9
    home_slack: float = 1e-9
    active: float = 1e-7
    rotation_matrix: float = 1e-6
    alignment: float = 1e-6


TOLERANCES = Tolerances()
