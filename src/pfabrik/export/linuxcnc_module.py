"""A kinematics module for LinuxCNC: the machine's C, and the functions that LinuxCNC calls."""

from __future__ import annotations

from .export_c import c_source
from .machine_data import Machine
from .wording import comment

INVERSE = """\
int kinematicsInverse(const EmcPose *world, double *joints, const KINEMATICS_INVERSE_FLAGS *iflags,
                      KINEMATICS_FORWARD_FLAGS *fflags)
{
    const double turn = 57.295779513082323;
    double actuators[PFK_ACTUATORS];
    pfk_pose target, pose;
    int i;
    (void)iflags;
    (void)fflags;
    pfk_home(&pose);
    pfk_pose_rpy(world->tran.x, world->tran.y, world->tran.z, world->a / turn, world->b / turn, world->c / turn,
                 &target);
    if (pfk_ik(&target, &pose, actuators) != 0)
        return -1;
    for (i = 0; i < PFK_ACTUATORS; ++i)
        joints[i] = actuators[i] * pfk_shown[i];
    return 0;
}
"""

FORWARD = """\
int kinematicsForward(const double *joints, EmcPose *world, const KINEMATICS_FORWARD_FLAGS *fflags,
                      KINEMATICS_INVERSE_FLAGS *iflags)
{
    const double turn = 57.295779513082323;
    double actuators[PFK_ACTUATORS], angles[3];
    pfk_pose pose;
    int i;
    (void)iflags;
    (void)fflags;
    for (i = 0; i < PFK_ACTUATORS; ++i)
        actuators[i] = joints[i] / pfk_shown[i];
    /* from where it was; if that leads nowhere, from home */
    pfk_pose_rpy(world->tran.x, world->tran.y, world->tran.z, world->a / turn, world->b / turn, world->c / turn,
                 &pose);
    if (pfk_fk(actuators, &pose, 0) != 0) {
        pfk_home(&pose);
        if (pfk_fk(actuators, &pose, 0) != 0)
            return -1;
    }
    pfk_rpy(&pose, angles);
    world->tran.x = pose.p[0];
    world->tran.y = pose.p[1];
    world->tran.z = pose.p[2];
    world->a = angles[0] * turn;
    world->b = angles[1] * turn;
    world->c = angles[2] * turn;
    return 0;
}
"""

COMPONENT = """\
KINEMATICS_TYPE kinematicsType(void)
{
    return KINEMATICS_BOTH;
}

KINS_NOT_SWITCHABLE
EXPORT_SYMBOL(kinematicsType);
EXPORT_SYMBOL(kinematicsForward);
EXPORT_SYMBOL(kinematicsInverse);
MODULE_LICENSE("Dual MIT/GPL");

static int comp_id;

int rtapi_app_main(void)
{
    comp_id = hal_init("pfabrikkins");
    if (comp_id < 0)
        return comp_id;
    hal_ready(comp_id);
    return 0;
}

void rtapi_app_exit(void)
{
    hal_exit(comp_id);
}
"""


def module(machine: Machine) -> str:
    """A kinematics module for halcompile, around the machine's C."""
    mechanism = machine.mechanism
    angles = ["1.0" if driven.is_length else "57.295779513082323" for driven in machine.driven]
    return f"""\
/* A kinematics module for LinuxCNC: halcompile --install pfabrikkins.c, then loadrt pfabrikkins.
   Joints in this order: {comment(", ".join(mechanism.actuator_names))}.
   Lengths in {comment(mechanism.length_unit)}, angles in degrees.
   X, Y, Z are the reference point; A, B, C turn about x, y and z, in this order. */
#include "rtapi_app.h"
#include "hal.h"
#include "kinematics.h"

{c_source(mechanism)}
static const double pfk_shown[PFK_ACTUATORS] = {{{", ".join(angles)}}};

{INVERSE}
{FORWARD}
{COMPONENT}"""
