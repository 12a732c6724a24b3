"""Inputs and results of the closure kernels: loops as paths of unit motions, problems and objectives.

Lengths are in units of L, the characteristic length; coordinates are deviations from home. Every path leads from the
base to the end effector. Paths that share joints form a group: with the platform fixed, groups move independently.
"""

from __future__ import annotations

from typing import NamedTuple

from ...common.arrays import Floats, Ints

# Axes that the weights of a rotation refer to: those of the base; those of the target, of which the first two turn its
# z axis (the tilt); or axes of which the third is half way between the z axes of base and platform. The platform yaws
# about this one: the gradient of the twist about z is along it.
BASE_AXES, TARGET_AXES, HALF_WAY = 0, 1, 2

# Unit motions: about an axis, along an axis, about a point.
TURN, SLIDE, BALL = 0, 1, 2


class Loops(NamedTuple):
    """A mechanism's paths, at home, in base coordinates."""

    kinds: Ints  # (units,)
    axes: Floats  # (units, 3)
    points: Floats  # (units, 3)
    columns: Ints  # (units,): first coordinate of each
    visits: Ints  # (visits, 2): unit, and +1 or -1 as the path passes it in its own direction or against it
    visit_rows: Ints  # (visits + 1,): first of the columns of the Jacobian that belong to a visit
    row_columns: Ints  # (rows,): the coordinate of each of them
    paths: Ints  # (paths + 1,): first visit of each path
    groups: Ints  # (groups + 1,): first path of each group
    group_of: Ints  # (columns,): group of each coordinate; the first for one on no path
    last_balls: Ints  # (paths,): 1 where a path that shares no joint ends with a ball joint
    end: Floats  # (3,): the reference point
    lo: Floats  # (columns,): ranges
    hi: Floats
    cone_units: Ints  # (cones, 2): first and last unit of the joint
    cone_axes: Floats  # (cones, 3)
    cone_lines: Floats  # (cones, 3): to the next joint
    cone_angles: Floats  # (cones,): half angles
    cone_outward: Ints  # (cones,): 1 if the axis is fixed to the joint's first body
    cone_slides: Ints  # (cones, 2): first and last of the slides that move the line
    slides: Ints  # coordinate of each such slide
    slide_axes: Floats  # (slides, 3): how it moves the line
    marks: Ints  # (marks, 2): visit before which a joint's centre is posed, and the place in ClosureProblem.centres
    path_marks: Ints  # (paths + 1,): first mark of each path


class Layout(NamedTuple):
    """Places of the free coordinates in the equations of their groups."""

    slots: Ints  # (columns,): place among the free coordinates of its group, or -1 if it is locked
    sizes: Ints  # (groups,): free coordinates of each group


class ClosureProblem(NamedTuple):
    """Conditions beyond closed loops, and settings of the iteration; lengths in L, angles in radians."""

    platform: Floats  # (6,): LOCKED for components of the pose, position then rotation, that are held; else 0
    frame: int  # the axes of this rotation: BASE_AXES, TARGET_AXES (those of the pose) or HALF_WAY
    centres: Floats  # (n, joints, 3): targets of joint centres; NaN for none
    limits: int  # 1: limits are to be kept
    margin: float  # distance inside the limits
    balls_follow: int  # 1: the ball joints of `last_balls` follow the platform; they are locked in the layout
    undamped: int  # 1: undamped steps, also uphill: finds more of many solutions, but not the nearest
    stays: int  # 1: undamped steps while these contract, so that the solution is the start's own
    patience: int  # steps in a row without progress that end the search; -1: none do
    closeness: float  # largest gap that ends the search
    max_iterations: int


LOCKED = 1e12


class Closed(NamedTuple):
    """Starts and results of closing loops, row by row."""

    coordinates: Floats  # (n, columns): of the start, then of the result
    poses: Floats  # (n, 4, 4): of the platform, at the start, then of the result
    gaps: Floats  # (n, groups): largest gap of a group's loops
    excesses: Floats  # (n, groups): largest excess over a limit
    misses: Floats  # (n, groups): largest distance of a joint centre from its target
    iterations: Ints  # (n,)


# Columns of FirstOrder.measures.
SERIAL, PARALLEL, CONSTRAINT, PASSIVE = 0, 1, 2, 3

# Values of FirstOrderPlan.outputs: Jacobians alone, Jacobians with all measures, joint rates.
JACOBIANS, MEASURES, JOINTS = 0, 1, 2


class FirstOrderPlan(NamedTuple):
    """Requested outputs, and the generic properties of a mechanism."""

    loops: Floats  # (loops, columns): orthonormal combinations of the loops
    path: Floats  # (columns,): sign of each joint on the path to the end effector; 0 off the path
    rates: Floats  # (columns, columns): orthonormal rates of every joint
    actuated: Ints  # (n_a,): columns of the actuators
    directions: Floats  # (twists, k): orthonormal twists that the end effector ever has
    rank: int  # of the loops' conditions
    shown: int  # number of motions that move the end effector or the actuators
    freedoms: int  # of the end effector
    least: float  # singular value up to which a direction counts as lost
    singular: float  # measure below which a configuration is singular
    outputs: int  # JACOBIANS, MEASURES or JOINTS


class FirstOrder(NamedTuple):
    """First-order results at n configurations, by orthonormal joint rates; lengths in L. No rows without a request."""

    forward: Floats  # (n, twists, n_a)
    inverse: Floats  # (n, n_a, twists)
    measures: Floats  # (n, 4)
    lost: Floats  # (n, twists): not yet unit vectors
    gained: Floats
    screws: Floats  # (n, columns, 6): velocity of the reference point, angular velocity
    motions: Floats  # (n, columns, motions): orthonormal, those that show most first
    sizes: Floats  # (n, motions): norm of each motion's twist and actuator rates
    joints: Floats  # (n, columns, n_a): rates per actuator rate
    closing: Floats  # (n, columns, conditions): the least rates that open loops


class PoseObjective(NamedTuple):
    """The objective of the end effector's pose; lengths in L."""

    targets: Floats  # (n, 4, 4)
    platform: Floats  # (6,): weights of the squares of position and rotation; 0 for free, LOCKED for held components
    frame: int  # part of the rotation that counts: all with BASE_AXES, the tilt with TARGET_AXES, yaw with HALF_WAY
    hold: int  # part that is held up to the price: HOLD_...
    price: float  # of its error [L per rad, or per L]; 0 without one
    rounding: float  # share of the distance that the price is rounded off by
    margin: float  # distance inside the limits that coordinates keep
    near: float  # limits farther away have no multipliers
    max_iterations: int


class Objective(NamedTuple):
    """The objective in joint coordinates: of the pose, and of distances from anchors; lengths in L."""

    pose: PoseObjective
    weights: Floats  # (columns,): of the squares of the coordinates' distances from their anchors
    anchors: Floats  # (n, columns)
