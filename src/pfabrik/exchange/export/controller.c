/* What surrounds the kernels in every exported file. `source.py` puts the machine's constants, the kernels, tables and
   checks in place of the included files, keeps the blocks between #if and #endif whose conditions hold, and writes names
   and numbers with the prefix and in the precision asked for. `finite_results.py` has every function that returns a code
   compute in memory of its own and give what is finite: what it takes by a pointer it reads and writes, an array it
   writes alone. */

#ifndef PFK_H
#define PFK_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef double pfk_real;

typedef struct {
    pfk_real p[3];
    pfk_real R[3][3];
} pfk_pose;

/* Return codes: 0 on success, the number of the limit that is exceeded most, PFK_LEG + the number of a leg that does
   not reach or close, or one of those below. Whatever a function is asked, the numbers that it writes are finite; where
   a result is not it returns PFK_NOT_FINITE. */
enum {
    PFK_LEG = 1000,
#if CLEARANCE
    PFK_PAIR = 10000,      /* + the number of a pair of links, the nearest: they are nearer than PFK_CLEARANCE */
#endif
    PFK_NO_POSE = -1,      /* not finite, or not a rotation */
    PFK_NO_ACTUATORS = -2, /* not finite */
    PFK_OTHER_MODE = -3,   /* closed, but not in the working mode of home */
    PFK_PROJECTED = -4,    /* out of reach: the nearest feasible pose */
    PFK_NOT_FINITE = -10,  /* a result is not finite, for an argument is not, or is too large; nothing is written */
#if EFFORT
    PFK_GAINS_MOTION = -6, /* no forces: the loops let the machine move in more ways than elsewhere */
    PFK_NEVER_MADE = -7,   /* no forces: it cannot move so, at a serial singularity */
    PFK_LEFT_FREE = -8,    /* no forces: loads move a part without inertia that nothing holds */
    PFK_GIVES_WAY = -9,    /* no forces: the end effector moves with all actuators locked */
#endif
#if NEAREST
    PFK_JUMPED = -11,      /* the same, but no motion leads there from the last pose: drives jump */
#endif
    PFK_BUDGET = -5        /* steps were spent before the search ended: the nearest feasible pose so far, if any */
};

#include "machine.h"

/* What the last target that was answered tells of its answer: pfk_ik, pfk_nearest and pfk_ik_or_nearest fill it. */
typedef struct {
    int held;       /* of a target out of reach: 0 nothing, 1 its orientation, 2 its position; -1 if all is reached */
    int jumped;     /* 1 if no motion leads there from the last pose: drives jump */
    int steps;      /* of all searches, each a linearisation of the machine; 0 where legs answer in closed form */
    int stretched;  /* the number of a leg at its dead point there, if `holding` is asked for; 0 if there is none */
    pfk_real moved; /* the largest move of a drive since the last answer, or home [L or rad] */
} pfk_told;

#include "memory.h"

/* Fill the memory of calls: before all others, which read what it points to, and again where a machine begins anew at
   home. */
void pfk_begin(pfk_memory *memory);
/* The pose at home. */
void pfk_home(pfk_pose *pose);
/* A pose from a position and from turns about the fixed x, y and z axes, in this order [rad]. */
int pfk_pose_rpy(pfk_real x, pfk_real y, pfk_real z, pfk_real roll, pfk_real pitch, pfk_real yaw, pfk_pose pose[1]);
/* The angles of a pose: roll, pitch, yaw [rad]. */
int pfk_rpy(const pfk_pose *pose, pfk_real angles[3]);
/* The meaning of a return code, in words. */
const char *pfk_what(int code);
#if IK
/* Actuators for a target, a whole pose, what the task leaves out too. `pose` must hold a pose, the last one or home:
   what the task leaves open is completed from there, and `pose` becomes the pose reached. Nothing is written unless 0
   is returned. */
int pfk_ik(pfk_memory *memory, const pfk_pose *target, pfk_pose *pose, pfk_real actuators[PFK_ACTUATORS]);
#endif
#if NEAREST
/* The feasible pose nearest to a target: 0 where it is reached, PFK_PROJECTED, PFK_JUMPED, or PFK_BUDGET. `pose` must
   hold a feasible pose, the last one or home: the search starts there, and it becomes the nearest, with its actuators;
   nothing is written where none is found. The search takes at most `steps` steps, a dozen mostly, from there and from
   each of up to `starts` more places, of PFK_STARTS; 0 in a control loop: less than `steps` x (`starts` + 2) together,
   and as many again to tell if drives jump; or at most `memory->most_steps`. `memory->told` says more of the answer.
   `holding`, which may be 0, is filled with 1 for the limits, of PFK_LIMITS, that the pose is at: none where legs are stretched, at dead points. */
int pfk_nearest(pfk_memory *memory, const pfk_pose *target, pfk_pose *pose, pfk_real *actuators, int steps, int starts,
                char *holding);
/* What a control loop calls: pfk_ik, and pfk_nearest where that has no answer. */
int pfk_ik_or_nearest(pfk_memory *memory, const pfk_pose *target, pfk_pose *pose, pfk_real *actuators, int steps,
                      int starts, char *holding);
