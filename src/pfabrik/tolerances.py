"""Every threshold of the library, with its unit and the reason for its value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerances:
    """All tolerances. Lengths are relative to the mechanism's characteristic length L; angles are in radians.

    Attributes
    ----------
    position : pose and closure tolerance [L]. Machine precision leaves three decimal orders of room below it.
    rotation : rotation tolerance [rad], the same in angle.
    exact : error [L or rad] up to which a pose is reached to rounding: searches that converge end below 2e-12, and what
        is reached to the tolerance alone is off by a hundredth of it and more.
    sized : extent [L or rad] of a map from which on it is not the tolerance of poses alone: across a line that a
        coordinate follows, this leaves a few times itself.
    unmoved : extent [L or rad] of a map below which a coordinate that follows others may seem to vary: it is missed by
        the square or the cube of the distance at first, of which the tolerance of poses leaves the root.
    limit : excess up to which a limit counts as kept [L or rad].
    inside : how far inside their limits answers are put [L or rad]: what is met to the last digit counts as
        kept. A range with less room than that on both sides, as of a locked joint, is kept in its middle.
    home_slack : how far home may lie outside its own limits [L or rad]: files are written with rounded numbers, so
        home on a bound must not be refused for its last digit.
    active : distance from a bound below which a limit is reported as active [L or rad]; above the inward margin that
        projected answers keep, below anything a machine could resolve.
    held : most that a projected answer may miss of the part of its target that it says it has [L or rad]: ends of
        searches for the nearest are that exact.
    holding : multiplier above which a limit holds an answer back: by how much of the distance it gives way the answer
        comes nearer, cosines of angles; below it there is the rounding of answers that touch a limit by chance.
    rotation_matrix : largest deviation of R^T R from I accepted in a target: matrices typed with 7 digits pass,
        scaled or sheared ones do not.
    alignment : sine of the angle up to which two axes of a description count as parallel, and offset [L] up to which
        points count as aligned: descriptions are often typed with four to six digits. For the same reason the
        singular value [L and rad] up to which a condition of the loops counts as following from the others.
    nearly_implied : singular value [L and rad] below which a condition of the loops at home is hardly one of its own:
        in machines that move, such conditions have 0.02 and more; directions written with three digits leave up to
        1e-3 of what should follow from others.
    implied : singular value [L and rad] up to which a condition of the loops at home follows from the others exactly:
        rounding leaves 1e-15. From 1e-11 on, searches for nearest poses take conditions that miss each other for ones
        to keep, and stop early: rods of a pair that differ by more are different rods, and may turn the platform.
    independent : conditioning [L and rad] below which coordinates of a task hardly vary independently: in machines that
        are made to set them they have 0.3 and more, and parasitic motions leave a few hundredths.
    speed : share by which an actuator may be faster than its limit: a path that just keeps it must not be refused for
        the rounding of its answers.
    rank : sine or singular value [L and rad] up to which a direction of motion counts as lost at a configuration: its
        loops are closed to 1e-9, so that below there is nothing but their error.
    singular : measure of singularity [L and rad] below which a configuration counts as singular: at the border of a
        workspace it grows with the square root of a length, so that 1e-9 of L leaves 3e-5.
    stretched : measure of singularity [L and rad] below which links count as stretched out or folded: it goes with the
        square root of a length, and what a search for the nearest pose leaves of a length is up to a millionth.
    file_gap : gap [L or rad] that the digits of another program's file may leave in loops that it says are closed: more
        is a machine that cannot be closed.
    file_digits : gap [L or rad] up to which loops may be open by the digits of a file, where these are known to explain
        it: three digits, added up over a chain of bodies, leave that much.
    file_angle : angle [rad] up to which axes in such a file may have been meant to be parallel: `1.57` is off by 8e-4.
    apart : least clearance that searches keep [L]: of links that touch no direction leads apart.
    same_mode : largest difference of positions [L] and rotation matrices of two solutions that count as one: where two
        solutions meet, closing the loops to 1e-13 places each to 3e-7 only.
    """

    exact: float = 5e-12
    sized: float = 1e-8
    unmoved: float = 2e-3
    position: float = 1e-9
    rotation: float = 1e-9
    limit: float = 1e-9
    inside: float = 1e-10
    home_slack: float = 1e-9
    active: float = 1e-7
    held: float = 1e-6
    holding: float = 1e-6
    rotation_matrix: float = 1e-6
    alignment: float = 1e-6
    nearly_implied: float = 1e-3
    implied: float = 1e-12
    independent: float = 5e-2
    apart: float = 1e-6
    same_mode: float = 1e-5
    speed: float = 1e-6
    rank: float = 1e-9
    singular: float = 1e-4
    stretched: float = 1e-3
    file_gap: float = 1e-4
    file_digits: float = 1e-2
    file_angle: float = 1e-3


TOLERANCES = Tolerances()