#endif
#if LIVE
/* A machine that a stream of targets drives: whatever they are, every tick ends at a feasible pose, no drive is faster
   than it may, and nothing leaps. `pfk_live_begin` lets the machine rest at a feasible pose, with the most that its
   drives may [length or rad, per s and per s2], where an acceleration of 0 is no limit; it fills where they are then.
   It returns what pfk_limits does, or PFK_NO_ACTUATORS for a speed that is not positive; nothing begins unless 0 is
   returned. `pfk_live_tick` goes on for `dt` seconds, to the nearest pose that drives get to in time: 0 where that is
   the target, else PFK_PROJECTED; for a target that is no pose drives slow down, and PFK_NO_POSE is returned, with
   where they are. Limits come before accelerations. */
int pfk_live_begin(pfk_memory *memory, const pfk_pose *pose, const pfk_real speeds[PFK_ACTUATORS],
                   const pfk_real accelerations[PFK_ACTUATORS], pfk_real actuators[PFK_ACTUATORS]);
int pfk_live_tick(pfk_memory *memory, const pfk_pose *target, pfk_real dt, pfk_pose pose[1],
                  pfk_real actuators[PFK_ACTUATORS]);
#endif
#if TURNS
/* Adds whole turns to actuators that may turn more than once: nearest to those before. */
int pfk_count_turns(pfk_memory *memory, const pfk_real before[PFK_ACTUATORS], pfk_real *now);
#endif
#if LIMITS
/* Fills the slack of a whole pose in each of PFK_LIMITS limits, negative beyond it [length or rad]. */
int pfk_limits(pfk_memory *memory, const pfk_pose *pose, pfk_real slack[]);
#endif
#if CLEARANCE
/* The least distance between two links of a whole pose, negative where they overlap, and the number of their pair, from
   1; where it is less than PFK_CLEARANCE, PFK_PAIR + this number is returned. Nothing is written where legs do not
   reach or close. */
int pfk_clearance(pfk_memory *memory, const pfk_pose *pose, pfk_real distance[1], int *pair);
#endif
#if BODIES
/* Fills the displacements from home of the bodies in the list at the top, at a whole pose: what is at x at home is at
   R x + p. Returns what pfk_limits does; where a leg is stretched, bodies are where it comes nearest. */
int pfk_bodies(pfk_memory *memory, const pfk_pose *pose, pfk_pose bodies[PFK_BODIES]);
#endif
#if EFFORT
/* The force or torque of each actuator [N, N m] at a whole pose that moves with a twist, the velocity of the reference
   point and the angular velocity, and with its change, the acceleration of that point and the angular one, in base
   coordinates; of these counts what the task sets. Gravity in m/s2, such as {0, 0, -9.80665}. Rotors and friction are
   included. Return codes are those of pfk_limits without its limits, or one that says why there are none; nothing is
   written unless 0 is returned. */
int pfk_effort(pfk_memory *memory, const pfk_pose *pose, const pfk_real twist[6], const pfk_real acceleration[6],
               const pfk_real gravity[3],
               pfk_real effort[PFK_ACTUATORS]);
#endif
#if FK
/* The pose at given actuators, by Newton's method from `pose`; `steps` may be 0, or is set to the number of its steps.
   Where it is led there in parts these may be hundreds: PFK_BUDGET is returned where `memory->most_steps` are spent.
   Limits are not checked. Nothing is written to `pose` unless 0, or PFK_OTHER_MODE, is returned. */
#if CLEARANCE
/* Where links are too near the pose is written too, and PFK_PAIR + the number of their pair returned. */
#endif
int pfk_fk(pfk_memory *memory, const pfk_real actuators[PFK_ACTUATORS], pfk_pose *pose, int *steps);
#endif
#if JOINTS
/* The pose at coordinates of the joints in series from the base to the end effector. */
int pfk_pose_at(pfk_memory *memory, const pfk_real joints[PFK_JOINTS], pfk_pose pose[1]);
#endif
#if TO_ACTUATORS
/* Actuators at joint coordinates; nothing is written unless 0 is returned. */
int pfk_to_actuators(pfk_memory *memory, const pfk_real joints[PFK_JOINTS], pfk_real actuators[PFK_ACTUATORS]);
#endif
#if TO_JOINTS
/* Joint coordinates at which actuators are, by Newton's method from those in `joints`; `steps` may be 0, or is set to
   their number. Limits are not checked. Nothing is written to `joints` unless 0 is returned. */
#if CLEARANCE
/* Where links are too near the coordinates are written too, and PFK_PAIR + the number of their pair returned. */
#endif
int pfk_to_joints(pfk_memory *memory, const pfk_real actuators[PFK_ACTUATORS], pfk_real *joints, int *steps);
#endif
#if RATES
/* Return codes are those of pfk_limits without its limits; nothing is written unless 0 is returned. A crank or carriage
   at its dead point has rate 0. */
#if JOINTS
typedef const pfk_real *pfk_at; /* joint coordinates; rates are those of the joints, torques also forces of slides */
#else
typedef const pfk_pose *pfk_at; /* a whole pose; rates are a twist: the velocity of the reference point and the angular
   velocity, in base coordinates, or the nearest that the legs allow; torques a force there and a moment */
#endif
/* Rates of actuators by each of the rates. */
int pfk_jacobian(pfk_memory *memory, pfk_at at, pfk_real jacobian[PFK_ACTUATORS][PFK_RATES]);
/* Rates of actuators, and back. */
int pfk_speeds(pfk_memory *memory, pfk_at at, const pfk_real rates[PFK_RATES], pfk_real speeds[PFK_ACTUATORS]);
int pfk_speeds_back(pfk_memory *memory, pfk_at at, const pfk_real speeds[PFK_ACTUATORS], pfk_real rates[PFK_RATES]);
/* Torques and forces of actuators, the least that give those wanted, and back: what they give. */
int pfk_torques(pfk_memory *memory, pfk_at at, const pfk_real wanted[PFK_RATES], pfk_real torques[PFK_ACTUATORS]);
int pfk_torques_back(pfk_memory *memory, pfk_at at, const pfk_real torques[PFK_ACTUATORS], pfk_real given[PFK_RATES]);
#endif

#ifdef __cplusplus
}
#endif

#endif

#ifndef PFK_DECLARATIONS_ONLY

#include "kernels.h"
#include "tables.h"

/* Results of a call until all are finite: what it does not write stays NaN. */
static void pfk_unset(void *results, int n)
{
    int i;
    for (i = 0; i < n; ++i)
        ((pfk_real *)results)[i] = (pfk_real)NAN;
}

static bool pfk_is_finite(const void *results, int n)
{
    int i;
    for (i = 0; i < n; ++i)
        if (!(fabs(((const pfk_real *)results)[i]) < (pfk_real)INFINITY))
            return false;
    return true;
}

static void pfk_give(const void *results, void *to, int n)
{
    int i;
    for (i = 0; i < n; ++i)
        ((pfk_real *)to)[i] = ((const pfk_real *)results)[i];
}

/* A pose as kernels take it. */
static pfk_Floats2 pfk_opened(const pfk_pose *pose, pfk_real at[16])
{
    pfk_Floats2 opened = {0, {4, 4}};
    int i, j;
    opened.data = at;
    for (i = 0; i < 3; ++i) {
        for (j = 0; j < 3; ++j)
            at[4 * i + j] = pose->R[i][j];
        at[4 * i + 3] = pose->p[i];
        at[12 + i] = 0.0;
    }
    at[15] = 1.0;
    return opened;
}

#if IK || FK || JOINTS || BODIES
static void pfk_close(const pfk_real at[16], pfk_pose *pose)
{
    int i, j;
    for (i = 0; i < 3; ++i) {
        for (j = 0; j < 3; ++j)
            pose->R[i][j] = at[4 * i + j];
        pose->p[i] = at[4 * i + 3];
    }
}

#endif
#if IK || FK || JOINTS || EFFORT
/* Numbers as kernels take them; those of the caller are only read where they are constants. */
static pfk_Floats1 pfk_opened_row(const pfk_real *values, int n)
{
    pfk_Floats1 opened = {0, {0}};
    opened.data = (pfk_real *)values;
    opened.n[0] = n;
    return opened;
}

#endif
void pfk_begin(pfk_memory *memory)
{
    unsigned char *bytes = (unsigned char *)memory;
    const unsigned char *from;
    const void *array;
    size_t i, k;
    for (i = 0; i < sizeof *memory; ++i)
        bytes[i] = 0;
    for (i = 0; i < sizeof pfk_places / sizeof *pfk_places; ++i) {
        array = bytes + PFK_UNIT * (size_t)pfk_places[i][1];
        from = (const unsigned char *)&array;
        for (k = 0; k < sizeof array; ++k)
            bytes[PFK_UNIT * (size_t)pfk_places[i][0] + k] = from[k];
    }
#include "filling.h"
#if IK
    for (i = 0; i < PFK_ACTUATORS; ++i)
        memory->actuators[i] = pfk_home_actuators[i];
#endif
}

void pfk_home(pfk_pose *pose)
{
    int i, j;
    for (i = 0; i < 3; ++i) {
        pose->p[i] = pfk_reference[i];
        for (j = 0; j < 3; ++j)
            pose->R[i][j] = i == j ? 1.0 : 0.0;
    }
}

int pfk_pose_rpy(pfk_real x, pfk_real y, pfk_real z, pfk_real roll, pfk_real pitch, pfk_real yaw, pfk_pose pose[1])
{
    const pfk_real cr = cos(roll), sr = sin(roll), cp = cos(pitch), sp = sin(pitch), cy = cos(yaw), sy = sin(yaw);
    pose->p[0] = x;
    pose->p[1] = y;
    pose->p[2] = z;
    pose->R[0][0] = cy * cp;
    pose->R[0][1] = cy * sp * sr - sy * cr;
    pose->R[0][2] = cy * sp * cr + sy * sr;
    pose->R[1][0] = sy * cp;
    pose->R[1][1] = sy * sp * sr + cy * cr;
    pose->R[1][2] = sy * sp * cr - cy * sr;
    pose->R[2][0] = -sp;
    pose->R[2][1] = cp * sr;
    pose->R[2][2] = cp * cr;
    return 0;
}

int pfk_rpy(const pfk_pose *pose, pfk_real angles[3])
{
    const pfk_real level = sqrt(pose->R[0][0] * pose->R[0][0] + pose->R[1][0] * pose->R[1][0]);
    angles[0] = atan2(pose->R[2][1], pose->R[2][2]);
    angles[1] = atan2(-pose->R[2][0], level);
    angles[2] = atan2(pose->R[1][0], pose->R[0][0]);
    return 0;
}

const char *pfk_what(int code)
{
    if (code == 0)
        return "reached";
    if (code == PFK_NO_POSE)
        return "not a pose";
    if (code == PFK_NO_ACTUATORS)
        return "actuators that are not finite";
    if (code == PFK_OTHER_MODE)
        return "closed, but not in the working mode of home";
    if (code == PFK_PROJECTED)
        return "out of reach: the nearest feasible pose";
#if NEAREST
    if (code == PFK_JUMPED)
        return "out of reach: the nearest feasible pose, to which no motion leads from the last";
#endif
    if (code == PFK_BUDGET)
        return "steps were spent before the search ended";
    if (code == PFK_NOT_FINITE)
        return "a result that is not finite";
#if EFFORT
    if (code == PFK_GAINS_MOTION)
        return "no forces: a constraint singularity";
    if (code == PFK_NEVER_MADE)
        return "no forces: the machine cannot move so here, at a serial singularity";
    if (code == PFK_LEFT_FREE)
        return "no forces: loads move a part without inertia that nothing holds";
    if (code == PFK_GIVES_WAY)
        return "no forces: the actuators do not hold the machine, at a parallel singularity";
#endif
#if LIMITS
    if (code > 0 && code <= PFK_LIMITS)
        return pfk_limit_words[code - 1];
#endif
#if CLEARANCE
    if (code > PFK_PAIR && code - PFK_PAIR <= PFK_PAIRS)
        return pfk_pair_words[code - PFK_PAIR - 1];
#endif
    if (code > PFK_LEG && code - PFK_LEG <= PFK_LEGS)
        return pfk_leg_words[code - PFK_LEG - 1];
    return "no code of this file";
}

#if IK
static void pfk_tell(pfk_memory *memory, const pfk_real actuators[PFK_ACTUATORS], int held, int jumped)
{
    pfk_real move;
    int i;
    if (!pfk_is_finite(actuators, PFK_ACTUATORS))
        return;
    memory->told.held = held;
    memory->told.jumped = jumped;
    memory->told.steps = memory->told.stretched = 0;
    memory->told.moved = 0.0;
    for (i = 0; i < PFK_ACTUATORS; ++i) {
        move = fabs(actuators[i] - memory->actuators[i]) / pfk_units[i];
        memory->told.moved = move > memory->told.moved ? move : memory->told.moved;
        memory->actuators[i] = actuators[i];
    }
}

static int pfk_ik_in(pfk_memory *memory, const pfk_pose *target, pfk_pose *pose, pfk_real actuators[PFK_ACTUATORS],
                     int attempts)
{
    pfk_real wanted[16], own[16];
    const int code = (int)pfk_reach(&memory->reaching, pfk_opened(target, wanted), pfk_opened(pose, own), attempts);
    if (code)
        return code;
    pfk_put_reached(&memory->reaching, pfk_opened(pose, own), pfk_opened_row(actuators, PFK_ACTUATORS));
    pfk_close(own, pose);
    pfk_tell(memory, actuators, -1, 0);
    return 0;
}

int pfk_ik(pfk_memory *memory, const pfk_pose *target, pfk_pose *pose, pfk_real actuators[PFK_ACTUATORS])
{
    return pfk_ik_in(memory, target, pose, actuators, PFK_ATTEMPTS);
}

#endif
#if NEAREST
int pfk_nearest(pfk_memory *memory, const pfk_pose *target, pfk_pose *pose, pfk_real *actuators, int steps, int starts,
                char *holding)
{
    pfk_real *const own = memory->projecting_start_poses;
    int i, code;
    starts = starts < 0 ? 0 : (starts > PFK_STARTS ? PFK_STARTS : starts);
    steps = steps < 1 ? 1 : (steps > 10000 ? 10000 : steps);
    code = (int)pfk_project_target(&memory->projecting, &memory->reaching,
                                   pfk_opened(target, memory->projecting_targets), pfk_opened(pose, own),
                                   pfk_opened_row(actuators, PFK_ACTUATORS), steps, starts,
                                   memory->most_steps > 0 ? memory->most_steps : 0);
    if (code == PFK_NO_POSE)
        return code;
    pfk_close(own, pose);
    if (memory->projecting_notes[0] > -2)
        pfk_tell(memory, actuators, (int)memory->projecting_notes[0], code == PFK_JUMPED);
    memory->told.steps = (int)memory->projecting_notes[1];
    for (i = 0; i < PFK_LIMITS && holding; ++i)
        holding[i] = 0;
    if (!holding || pfk_rest(&memory->reaching, pfk_opened(pose, own)) >= PFK_LEG)
        return code;
    memory->told.stretched = (int)pfk_stretched_leg(memory->reaching.near_, &memory->reaching.scratch);
    for (i = 0; i < PFK_LIMITS; ++i)
        holding[i] = memory->reaching_slack[i] <= PFK_ACTIVE * pfk_limit_units[i];
    return code;
}

int pfk_ik_or_nearest(pfk_memory *memory, const pfk_pose *target, pfk_pose *pose, pfk_real *actuators, int steps,
                      int starts, char *holding)
{
    int i, code = pfk_ik_in(memory, target, pose, actuators, 1);
    if (code && code != PFK_NO_POSE)
        return pfk_compute_nearest(memory, target, pose, actuators, steps, starts, holding);
    for (i = 0; i < PFK_LIMITS && holding; ++i)
        holding[i] = !code && memory->reaching_slack[i] <= PFK_ACTIVE * pfk_limit_units[i];
    return code;
}

#endif
#if LIVE
int pfk_live_begin(pfk_memory *memory, const pfk_pose *pose, const pfk_real speeds[PFK_ACTUATORS],
                   const pfk_real accelerations[PFK_ACTUATORS], pfk_real actuators[PFK_ACTUATORS])
{
    pfk_real own[16];
    int i;
    const int code = (int)pfk_begin_stream(&memory->streaming, &memory->reaching, pfk_opened(pose, own),
                                           pfk_opened_row(speeds, PFK_ACTUATORS),
                                           pfk_opened_row(accelerations, PFK_ACTUATORS));
    for (i = 0; i < PFK_ACTUATORS; ++i)
        actuators[i] = memory->streaming_live_actuators[i];
    return code;
}

int pfk_live_tick(pfk_memory *memory, const pfk_pose *target, pfk_real dt, pfk_pose pose[1],
                  pfk_real actuators[PFK_ACTUATORS])
{
    pfk_real own[16];
    int i;
    const int code = (int)pfk_drive_to(&memory->streaming, pfk_opened(target, own), dt);
    for (i = 0; i < PFK_ACTUATORS; ++i)
        actuators[i] = memory->streaming_live_actuators[i];
    pfk_close(memory->streaming_live_pose, pose);
    return code;
}

#endif
#if TURNS
int pfk_count_turns(pfk_memory *memory, const pfk_real before[PFK_ACTUATORS], pfk_real *now)
{
    pfk_put_turns(&memory->reaching, pfk_opened_row(before, PFK_ACTUATORS), pfk_opened_row(now, PFK_ACTUATORS));
    return 0;
}

#endif
#if LIMITS
int pfk_limits(pfk_memory *memory, const pfk_pose *pose, pfk_real slack[])
{
    pfk_real own[16];
    const int code = (int)pfk_rest(&memory->reaching, pfk_opened(pose, own));
    int i;
    for (i = 0; i < PFK_LIMITS; ++i)
        slack[i] = code < 0 || (code >= PFK_LEG && code < 10 * PFK_LEG) ? slack[i] : memory->reaching_slack[i];
    return code;
}

#endif
#if CLEARANCE
int pfk_clearance(pfk_memory *memory, const pfk_pose *pose, pfk_real distance[1], int *pair)
{
    pfk_real own[16];
    int code = (int)pfk_rest(&memory->reaching, pfk_opened(pose, own));
    if (code < 0 || (code >= PFK_LEG && code < PFK_PAIR))
        return code;
    *pair = 1 + (int)pfk_measure(&memory->reaching);
    *distance = memory->reaching_distance[0] * PFK_SIZE;
    return memory->reaching_distance[0] >= pfk_reaching_links_least[0] - pfk_KEPT ? 0 : PFK_PAIR + *pair;
}

#endif
#if BODIES
int pfk_bodies(pfk_memory *memory, const pfk_pose *pose, pfk_pose bodies[PFK_BODIES])
{
    pfk_real own[16];
    const int code = (int)pfk_put_bodies(&memory->reaching, pfk_opened(pose, own));
    int i, j;
    for (i = 0; i < PFK_BODIES && code != PFK_NO_POSE; ++i) {
        pfk_close(memory->reaching_links_displaced + 16 * i, &bodies[i]);
        for (j = 0; j < 3; ++j)
            bodies[i].p[j] *= PFK_SIZE;
    }
    return code;
}

#endif
#if EFFORT
int pfk_effort(pfk_memory *memory, const pfk_pose *pose, const pfk_real twist[6], const pfk_real acceleration[6],
               const pfk_real gravity[3],
               pfk_real effort[PFK_ACTUATORS])
{
    pfk_real own[16];
    return (int)pfk_put_exerted(&memory->driving, &memory->reaching, pfk_opened(pose, own), pfk_opened_row(twist, 6),
                                pfk_opened_row(acceleration, 6), pfk_opened_row(gravity, 3),
                                pfk_opened_row(effort, PFK_ACTUATORS));
}

#endif
#if FK
int pfk_fk(pfk_memory *memory, const pfk_real actuators[PFK_ACTUATORS], pfk_pose *pose, int *steps)
{
    pfk_real own[16];
    int code;
    memory->assembling_scratch_steps[1] = memory->most_steps;
    code = (int)pfk_assemble(&memory->assembling, &memory->reaching, pfk_opened_row(actuators, PFK_ACTUATORS),
                             pfk_opened(pose, own));
    if (code && memory->most_steps > 0 && memory->assembling_scratch_steps[0] >= memory->most_steps)
        code = PFK_BUDGET;
    if (steps)
        *steps = (int)memory->assembling_scratch_steps[0];
    pfk_close(own, pose);
    return code;
}

#endif
#if JOINTS
int pfk_pose_at(pfk_memory *memory, const pfk_real joints[PFK_JOINTS], pfk_pose pose[1])
{
    if (!pfk_walk(&memory->series, pfk_opened_row(joints, PFK_JOINTS)))
        return PFK_NO_POSE;
    pfk_close(memory->series_pose, pose);
    return 0;
}

#endif
#if TO_ACTUATORS
int pfk_to_actuators(pfk_memory *memory, const pfk_real joints[PFK_JOINTS], pfk_real actuators[PFK_ACTUATORS])
{
    pfk_pose pose;
    pfk_real own[16];
    int code;
    if (!pfk_walk(&memory->series, pfk_opened_row(joints, PFK_JOINTS)))
        return PFK_NO_POSE;
    pfk_close(memory->series_pose, &pose);
    code = (int)pfk_rest(&memory->reaching, pfk_opened(&pose, own));
    if (code)
        return code;
    pfk_put_reached(&memory->reaching, pfk_opened(&pose, own), pfk_opened_row(actuators, PFK_ACTUATORS));
    return 0;
}

#endif
#if TO_JOINTS
int pfk_to_joints(pfk_memory *memory, const pfk_real actuators[PFK_ACTUATORS], pfk_real *joints, int *steps)
{
    int code;
    memory->assembling_scratch_steps[1] = memory->most_steps;
    code = (int)pfk_put_joints(&memory->series, &memory->assembling, &memory->reaching,
                               pfk_opened_row(actuators, PFK_ACTUATORS), pfk_opened_row(joints, PFK_JOINTS));
    if (code && memory->most_steps > 0 && memory->assembling_scratch_steps[0] >= memory->most_steps)
        code = PFK_BUDGET;
    if (steps)
        *steps = (int)memory->assembling_scratch_steps[0];
    return code;
}

#endif
#if RATES
#if JOINTS
int pfk_jacobian(pfk_memory *memory, pfk_at at, pfk_real jacobian[PFK_ACTUATORS][PFK_RATES])
{
    pfk_pose pose;
    pfk_real own[16];
    int i, j, k, code;
    if (!pfk_walk(&memory->series, pfk_opened_row(at, PFK_JOINTS)))
        return PFK_NO_POSE;
    pfk_close(memory->series_pose, &pose);
    code = (int)pfk_put_rates(&memory->rating, &memory->reaching, pfk_opened(&pose, own), 1, PFK_TURNING);
    for (i = 0; i < PFK_ACTUATORS && !code; ++i)
        for (j = 0; j < PFK_JOINTS; ++j)
            for (jacobian[i][j] = 0.0, k = 0; k < 6; ++k)
                jacobian[i][j] +=
                    memory->rating_drives[i * PFK_COLUMNS + k] * memory->series_twists[k * PFK_JOINTS + j];
    return code;
}
#else
int pfk_jacobian(pfk_memory *memory, pfk_at at, pfk_real jacobian[PFK_ACTUATORS][PFK_RATES])
{
    pfk_real own[16];
    const int code = (int)pfk_put_rates(&memory->rating, &memory->reaching, pfk_opened(at, own), 0, PFK_TURNING);
    int i, j;
    for (i = 0; i < PFK_ACTUATORS && !code; ++i)
        for (j = 0; j < 6; ++j)
            jacobian[i][j] = memory->rating_drives[i * PFK_COLUMNS + j];
    return code;
}
#endif

/* Takes orthonormal vectors (`count` of them, `width` numbers each) off v, once more where most of it goes; fills their
   shares; the length left. */
static pfk_real pfk_off_basis(const pfk_real *basis, int count, int width, pfk_real *v, pfk_real *shares)
{
    pfk_real share[6], size = 0.0, before;
    int j, k, again;
    for (k = 0; k < count; ++k)
        shares[k] = 0.0;
    for (j = 0; j < width; ++j)
        size += v[j] * v[j];
    for (again = 0; count && again < 2; ++again) {
        for (k = 0; k < count; ++k)
            for (share[k] = 0.0, j = 0; j < width; ++j)
                share[k] += basis[k * width + j] * v[j];
        for (k = 0; k < count; ++k) {
            for (j = 0; j < width; ++j)
                v[j] -= share[k] * basis[k * width + j];
            shares[k] += share[k];
        }
        before = size;
        for (size = 0.0, j = 0; j < width; ++j)
            size += v[j] * v[j];
        if (size > 0.01 * before)
            break; /* no more than a digit has cancelled */
    }
    return sqrt(size);
}

/* A Jacobian, its lengths over L, as u t q: orthonormal rows q and columns u, `rank` of each, a triangle t. */
typedef struct {
    int rank;
    pfk_real u[PFK_RATES][PFK_ACTUATORS], t[PFK_RATES][PFK_RATES], q[PFK_RATES][PFK_RATES];
} pfk_factors;

static pfk_real pfk_per_unit(int actuator)
{
    return 1.0 / pfk_units[actuator];
}

static void pfk_put_factors(pfk_real jacobian[PFK_ACTUATORS][PFK_RATES], pfk_factors *own)
{
    pfk_real row[PFK_RATES], shares[PFK_RATES], left[PFK_ACTUATORS][PFK_RATES], size, whole;
    int i, j, k;
    own->rank = 0;
    for (i = 0; i < PFK_ACTUATORS; ++i) {
        whole = 0.0;
        for (j = 0; j < PFK_RATES; ++j) {
            row[j] = jacobian[i][j] * (pfk_rate_units[j] * pfk_per_unit(i));
            whole += row[j] * row[j];
            left[i][j] = 0.0;
        }
        size = pfk_off_basis(&own->q[0][0], own->rank, PFK_RATES, row, shares);
        for (k = 0; k < own->rank; ++k)
            left[i][k] = shares[k];
        if (own->rank < PFK_RATES && size > PFK_RANK * sqrt(whole)) {
            left[i][own->rank] = size;
            for (j = 0; j < PFK_RATES; ++j)
                own->q[own->rank][j] = row[j] * (1.0 / size);
            ++own->rank;
        }
    }
    for (k = 0; k < own->rank && own->rank == PFK_ACTUATORS; ++k) { /* a triangle: put upside down it is t */
        for (i = 0; i < own->rank; ++i) {
            own->u[k][i] = i == own->rank - 1 - k ? 1.0 : 0.0;
            own->t[k][i] = left[own->rank - 1 - k][own->rank - 1 - i];
        }
        for (j = 0; j < PFK_RATES && 2 * k < own->rank; ++j) {
            size = own->q[k][j];
            own->q[k][j] = own->q[own->rank - 1 - k][j];
            own->q[own->rank - 1 - k][j] = size;
        }
    }
    for (k = 0; k < own->rank && own->rank < PFK_ACTUATORS; ++k) {
        for (i = 0; i < PFK_ACTUATORS; ++i)
            own->u[k][i] = left[i][k];
        size = pfk_off_basis(&own->u[0][0], k, PFK_ACTUATORS, own->u[k], shares);
        for (j = 0; j < k; ++j)
            own->t[j][k] = shares[j];
        own->t[k][k] = size;
        for (i = 0; i < PFK_ACTUATORS; ++i)
            own->u[k][i] /= size;
    }
}

int pfk_speeds(pfk_memory *memory, pfk_at at, const pfk_real rates[PFK_RATES], pfk_real speeds[PFK_ACTUATORS])
{
    pfk_real jacobian[PFK_ACTUATORS][PFK_RATES];
    int i, j, code = pfk_jacobian(memory, at, jacobian);
    for (i = 0; i < PFK_ACTUATORS && !code; ++i)
        for (speeds[i] = 0.0, j = 0; j < PFK_RATES; ++j)
            speeds[i] += jacobian[i][j] * rates[j];
    return code;
}

int pfk_torques_back(pfk_memory *memory, pfk_at at, const pfk_real torques[PFK_ACTUATORS], pfk_real given[PFK_RATES])
{
    pfk_real jacobian[PFK_ACTUATORS][PFK_RATES];
    int i, j, code = pfk_jacobian(memory, at, jacobian);
    for (j = 0; j < PFK_RATES && !code; ++j)
        for (given[j] = 0.0, i = 0; i < PFK_ACTUATORS; ++i)
            given[j] += jacobian[i][j] * torques[i];
    return code;
}

int pfk_torques(pfk_memory *memory, pfk_at at, const pfk_real wanted[PFK_RATES], pfk_real torques[PFK_ACTUATORS])
{
    pfk_real jacobian[PFK_ACTUATORS][PFK_RATES], z[PFK_RATES];
    pfk_factors own;
    int i, j, k, code = pfk_jacobian(memory, at, jacobian);
    if (code)
        return code;
    pfk_put_factors(jacobian, &own);
    for (i = 0; i < PFK_ACTUATORS; ++i)
        torques[i] = 0.0;
    for (k = 0; k < own.rank; ++k) {
        z[k] = 0.0;
        for (j = 0; j < PFK_RATES; ++j)
            z[k] += own.q[k][j] * wanted[j] * pfk_rate_units[j];
        for (j = 0; j < k; ++j)
            z[k] -= own.t[j][k] * z[j];
        z[k] /= own.t[k][k];
        for (i = 0; i < PFK_ACTUATORS; ++i)
            torques[i] += z[k] * own.u[k][i] * pfk_per_unit(i);
    }
    return 0;
}

int pfk_speeds_back(pfk_memory *memory, pfk_at at, const pfk_real speeds[PFK_ACTUATORS], pfk_real rates[PFK_RATES])
{
    pfk_real jacobian[PFK_ACTUATORS][PFK_RATES], z[PFK_RATES];
    pfk_factors own;
    int i, j, k, code = pfk_jacobian(memory, at, jacobian);
    if (code)
        return code;
    pfk_put_factors(jacobian, &own);
    for (j = 0; j < PFK_RATES; ++j)
        rates[j] = 0.0;
    for (k = own.rank - 1; k >= 0; --k) {
        z[k] = 0.0;
        for (i = 0; i < PFK_ACTUATORS; ++i)
            z[k] += own.u[k][i] * speeds[i] * pfk_per_unit(i);
        for (j = k + 1; j < own.rank; ++j)
            z[k] -= own.t[k][j] * z[j];
        z[k] /= own.t[k][k];
        for (j = 0; j < PFK_RATES; ++j)
            rates[j] += z[k] * own.q[k][j] * pfk_rate_units[j];
    }
    return 0;
}

#endif
#if IK
#ifdef PFK_SELF_TEST

#include <stdio.h>

#if CHECKED
/* A pose, the actuators there, whether those are within all limits, and whether forward kinematics leads there from
   home. */
#if CLEARANCE
/* And the least distance between its links. */
#endif
typedef struct {
    pfk_pose target;
    pfk_real actuators[PFK_ACTUATORS];
    int kept, led;
#if CLEARANCE
    pfk_real distance;
#endif
} pfk_check;

#if FAR_CHECKS
/* A target out of reach, and how far the reference point of its nearest pose is from it. */
typedef struct {
    pfk_pose target;
    pfk_real distance;
} pfk_far_check;

#endif
#if TORQUE_CHECKS || EFFORT_CHECKS
/* A pose, a force and moment there or a twist that is its change too, and the torques or forces of the actuators. */
typedef struct {
    pfk_pose pose;
    pfk_real twist[6], actuators[PFK_ACTUATORS];
} pfk_load_check;

#endif
#include "checks.h"

static int pfk_wrong;

/* Counts what differs from the library's answer by more than it may, and prints by how many times. */
static void pfk_compare(const char *what, int row, pfk_real found, pfk_real expected, pfk_real most)
{
    const pfk_real off = fabs(found - expected) / most;
    if (off <= 1.0)
        return;
    printf("%s %d: %ld times farther off than it may be\n", what, row, off < 1e9 ? (long)off : 1000000000L);
    ++pfk_wrong;
}

static void pfk_compare_codes(const char *what, int row, int is_right, int code)
{
    if (is_right)
        return;
    printf("%s %d: %s\n", what, row, pfk_what(code));
    ++pfk_wrong;
}

#if FAR_CHECKS
static void pfk_check_far(pfk_memory *memory)
{
    pfk_real actuators[PFK_ACTUATORS] = {0.0}, away, square;
    pfk_pose pose;
    int i, j, code;
    for (i = 0; i < PFK_FAR_CHECKS; ++i) {
        pfk_home(&pose);
        code = pfk_nearest(memory, &pfk_far_checks[i].target, &pose, actuators, 200, PFK_STARTS, 0);
        pfk_compare_codes("target out of reach", i, code == PFK_PROJECTED || code == PFK_JUMPED, code);
        for (square = 0.0, j = 0; j < 3; ++j) {
            away = pose.p[j] - pfk_far_checks[i].target.p[j];
            square += away * away;
        }
        pfk_compare("target out of reach", i, sqrt(square), pfk_far_checks[i].distance, PFK_EXACT_NEAREST * PFK_SIZE);
    }
}

#endif
#if TORQUE_CHECKS || EFFORT_CHECKS
static void pfk_compare_loads(const char *what, int row, const pfk_real *found, const pfk_real *expected)
{
    pfk_real most = 0.0;
    int j;
    for (j = 0; j < PFK_ACTUATORS; ++j)
        most = fabs(expected[j]) > most ? fabs(expected[j]) : most;
    for (j = 0; j < PFK_ACTUATORS; ++j)
        pfk_compare(what, row, found[j], expected[j], PFK_EXACT_LOADS * most);
}

#endif
#if TORQUE_CHECKS
static void pfk_check_torques(pfk_memory *memory)
{
    pfk_real found[PFK_ACTUATORS];
    int i, code;
    for (i = 0; i < PFK_TORQUE_CHECKS; ++i) {
        code = pfk_torques(memory, &pfk_torque_checks[i].pose, pfk_torque_checks[i].twist, found);
        pfk_compare_codes("torques", i, code == 0, code);
        if (code == 0)
            pfk_compare_loads("torques", i, found, pfk_torque_checks[i].actuators);
    }
}

#endif
#if EFFORT_CHECKS
static void pfk_check_effort(pfk_memory *memory)
{
    const pfk_real gravity[3] = {0.0, 0.0, -9.80665}, *twist;
    pfk_real found[PFK_ACTUATORS];
    int i, code;
    for (i = 0; i < PFK_EFFORT_CHECKS; ++i) {
        twist = pfk_effort_checks[i].twist;
        code = pfk_effort(memory, &pfk_effort_checks[i].pose, twist, twist, gravity, found);
        pfk_compare_codes("forces", i, code == 0, code);
        if (code == 0)
            pfk_compare_loads("forces", i, found, pfk_effort_checks[i].actuators);
    }
}

#endif
int main(void)
{
    static pfk_memory own, *const memory = &own;
    pfk_real found[PFK_ACTUATORS];
#if CLEARANCE
    pfk_real distance;
#endif
    pfk_pose pose;
    int i, j, code;
    pfk_begin(memory);
    for (i = 0; i < PFK_CHECKS; ++i) {
        pfk_home(&pose);
        code = pfk_ik(memory, &pfk_checks[i].target, &pose, found);
        pfk_compare_codes("pose", i, (code == 0) == pfk_checks[i].kept, code);
        for (j = 0; code == 0 && j < PFK_ACTUATORS; ++j)
            pfk_compare("actuators of pose", i, found[j], pfk_checks[i].actuators[j], PFK_EXACT * pfk_units[j]);
#if CLEARANCE
        if (code == 0) {
            pfk_clearance(memory, &pose, &distance, &j);
            pfk_compare("links at pose", i, distance, pfk_checks[i].distance, PFK_EXACT * PFK_SIZE);
        }
#endif
#if FK
        if (code == 0 && pfk_checks[i].led) {
            pfk_pose back;
            pfk_home(&back);
            code = pfk_fk(memory, found, &back, 0);
            pfk_compare_codes("back to pose", i, code == 0, code);
            for (j = 0; code == 0 && j < 3; ++j)
                pfk_compare("back to pose", i, back.p[j], pose.p[j], PFK_EXACT_BACK * PFK_SIZE);
        }
#endif
    }
#if FAR_CHECKS
    pfk_check_far(memory);
#endif
#if TORQUE_CHECKS
    pfk_check_torques(memory);
#endif
#if EFFORT_CHECKS
    pfk_check_effort(memory);
#endif
    printf("%d poses, %d wrong\n", PFK_CHECKS, pfk_wrong);
    return pfk_wrong != 0;
}
#else
int main(void)
{
    printf("nothing is checked: no pose near home has one answer alone\n");
    return 2;
}
#endif

#endif
#endif
#endif
