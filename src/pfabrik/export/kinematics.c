/* The routines of every exported file; they read legs from tables. `source.py` puts the machine's constants, tables
   and checks in place of the three included files, keeps the blocks between #if and #endif whose conditions hold, and
   writes names and numbers with the prefix and in the precision asked for. */

#ifndef PFK_H
#define PFK_H

#ifdef __cplusplus
extern "C" {
#endif

typedef double pfk_real;

typedef struct {
    pfk_real p[3];
    pfk_real R[3][3];
} pfk_pose;

/* Return codes: 0 on success, the number of the limit that is exceeded most, PFK_LEG + the number of a leg that does
   not reach or close, or one of those below. */
enum {
    PFK_LEG = 1000,
#if CLEARANCE
    PFK_PAIR = 10000,      /* + the number of a pair of links, the nearest: they are nearer than PFK_CLEARANCE */
#endif
    PFK_NO_POSE = -1,      /* not finite, or not a rotation */
    PFK_NO_ACTUATORS = -2, /* not finite */
    PFK_OTHER_MODE = -3    /* closed, but not in the working mode of home */
};

#include "machine.h"

/* The pose at home. */
void pfk_home(pfk_pose *pose);
/* A pose from a position and from turns about the fixed x, y and z axes, in this order [rad]. */
void pfk_pose_rpy(pfk_real x, pfk_real y, pfk_real z, pfk_real roll, pfk_real pitch, pfk_real yaw, pfk_pose *pose);
/* The angles of a pose: roll, pitch, yaw [rad]. */
void pfk_rpy(const pfk_pose *pose, pfk_real angles[3]);
/* The meaning of a return code, in words. */
const char *pfk_what(int code);
#if IK
/* Actuators for a target. `pose` must hold a pose, the last one or home: what the task leaves open is completed from
   there, and `pose` becomes the pose reached. Nothing is written unless 0 is returned. */
int pfk_ik(const pfk_pose *target, pfk_pose *pose, pfk_real actuators[PFK_ACTUATORS]);
#endif
#if TURNS
/* Adds whole turns to actuators that may turn more than once: nearest to those before. */
void pfk_count_turns(const pfk_real before[PFK_ACTUATORS], pfk_real now[PFK_ACTUATORS]);
#endif
#if LIMITS
/* Fills the slack of a whole pose in each of PFK_LIMITS limits, negative beyond it [length or rad]. */
int pfk_limits(const pfk_pose *pose, pfk_real slack[]);
#endif
#if CLEARANCE
/* The least distance between two links of a whole pose, negative where they overlap, and the number of their pair, from
   1; where it is less than PFK_CLEARANCE, PFK_PAIR + this number is returned. Nothing is written where legs do not
   reach or close. */
int pfk_clearance(const pfk_pose *pose, pfk_real *distance, int *pair);
#endif
#if FK
/* The pose at given actuators, by Newton's method from `pose`, in at most 40 steps; `steps` may be 0, or is set to
   their number. Limits are not checked. Nothing is written to `pose` unless 0, or PFK_OTHER_MODE, is returned. */
#if CLEARANCE
/* Where links are too near the pose is written too, and PFK_PAIR + the number of their pair returned. */
#endif
int pfk_fk(const pfk_real actuators[PFK_ACTUATORS], pfk_pose *pose, int *steps);
#endif
#if JOINTS
/* The pose at coordinates of the joints in series from the base to the end effector. */
void pfk_pose_at(const pfk_real joints[PFK_JOINTS], pfk_pose *pose);
#endif
#if TO_ACTUATORS
/* Actuators at joint coordinates; nothing is written unless 0 is returned. */
int pfk_to_actuators(const pfk_real joints[PFK_JOINTS], pfk_real actuators[PFK_ACTUATORS]);
#endif
#if TO_JOINTS
/* Joint coordinates at which actuators are, by Newton's method from those in `joints`, in at most 40 steps; `steps` may
   be 0, or is set to their number. Limits are not checked. Nothing is written to `joints` unless 0 is returned. */
#if CLEARANCE
/* Where links are too near the coordinates are written too, and PFK_PAIR + the number of their pair returned. */
#endif
int pfk_to_joints(const pfk_real actuators[PFK_ACTUATORS], pfk_real joints[PFK_JOINTS], int *steps);
#endif
#if RATES
/* Return codes are those of pfk_limits without its limits; nothing is written unless 0 is returned. A crank or carriage at
   its dead point has rate 0. */
#if JOINTS
typedef const pfk_real *pfk_at; /* joint coordinates; rates are those of the joints, torques also forces of slides */
#else
typedef const pfk_pose *pfk_at; /* a whole pose; rates are a twist: the velocity of the reference point and the angular
   velocity, in base coordinates, or the nearest that the legs allow; torques a force there and a moment */
#endif
/* Rates of actuators by each of the rates. */
int pfk_jacobian(pfk_at at, pfk_real jacobian[PFK_ACTUATORS][PFK_RATES]);
/* Rates of actuators, and back. */
int pfk_speeds(pfk_at at, const pfk_real rates[PFK_RATES], pfk_real speeds[PFK_ACTUATORS]);
int pfk_speeds_back(pfk_at at, const pfk_real speeds[PFK_ACTUATORS], pfk_real rates[PFK_RATES]);
/* Torques and forces of actuators, the least that give those wanted, and back: what they give. */
int pfk_torques(pfk_at at, const pfk_real wanted[PFK_RATES], pfk_real torques[PFK_ACTUATORS]);
int pfk_torques_back(pfk_at at, const pfk_real torques[PFK_ACTUATORS], pfk_real given[PFK_RATES]);
#endif

#ifdef __cplusplus
}
#endif

#endif

#ifndef PFK_DECLARATIONS_ONLY

#include <math.h>

#define PFK_TURN 6.283185307179586
#define PFK_LONGEST_STEP 0.5 /* [L or rad] */
#if IMPLICIT
#define PFK_CONTRACTION 0.25 /* of each step to the one before, at most, in the assembly mode of the start */
#define PFK_FIRST_STEP 0.125 /* the longest there [L or rad]: joints that carry others turn them about other points */
#else
#define PFK_CONTRACTION 0.5
#define PFK_FIRST_STEP PFK_LONGEST_STEP
#endif
#define PFK_SHORTEST_SHARE (1.0 / 1024.0) /* of the way: a shorter step means that the mode ends there */
#define PFK_FAR 1e30
#define PFK_MODE_APART 1e-3  /* two working modes meet where their actuators are nearer [L or rad] */
enum {
    PFK_IK_STEPS = 20,
    PFK_PARTS = 16, /* continuation steps to a target that is not completed at once */
    PFK_FK_STEPS = 40
};
#if SOLIDS
#define PFK_GOLDEN 2.399963229728653 /* turns of this angle spread directions evenly */
#define PFK_WAY_FIRST 0.3            /* first and last step to the way out of two discs [rad] */
#define PFK_WAY_LAST 1e-8
enum {
    PFK_ROOT_STEPS = 200,  /* most of them to the nearest point of a line */
    PFK_RIM = 32,          /* places on a rim */
    PFK_RIM_HALVINGS = 60, /* of the angle between two of them */
    PFK_WAYS = 64,         /* directions out of a solid */
    PFK_WAY_HALVINGS = 40
};
#endif

/* A rod is [proximal joint] + base ending + rigid or sliding rod + platform ending; a pivot is [slides] + one ending of
   no length; a redundant joint is a hinge or slide that other legs are on. A leg is read from the base to the platform;
   or in reverse, its base end on the platform: then its numbers are in the platform's frame. */
enum { PFK_ROD, PFK_PIVOT, PFK_REDUNDANT };
/* Frames that legs are read in; the redundant joints' follow. */
enum { PFK_FROM_BASE, PFK_FROM_PLATFORM, PFK_FROM_ITSELF };
/* The proximal joint of a leg: none, a hinge, a slide, or that of the rod before. */
enum { PFK_NO_PROXIMAL, PFK_CRANK, PFK_CARRIAGE, PFK_SHARED };
/* Endings: a weld, a hinge, two hinges that cross, three through a point, a ball. */
enum { PFK_WELD, PFK_HINGE, PFK_CROSS, PFK_TRIPLE, PFK_BALL };
/* Coordinates of a leg: of its proximal joint, angles at its base end, its extension, angles at its platform end or
   slides. */
enum { PFK_Q_PROXIMAL = 0, PFK_BASE_END = 1, PFK_SLIDE = 4, PFK_PLATFORM_END = 5, PFK_VALUES = 8 };

/* A leg, at home. */
typedef struct {
    int kind, frame;
    int is_back; /* 1: its base end is on the platform */
    int main; /* the leg whose proximal joint it is on: mostly its own place */
    int proximal, slides;
    int twists; /* 1: both ends keep the rod from spinning about itself */
    int base_ending, platform_ending;
    int base_end_aimed, platform_end_aimed; /* 1: the angles of this ending have limits; 2: rates need them too */
    pfk_real base_end[3];
    pfk_real platform_end[3]; /* from the reference point; of a leg read from the platform, from the base's origin */
    pfk_real length, line[3]; /* the direction from base end to platform end */
    pfk_real base_end_axes[3][3], platform_end_axes[3][3]; /* hinges, from the body that the end is on */
    pfk_real base_end_side, platform_end_side; /* which of two solutions of crossed hinges is home's */
    pfk_real twist; /* angle about the line between marks of the two ends */
    pfk_real axis[3]; /* of the proximal joint */
    pfk_real centre[3], crank[3], across[3]; /* of a crank: from centre to the base end, and that a quarter turn on */
    pfk_real reach[3]; /* from centre, or from the base end on a carriage, to the platform end */
    pfk_real side; /* which of two solutions is home's */
#if PIVOTS
    pfk_real rows[3][3]; /* of the centre's displacement: first the slides, then what must stay 0 */
    int pairs, upright; /* number of conditions kept . R moved; of hinges that must not turn over */
    pfk_real kept[3][3], moved[3][3];
    pfk_real square[3]; /* to the last hinge */
#endif
#if REDUNDANT
    int on; /* the number of the redundant joint that it is on, 0 if on none */
    int is_inner; /* 1: it is between intermediate platforms, and constrains nothing of the pose */
    /* of a redundant joint */
    int makes; /* the frame that it makes */
    int column; /* of its coordinate; a mirror has that of another joint */
    int is_mirror;
    int at_platform_end; /* 1: it moves the body that platform ends are on; 0: the one that base ends are on */
    int orients; /* 1: it brings the hinge at the base end of the rod after it to face the platform end */
    int has_rows; /* 1: a leg on it has an equation */
#endif
} pfk_leg;

/* A coordinate of a leg: its deviation from home is sense * value. */
typedef struct {
    int leg, place, is_length;
    int turns; /* 1: an angle that counts into its range by whole turns */
    pfk_real sense, lo, hi, home; /* lo and hi of the deviation */
} pfk_coordinate;

#if JOINTS
/* A joint in series, from the base outward, at home; its deviation is sense * (value - home). */
typedef struct {
    int place, turns; /* of its coordinate; 1: a hinge, 0: a slide */
    pfk_real sense, home, axis[3], point[3];
} pfk_joint;

#endif
#if CONES
/* The half angle of a rod about an axis fixed to the body that its base end, or its platform end, is on. */
typedef struct {
    int leg, is_platform_end;
    pfk_real axis[3], half_angle;
} pfk_cone;
#endif
#if BODIES
/* How a body moves: it slides along an axis or turns about it through a point, by a coordinate of a leg; or it keeps to
   the line of a rod, and to the base end there or the platform end. */
enum { PFK_SLIDES, PFK_TURNS, PFK_WITH_BASE_END, PFK_WITH_PLATFORM_END };
/* A body that moves relative to another one, at home. The base is number 0, the platform 1, these follow. */
typedef struct {
    int on, moves, leg, place;
    pfk_real sense, axis[3], point[3];
} pfk_body;

#endif
#if CLEARANCE
#if SOLIDS
enum { PFK_CAPSULE, PFK_BOX, PFK_DISC };
/* A capsule, a box or a disc, which is all that is no farther than `round` from its core. That of a capsule is its axis,
   by both ends; of a box it has a centre, three unit axes, and half its edges; of a disc a centre, its unit axis, its
   radius and half its height. */
typedef struct {
    int kind;
    pfk_real round, half[3], at[4][3];
} pfk_solid;
#else
/* A capsule: all that is no farther than `round` from its axis, by both ends. */
typedef struct {
    pfk_real round, at[2][3];
} pfk_solid;
#endif

/* A link at home; the bodies that its first two points are on. */
typedef struct {
    int body[2];
    pfk_solid home;
} pfk_link;
#endif

#include "tables.h"

/* The platform as a base end on the base sees it, or the base as one on the platform does: points map to R x + p. */
typedef struct {
    pfk_real R[3][3], p[3];
    pfk_real moved[3]; /* p less what it is at home */
    pfk_real centre[3]; /* about which the platform turns */
    pfk_real base_axes[3][3]; /* turns directions of the body of the base ends to those of the base */
} pfk_frame;

/* The state of a leg. */
typedef struct {
    pfk_real base_end[3], platform_end[3], span[3], u[3], length;
    pfk_real base_line[3], platform_line[3]; /* u in the frame of the body that the end is on */
    pfk_real value[PFK_VALUES], cosine, sine;
    int is_given; /* 1: the proximal coordinate is given */
    int is_held; /* 1: the proximal joint does not follow the platform end */
    /* derivative of the proximal coordinate by the pose; of a redundant joint, the velocity and the angular velocity of
       the platform that would change as much in its frame */
    pfk_real follow[6];
} pfk_placed;

typedef struct {
    pfk_frame frame[PFK_FRAMES];
    pfk_placed leg[PFK_LEGS];
#if REDUNDANT
    pfk_real q_redundant[PFK_N_REDUNDANT]; /* their coordinates */
#endif
} pfk_state;

#if SOLVES
/* An equation of a leg, 0 where it closes [L or rad]; its derivative by the velocity and the angular velocity of the
   platform, then by the coordinates of redundant joints. */
typedef struct {
    int leg;
    pfk_real off, slope[PFK_COLUMNS];
#if RATES
    pfk_real by_given; /* of an actuator's: the derivative by its coordinate */
#endif
} pfk_row;
#endif

static const pfk_real pfk_zero[3] = {0.0, 0.0, 0.0};

static inline pfk_real pfk_dot(const pfk_real a[3], const pfk_real b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline pfk_real pfk_norm(const pfk_real a[3])
{
    return sqrt(pfk_dot(a, a));
}

/* `out` is neither of the two. */
static inline void pfk_cross(const pfk_real a[3], const pfk_real b[3], pfk_real out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline void pfk_copy(const pfk_real a[3], pfk_real out[3])
{
    int i;
    for (i = 0; i < 3; ++i)
        out[i] = a[i];
}

/* a + k b; `out` may be one of them. */
static inline void pfk_along(const pfk_real a[3], pfk_real k, const pfk_real b[3], pfk_real out[3])
{
    int i;
    for (i = 0; i < 3; ++i)
        out[i] = a[i] + k * b[i];
}

static inline void pfk_rotate(const pfk_frame *frame, const pfk_real v[3], pfk_real out[3])
{
    int i;
    for (i = 0; i < 3; ++i)
        out[i] = pfk_dot(frame->R[i], v);
}

static inline void pfk_rotate_back(const pfk_frame *frame, const pfk_real v[3], pfk_real out[3])
{
    int i;
    for (i = 0; i < 3; ++i)
        out[i] = frame->R[0][i] * v[0] + frame->R[1][i] * v[1] + frame->R[2][i] * v[2];
}

static void pfk_map(const pfk_frame *frame, const pfk_real point[3], pfk_real out[3])
{
    pfk_rotate(frame, point, out);
    pfk_along(out, 1.0, frame->p, out);
}

/* The platform as seen from the base, and the base as seen from the platform; those of redundant joints follow. */
static void pfk_frames(const pfk_pose *pose, pfk_frame frame[PFK_FRAMES])
{
    pfk_frame *forward = &frame[PFK_FROM_BASE], *back = &frame[PFK_FROM_PLATFORM];
    pfk_real moved[3];
    int i, j;
    pfk_along(pose->p, -1.0, pfk_reference, moved);
    for (i = 0; i < 3; ++i) {
        forward->p[i] = forward->centre[i] = pose->p[i];
        forward->moved[i] = moved[i];
        back->centre[i] = pfk_reference[i];
        back->moved[i] = 0.0;
        for (j = 0; j < 3; ++j) {
            forward->R[i][j] = back->base_axes[i][j] = pose->R[i][j];
            forward->base_axes[i][j] = i == j ? 1.0 : 0.0;
            back->R[i][j] = pose->R[j][i];
            back->moved[i] -= pose->R[j][i] * moved[j] + (pose->R[j][i] - (i == j ? 1.0 : 0.0)) * pfk_reference[j];
        }
        back->p[i] = back->moved[i];
#if REDUNDANT
        for (j = 0; j < 3; ++j)
            frame[PFK_FROM_ITSELF].R[i][j] = frame[PFK_FROM_ITSELF].base_axes[i][j] = i == j ? 1.0 : 0.0;
        frame[PFK_FROM_ITSELF].p[i] = frame[PFK_FROM_ITSELF].moved[i] = frame[PFK_FROM_ITSELF].centre[i] = 0.0;
#endif
    }
}

/* The displacement of a point of the platform from home. */
static void pfk_displaced(const pfk_frame *frame, const pfk_real point[3], pfk_real out[3])
{
    int i;
    for (i = 0; i < 3; ++i)
        out[i] = frame->moved[i] + (frame->R[i][0] - (i == 0 ? 1.0 : 0.0)) * point[0]
                 + (frame->R[i][1] - (i == 1 ? 1.0 : 0.0)) * point[1]
                 + (frame->R[i][2] - (i == 2 ? 1.0 : 0.0)) * point[2];
}

/* v turned about a unit vector; `out` is not v. */
static inline void pfk_about(const pfk_real v[3], const pfk_real axis[3], pfk_real cosine, pfk_real sine, pfk_real out[3])
{
    const pfk_real rest = (1.0 - cosine) * pfk_dot(axis, v);
    int i;
    pfk_cross(axis, v, out);
    for (i = 0; i < 3; ++i)
        out[i] = cosine * v[i] + sine * out[i] + rest * axis[i];
}

#if TWISTS || PIVOTS || MOVES || RATES
static void pfk_about_angle(const pfk_real v[3], const pfk_real axis[3], pfk_real angle, pfk_real out[3])
{
    pfk_about(v, axis, cos(angle), sin(angle), out);
}

#endif
/* Angle from u to w about a unit vector; components along it do not count. */
static pfk_real pfk_angle(const pfk_real axis[3], const pfk_real u[3], const pfk_real w[3])
{
    pfk_real across[3];
    pfk_cross(u, w, across);
    return atan2(pfk_dot(axis, across), pfk_dot(u, w) - pfk_dot(axis, u) * pfk_dot(axis, w));
}

/* An angle plus whole turns, within half a turn of `centre`. */
static pfk_real pfk_wrap(pfk_real angle, pfk_real centre)
{
    return angle - PFK_TURN * floor((angle - centre) / PFK_TURN + 0.5);
}

/* One of the two solutions of A cos q + B sin q = C, where over = A - C. Returns the singularity margin: the
   distance from the double root, negative without a solution; then the angle is that of the double root. */
static pfk_real pfk_either(pfk_real A, pfk_real B, pfk_real C, pfk_real over, pfk_real side, pfk_real *cosine,
                           pfk_real *sine)
{
    const pfk_real square = A * A + B * B, size = sqrt(square), rest = over * (A + C) + B * B;
    const pfk_real root = rest > 0.0 ? side * sqrt(rest) : 0.0;
    *cosine = 1.0;
    *sine = 0.0;
    if (!(square > 0.0))
        return -1.0;
    if (rest < 0.0)
        C = C < 0.0 ? -size : size;
    *cosine = (A * C - B * root) / square;
    *sine = (B * C + A * root) / square;
    return rest / square;
}

/* Angles of two crossed hinges that turn u, given at home, into w, unless `angles` is 0; the singularity margin, as
   above. */
static pfk_real pfk_aim(const pfk_real axes[3][3], const pfk_real u[3], const pfk_real w[3], pfk_real side,
                        pfk_real angles[])
{
    const pfk_real *a = axes[0], *b = axes[1], bu = pfk_dot(b, u);
    pfk_real flat[3], across[3], turned[3], A, C, cosine, sine, margin;
    pfk_along(u, -bu, b, flat);
    pfk_cross(b, u, across);
    A = pfk_dot(a, flat);
    C = pfk_dot(a, w) - pfk_dot(a, b) * bu;
    margin = pfk_either(A, pfk_dot(a, across), C, A - C, side, &cosine, &sine);
    if (!angles)
        return margin;
    pfk_about(u, b, cosine, sine, turned);
    angles[0] = pfk_angle(a, turned, w);
    angles[1] = atan2(sine, cosine);
    return margin;
}

#if PIVOTS
/* Angle of a rotation about its own axis. */
static pfk_real pfk_spin_angle(const pfk_frame *frame, const pfk_real axis[3])
{
    const pfk_real sine = axis[0] * (frame->R[2][1] - frame->R[1][2]) + axis[1] * (frame->R[0][2] - frame->R[2][0])
                          + axis[2] * (frame->R[1][0] - frame->R[0][1]);
    return atan2(sine, frame->R[0][0] + frame->R[1][1] + frame->R[2][2] - 1.0);
}

/* Angle about the last of a pivot's hinges, once the `before` ones have turned. */
static pfk_real pfk_last_angle(const pfk_frame *frame, const pfk_leg *pivot, const pfk_real angles[], int before)
{
    pfk_real now[3], back[3];
    int i;
    pfk_rotate(frame, pivot->square, now);
    for (i = 0; i < before; ++i) {
        pfk_about_angle(now, pivot->base_end_axes[i], -angles[i], back);
        pfk_copy(back, now);
    }
    return pfk_angle(pivot->base_end_axes[before], pivot->square, now);
}

#endif
/* Turns a crank until its rod reaches the platform end, or to where it comes nearest; fills its angle where `angles` are
   asked for; whether it is near a dead point. What the platform end has moved since home tells more digits than where it is: with x = reach + moved, C =
   crank . reach + c. */
static int pfk_turn_crank(const pfk_leg *rod, const pfk_real moved[3], int angles, pfk_placed *own)
{
    const pfk_real a = pfk_dot(rod->crank, moved), B = pfk_dot(rod->across, rod->reach) + pfk_dot(rod->across, moved);
    const pfk_real c = pfk_dot(moved, rod->reach) + 0.5 * pfk_dot(moved, moved), A = pfk_dot(rod->crank, rod->reach);
    const pfk_real margin = pfk_either(A + a, B, A + c, a - c, rod->side, &own->cosine, &own->sine);
    if (angles)
        own->value[PFK_Q_PROXIMAL] = atan2(own->sine, own->cosine);
    return !(margin > PFK_DEAD);
}

/* Moves a carriage until its rod reaches the platform end, or to where it comes nearest; whether it is near a dead
   point. */
static int pfk_move_carriage(const pfk_leg *rod, const pfk_real moved[3], pfk_placed *own)
{
    const pfk_real middle = pfk_dot(rod->reach, rod->axis) + pfk_dot(moved, rod->axis);
    const pfk_real rest = middle * middle - 2.0 * pfk_dot(moved, rod->reach) - pfk_dot(moved, moved);
    own->value[PFK_Q_PROXIMAL] = middle + (rest > 0.0 ? rod->side * sqrt(rest) : 0.0);
    return !(rest > PFK_DEAD * rod->length * rod->length);
}

static int pfk_has_proximal(const pfk_leg *leg)
{
    return leg->proximal == PFK_CRANK || leg->proximal == PFK_CARRIAGE;
}

/* A direction of what a base end is on, turned with the crank `main`, whose state is `main_state`; or back (sense
   -1). */
static void pfk_carried(const pfk_leg *main, const pfk_placed *main_state, pfk_real sense, const pfk_real v[3],
                        pfk_real out[3])
{
    if (main->proximal == PFK_CRANK)
        pfk_about(v, main->axis, main_state->cosine, sense * main_state->sine, out);
    else
        pfk_copy(v, out);
}

/* The place of a base end on its proximal joint. */
static void pfk_place_base_end(const pfk_leg *rod, const pfk_leg *main, const pfk_placed *main_state,
                               pfk_real base_end[3])
{
    pfk_real lever[3];
    if (main->proximal == PFK_CARRIAGE) {
        pfk_along(rod->base_end, main_state->value[PFK_Q_PROXIMAL], main->axis, base_end);
    } else if (main->proximal != PFK_CRANK) {
        pfk_copy(rod->base_end, base_end);
    } else if (rod->proximal == PFK_SHARED) {
        pfk_along(rod->base_end, -1.0, main->centre, lever);
        pfk_about(lever, main->axis, main_state->cosine, main_state->sine, base_end);
        pfk_along(base_end, 1.0, main->centre, base_end);
    } else {
        pfk_along(rod->centre, main_state->cosine, rod->crank, base_end);
        pfk_along(base_end, main_state->sine, rod->across, base_end);
    }
}

/* Angles of the hinges at an end of a rod that has to point along `line`, unless `angles` is 0; the singularity margin,
   see pfk_aim. */
static pfk_real pfk_aim_end(int end, const pfk_real axes[3][3], const pfk_real home[3], const pfk_real line[3],
                            pfk_real side, pfk_real angles[])
{
    if (end != PFK_HINGE)
        return pfk_aim(axes, home, line, side, angles);
    if (angles)
        angles[0] = pfk_angle(axes[0], home, line);
    return 1.0;
}

#if TWISTS
/* The mark of an end of a rod, in the frame of the body that it is on: its last hinge. */
static void pfk_mark(int end, const pfk_real axes[3][3], const pfk_real angles[], pfk_real out[3])
{
    if (end == PFK_HINGE)
        pfk_copy(axes[0], out);
    else
        pfk_about_angle(axes[1], axes[0], angles[0], out);
}

/* The angle about a rod between the marks of its ends, less home's; fills the marks in base coordinates. */
static pfk_real pfk_twist(const pfk_frame *frame, const pfk_leg *rod, const pfk_leg *main, const pfk_placed *main_state,
                          const pfk_placed *own, pfk_real base_mark[3], pfk_real platform_mark[3])
{
    pfk_real mark[3];
    pfk_mark(rod->base_ending, rod->base_end_axes, &own->value[PFK_BASE_END], mark);
    pfk_carried(main, main_state, 1.0, mark, base_mark);
    pfk_mark(rod->platform_ending, rod->platform_end_axes, &own->value[PFK_PLATFORM_END], mark);
    pfk_rotate(frame, mark, platform_mark);
    return pfk_wrap(pfk_angle(own->u, base_mark, platform_mark) - rod->twist, 0.0);
}

#endif
/* Fills the state of a rod at a pose; returns the gap by which it does not reach [L]. `main_state` is that of the
   leg with its proximal joint. Two crossed hinges point a rod by either of two solutions, half a turn about it apart:
   those of home, unless the two ends then hold the rod the other way around. */
static pfk_real pfk_place_rod(const pfk_frame *frame, const pfk_leg *rod, const pfk_placed *main_state, int angles,
                              pfk_placed *own)
{
    const pfk_leg *main = &pfk_legs[rod->main];
    pfk_real moved[3], margin, gap = 0.0;
    pfk_map(frame, rod->platform_end, own->platform_end);
    if (pfk_has_proximal(rod)) {
        if (own->is_given) {
            own->is_held = 1;
            own->cosine = cos(own->value[PFK_Q_PROXIMAL]);
            own->sine = sin(own->value[PFK_Q_PROXIMAL]);
        } else {
            pfk_displaced(frame, rod->platform_end, moved);
            own->is_held = rod->proximal == PFK_CRANK ? pfk_turn_crank(rod, moved, angles, own)
                                                     : pfk_move_carriage(rod, moved, own);
        }
    }
    pfk_place_base_end(rod, main, main_state, own->base_end);
    pfk_along(own->platform_end, -1.0, own->base_end, own->span);
    own->length = pfk_norm(own->span);
    own->value[PFK_SLIDE] = own->length - rod->length;
    if (!(own->length > 0.0))
        return 1.0;
    pfk_along(pfk_zero, 1.0 / own->length, own->span, own->u);
    if (angles || rod->base_end_aimed)
        pfk_carried(main, main_state, -1.0, own->u, own->base_line);
    if (angles || rod->platform_end_aimed)
        pfk_rotate_back(frame, own->u, own->platform_line);
    if (pfk_has_proximal(rod) && own->is_held && !own->is_given)
        gap = fabs(own->value[PFK_SLIDE]) / PFK_SIZE;
    if (rod->base_end_aimed) {
        margin = pfk_aim_end(rod->base_ending, rod->base_end_axes, rod->line, own->base_line, rod->base_end_side,
                             angles || rod->base_end_aimed == 2 ? &own->value[PFK_BASE_END] : 0);
        gap = -margin > gap ? -margin : gap;
    }
    if (rod->platform_end_aimed) {
        margin = pfk_aim_end(rod->platform_ending, rod->platform_end_axes, rod->line, own->platform_line,
                             rod->platform_end_side,
                             angles || rod->platform_end_aimed == 2 ? &own->value[PFK_PLATFORM_END] : 0);
        gap = -margin > gap ? -margin : gap;
    }
#if TWISTS
    if (rod->twists && (rod->base_ending == PFK_CROSS || rod->platform_ending == PFK_CROSS)) {
        pfk_real base_mark[3], platform_mark[3];
        if (fabs(pfk_twist(frame, rod, main, main_state, own, base_mark, platform_mark)) > 0.25 * PFK_TURN) {
            if (rod->platform_ending == PFK_CROSS)
                pfk_aim(rod->platform_end_axes, rod->line, own->platform_line, -rod->platform_end_side,
                        &own->value[PFK_PLATFORM_END]);
            else
                pfk_aim(rod->base_end_axes, rod->line, own->base_line, -rod->base_end_side, &own->value[PFK_BASE_END]);
        }
    }
#endif
    return gap;
}

#if PIVOTS
/* Fills the state of a pivot at a pose; returns the gap by which it does not reach. */
static pfk_real pfk_place_pivot(const pfk_frame *frame, const pfk_leg *pivot, int has_angles, pfk_placed *own)
{
    pfk_real last[3], margin, *angles = &own->value[PFK_BASE_END];
    int i;
    pfk_map(frame, pivot->platform_end, own->platform_end);
    pfk_along(own->platform_end, -1.0, pivot->base_end, own->span);
    for (i = 0; i < pivot->slides; ++i)
        own->value[PFK_PLATFORM_END + i] = pfk_dot(pivot->rows[i], own->span);
    if (pivot->base_ending == PFK_TRIPLE) {
        pfk_rotate(frame, pivot->base_end_axes[2], last);
        margin = pfk_aim(pivot->base_end_axes, pivot->base_end_axes[2], last, pivot->side, has_angles ? angles : 0);
        if (has_angles)
            angles[2] = pfk_last_angle(frame, pivot, angles, 2);
        return margin < 0.0 ? -margin : 0.0;
    }
    if (!has_angles)
        return 0.0;
    if (pivot->base_ending == PFK_HINGE) {
        angles[0] = pfk_spin_angle(frame, pivot->base_end_axes[0]);
    } else if (pivot->base_ending == PFK_CROSS) {
        pfk_rotate(frame, pivot->base_end_axes[1], last);
        angles[0] = pfk_angle(pivot->base_end_axes[0], pivot->base_end_axes[1], last);
        angles[1] = pfk_last_angle(frame, pivot, angles, 1);
    }
    return 0.0;
}

#endif
#if REDUNDANT
/* Turns or shifts a redundant joint until the hinge n at the base end F of the rod after it faces the platform end H;
   returns the singularity margin, as pfk_either. With the joint's axis a through o: (Rot n) . (H - o) = n . (F - o), or
   n . (H - F - q a) = 0; at home n . (H - F) = 0. */
static pfk_real pfk_orient(const pfk_frame *frame, const pfk_leg *joint, const pfk_leg *rod, pfk_real *q)
{
    const pfk_real *n = rod->base_end_axes[0], lean = pfk_dot(joint->axis, n);
    pfk_real platform_end[3], moved[3], base_end[3], across[3], over, C, cosine, sine, margin;
    pfk_displaced(frame, rod->platform_end, moved);
    over = pfk_dot(n, moved);
    if (joint->proximal == PFK_CARRIAGE) {
        *q = over / lean;
        return 1.0;
    }
    pfk_map(frame, rod->platform_end, platform_end);
    pfk_along(platform_end, -1.0, joint->centre, platform_end);
    pfk_along(rod->base_end, -1.0, joint->centre, base_end);
    pfk_cross(joint->axis, n, across);
    C = pfk_dot(n, base_end) - lean * pfk_dot(joint->axis, platform_end);
    margin = pfk_either(over + C, pfk_dot(across, platform_end), C, over, joint->side, &cosine, &sine);
    *q = atan2(sine, cosine);
    return margin;
}

/* Fills the frame that a redundant joint makes, its coordinate given, and how it moves what is in its frame. */
static void pfk_place_redundant(const pfk_frame *before, const pfk_leg *joint, pfk_real q, pfk_frame *after,
                                pfk_placed *own)
{
    const int is_hinge = joint->proximal == PFK_CRANK;
    const pfk_real cosine = is_hinge ? cos(q) : 1.0, sine = is_hinge ? sin(q) : 0.0;
    const pfk_real sense = joint->at_platform_end != joint->is_back ? 1.0 : -1.0;
    pfk_real axis[3], at[3], turned[3], from[3], velocity[3];
    int i, j;
    own->value[PFK_Q_PROXIMAL] = q;
    pfk_copy(joint->axis, axis);
    pfk_copy(joint->centre, at);
    if (joint->at_platform_end) {
        pfk_rotate(before, joint->axis, axis);
        pfk_map(before, joint->centre, at);
    }
    pfk_along(before->centre, -1.0, at, from);
    pfk_cross(axis, from, velocity);
    for (i = 0; i < 3; ++i) {
        own->follow[i] = sense * pfk_dot(before->base_axes[i], is_hinge ? velocity : axis);
        own->follow[3 + i] = is_hinge ? sense * pfk_dot(before->base_axes[i], axis) : 0.0;
    }
    *after = *before;
    /* `axis` and `at` are as the body of the base ends sees them: a turn there moves platform ends about them, or
       base ends the other way */
    for (j = 0; j < 3; ++j) {
        for (i = 0; i < 3; ++i)
            from[i] = before->R[i][j];
        pfk_about(from, axis, cosine, joint->at_platform_end ? sine : -sine, turned);
        for (i = 0; i < 3; ++i)
            after->R[i][j] = turned[i];
        pfk_about(before->base_axes[j], axis, cosine, -sine, turned);
        if (!joint->at_platform_end)
            pfk_copy(turned, after->base_axes[j]);
    }
    if (!is_hinge) {
        q = joint->at_platform_end ? q : -q;
        pfk_along(before->p, q, axis, after->p);
        pfk_along(before->moved, q, axis, after->moved);
        if (!joint->at_platform_end)
            pfk_along(before->centre, q, axis, after->centre);
        return;
    }
    pfk_along(before->p, -1.0, at, from);
    pfk_about(from, axis, cosine, joint->at_platform_end ? sine : -sine, turned);
    pfk_along(at, 1.0, turned, after->p);
    pfk_along(turned, -1.0, from, turned);
    pfk_along(before->moved, 1.0, turned, after->moved);
    if (!joint->at_platform_end) {
        pfk_along(before->centre, -1.0, at, from);
        pfk_about(from, axis, cosine, -sine, turned);
        pfk_along(at, 1.0, turned, after->centre);
    }
}

/* Redundant joints start at home. */
static void pfk_start(pfk_state *state)
{
    int i;
    for (i = 0; i < PFK_N_REDUNDANT; ++i)
        state->q_redundant[i] = 0.0;
}

#endif
/* Places all legs at a pose, with driven proximal joints as they are given, if they are; 0, or the number of the leg
   that is farthest from reaching. Without `angles` it fills those alone that equations need. */
static int pfk_place(const pfk_pose *pose, const pfk_real *given, int angles, pfk_state *state)
{
    pfk_real gap, worst = PFK_CLOSE;
    int i, k, missing = 0;
    pfk_frames(pose, state->frame);
    for (k = 0; k < PFK_LEGS; ++k)
        state->leg[k].is_given = 0;
    for (i = 0; given && i < PFK_ACTUATORS; ++i) {
        const pfk_coordinate *driven = &pfk_driven[i];
        if (driven->place == PFK_Q_PROXIMAL) {
            state->leg[driven->leg].is_given = 1;
            state->leg[driven->leg].value[PFK_Q_PROXIMAL] = given[i];
#if REDUNDANT
            if (pfk_legs[driven->leg].kind == PFK_REDUNDANT)
                state->q_redundant[pfk_legs[driven->leg].column] = given[i];
#endif
        }
    }
    for (k = 0; k < PFK_LEGS; ++k) {
        const pfk_leg *leg = &pfk_legs[k];
        const pfk_frame *frame = &state->frame[leg->frame];
#if REDUNDANT
        if (leg->kind == PFK_REDUNDANT) {
            pfk_real q = state->q_redundant[leg->column];
            gap = leg->orients && !given ? -pfk_orient(frame, leg, leg + 1, &q) : 0.0;
            state->q_redundant[leg->column] = q;
            pfk_place_redundant(frame, leg, q, &state->frame[leg->makes], &state->leg[k]);
        } else
#endif
#if PIVOTS
        if (leg->kind == PFK_PIVOT)
            gap = pfk_place_pivot(frame, leg, angles || leg->base_end_aimed == 2, &state->leg[k]);
        else
#endif
            gap = pfk_place_rod(frame, leg, &state->leg[leg->main], angles, &state->leg[k]);
        if (!(gap <= worst)) {
            worst = gap;
            missing = k + 1;
        }
    }
    return missing;
}

/* A coordinate's deviation from home, angles counted into their range: near its middle, or near 0 where it spans more
   than a turn. */
static pfk_real pfk_deviation(const pfk_coordinate *coordinate, const pfk_state *state)
{
    const pfk_real lo = coordinate->lo, hi = coordinate->hi;
    pfk_real value = coordinate->sense * state->leg[coordinate->leg].value[coordinate->place];
    if (!coordinate->turns)
        return value;
    if (hi - lo <= PFK_TURN)
        return pfk_wrap(value, 0.5 * (lo + hi));
    value = pfk_wrap(value, 0.0);
    if (value > hi + PFK_KEPT)
        return value - PFK_TURN;
    return value < lo - PFK_KEPT ? value + PFK_TURN : value;
}

#if SOLVES
/* Derivative of a . H + c . w by the velocity and the angular velocity of the platform; H is the platform end, w the
   angular velocity of what it is on, as the leg's frame has them. */
static void pfk_slope(const pfk_leg *leg, const pfk_frame *frame, const pfk_real platform_end[3], const pfk_real a[3],
                      const pfk_real c[3], pfk_real slope[])
{
    const pfk_real sense = leg->is_back ? -1.0 : 1.0;
    pfk_real lever[3], spin[3];
    int i;
    pfk_along(platform_end, -1.0, frame->centre, lever);
    pfk_cross(lever, a, spin);
    pfk_along(spin, 1.0, c, spin);
    if (leg->frame == PFK_FROM_BASE) {
        pfk_copy(a, slope);
        pfk_copy(spin, slope + 3);
        return;
    }
    for (i = 0; i < 3; ++i) {
        slope[i] = sense * pfk_dot(frame->base_axes[i], a);
        slope[3 + i] = sense * pfk_dot(frame->base_axes[i], spin);
    }
}

/* Derivative of - a . F + b . W by the coordinate of a proximal joint; F is a base end on it, W its angular
   velocity. */
static pfk_real pfk_proximal_rate(const pfk_leg *main, const pfk_real base_end[3], const pfk_real a[3],
                                  const pfk_real b[3])
{
    pfk_real lever[3], moved[3];
    if (main->proximal == PFK_CARRIAGE)
        return -pfk_dot(a, main->axis);
    pfk_along(base_end, -1.0, main->centre, lever);
    pfk_cross(main->axis, lever, moved);
    return pfk_dot(b, main->axis) - pfk_dot(a, moved);
}

/* Derivative of the coordinate of a proximal joint that follows the platform end, so that its rod keeps its length. */
static void pfk_follow(const pfk_frame *frame, const pfk_leg *rod, pfk_placed *own)
{
    pfk_real rate;
    int i;
    for (i = 0; i < 6; ++i)
        own->follow[i] = 0.0;
    if (own->is_held)
        return;
    rate = -1.0 / pfk_proximal_rate(rod, own->base_end, own->u, pfk_zero);
    pfk_slope(rod, frame, own->platform_end, own->u, pfk_zero, own->follow);
    for (i = 0; i < 6; ++i)
        own->follow[i] *= rate;
}

/* Fills an equation of leg k; `off` and a . (dH - dF) + b . W + c . w, its derivative, are in `unit`. F and H are
   base end and platform end, W and w the angular velocities of what they are on. Where row->slope is asked for, it is
   `sloped`. */
static pfk_row *pfk_put(const pfk_state *state, int k, pfk_real unit, pfk_real off, const pfk_real a[3],
                        const pfk_real b[3], const pfk_real c[3], int sloped, pfk_row *row)
{
    const pfk_leg *leg = &pfk_legs[k], *main = &pfk_legs[leg->main];
    const pfk_placed *own = &state->leg[k];
    const pfk_real per_unit = 1.0 / unit;
    pfk_real rate;
    int i;
    row->leg = k + 1;
    row->off = off * per_unit;
    if (!sloped)
        return row + 1;
    pfk_slope(leg, &state->frame[leg->frame], own->platform_end, a, c, row->slope);
    if (main->proximal != PFK_NO_PROXIMAL) {
        rate = pfk_proximal_rate(main, own->base_end, a, b);
        for (i = 0; i < 6; ++i)
            row->slope[i] += rate * state->leg[leg->main].follow[i];
    }
#if REDUNDANT
    for (i = 6; i < PFK_COLUMNS; ++i)
        row->slope[i] = 0.0;
    for (i = leg->on; i > 0; i = pfk_legs[i - 1].on)
        row->slope[6 + pfk_legs[i - 1].column] += pfk_dot(row->slope, state->leg[i - 1].follow)
                                                  + pfk_dot(row->slope + 3, state->leg[i - 1].follow + 3);
    for (i = 0; i < 6 && leg->is_inner; ++i)
        row->slope[i] = 0.0;
#endif
    for (i = 0; i < PFK_COLUMNS; ++i)
        row->slope[i] *= per_unit;
    return row + 1;
}

#if TWISTS
/* Rate at which an end of a rod spins about u, by du and by the angular velocity of its body: of a hinge the part of
   it across u; of two crossed ones, `first` and `last`, the rod itself. */
static void pfk_spin_rate(int end, const pfk_real first[3], const pfk_real last[3], const pfk_real u[3],
                          pfk_real by_line[3], pfk_real by_body[3])
{
    const pfk_real lengthwise = pfk_dot(first, u);
    pfk_real flat[3], across[3], D;
    int i;
    if (end == PFK_HINGE) {
        pfk_along(first, -lengthwise, u, flat);
        pfk_cross(u, flat, across);
        D = pfk_dot(flat, flat);
        for (i = 0; i < 3; ++i) {
            across[i] /= D;
            by_line[i] = -lengthwise * across[i];
        }
        pfk_cross(first, across, by_body);
        return;
    }
    pfk_cross(first, u, across);
    D = pfk_dot(across, last);
    for (i = 0; i < 3; ++i)
        by_line[i] = (lengthwise * last[i] - pfk_dot(last, u) * first[i]) / D;
    pfk_cross(u, by_line, by_body);
    pfk_along(u, -1.0, by_body, by_body);
}

/* The equation of a rod that both ends keep from spinning. */
static pfk_row *pfk_twist_row(const pfk_state *state, int k, int sloped, pfk_row *row)
{
    const pfk_leg *rod = &pfk_legs[k], *main = &pfk_legs[rod->main];
    const pfk_placed *own = &state->leg[k], *main_state = &state->leg[rod->main];
    const pfk_frame *frame = &state->frame[rod->frame];
    pfk_real base_mark[3], platform_mark[3], first[3], by_base_end[3], by_platform_end[3];
    pfk_real base_spin[3], platform_spin[3];
    const pfk_real off = pfk_twist(frame, rod, main, main_state, own, base_mark, platform_mark);
    if (!sloped)
        return pfk_put(state, k, 1.0, off, pfk_zero, pfk_zero, pfk_zero, 0, row);
    pfk_carried(main, main_state, 1.0, rod->base_end_axes[0], first);
    pfk_spin_rate(rod->base_ending, first, base_mark, own->u, by_base_end, base_spin);
    pfk_rotate(frame, rod->platform_end_axes[0], first);
    pfk_spin_rate(rod->platform_ending, first, platform_mark, own->u, by_platform_end, platform_spin);
    pfk_along(by_platform_end, -1.0, by_base_end, by_platform_end);
    pfk_along(pfk_zero, -1.0, base_spin, base_spin);
    pfk_along(by_platform_end, -pfk_dot(by_platform_end, own->u), own->u, by_platform_end);
    pfk_along(pfk_zero, 1.0 / own->length, by_platform_end, by_platform_end);
    return pfk_put(state, k, 1.0, off, by_platform_end, base_spin, platform_spin, sloped, row);
}

#endif
/* The equations of a rod with base end F, platform end H, l = H - F: |l| = length; n . l = 0 for a base end on one
   hinge n, m . l = 0 for a platform end on one hinge m; and the angle about l between marks of its ends, where both
   keep it from spinning. */
static pfk_row *pfk_rod_rows(pfk_state *state, int k, int sloped, pfk_row *row)
{
    const pfk_leg *rod = &pfk_legs[k];
    const pfk_frame *frame = &state->frame[rod->frame];
    const pfk_placed *own = &state->leg[k];
    pfk_real n[3], across[3];
    if (sloped && pfk_has_proximal(rod))
        pfk_follow(frame, rod, &state->leg[k]);
    if (!rod->slides)
        row = pfk_put(state, k, PFK_SIZE, own->value[PFK_SLIDE], own->u, pfk_zero, pfk_zero, sloped, row);
    if (rod->base_ending == PFK_HINGE) {
        pfk_carried(&pfk_legs[rod->main], &state->leg[rod->main], 1.0, rod->base_end_axes[0], n);
        pfk_cross(n, own->span, across);
        row = pfk_put(state, k, PFK_SIZE, pfk_dot(n, own->span), n, across, pfk_zero, sloped, row);
    }
    if (rod->platform_ending == PFK_HINGE) {
        pfk_rotate(frame, rod->platform_end_axes[0], n);
        pfk_cross(n, own->span, across);
        row = pfk_put(state, k, PFK_SIZE, pfk_dot(n, own->span), n, pfk_zero, across, sloped, row);
    }
#if TWISTS
    if (rod->twists)
        row = pfk_twist_row(state, k, sloped, row);
#endif
    return row;
}

#if PIVOTS
/* kept . R moved + more = 0, for directions that what the base end and what the platform end is on have. */
static pfk_row *pfk_pair_row(const pfk_state *state, int k, const pfk_real kept[3], const pfk_real moved[3],
                             pfk_real more, int sloped, pfk_row *row)
{
    pfk_real turned[3], across[3];
    pfk_rotate(&state->frame[pfk_legs[k].frame], moved, turned);
    pfk_cross(turned, kept, across);
    return pfk_put(state, k, 1.0, pfk_dot(kept, turned) + more, pfk_zero, pfk_zero, across, sloped, row);
}

/* The equations of a pivot: its centre keeps to its slides, and pairs of directions keep their angle. */
static pfk_row *pfk_pivot_rows(const pfk_state *state, int k, int sloped, pfk_row *row)
{
    const pfk_leg *pivot = &pfk_legs[k];
    pfk_real turned[3], over = 0.0;
    int i;
    for (i = pivot->slides; i < 3; ++i)
        row = pfk_put(state, k, PFK_SIZE, pfk_dot(pivot->rows[i], state->leg[k].span), pivot->rows[i], pfk_zero,
                      pfk_zero, sloped, row);
    for (i = 0; i < pivot->upright; ++i) { /* an axis that is turned over meets the conditions too */
        pfk_rotate(&state->frame[pivot->frame], pivot->base_end_axes[i], turned);
        over = pfk_dot(turned, pivot->base_end_axes[i]) < 0.0 ? 2.0 : over;
    }
    for (i = 0; i < pivot->pairs; ++i)
        row = pfk_pair_row(state, k, pivot->kept[i], pivot->moved[i], over - pfk_dot(pivot->kept[i], pivot->moved[i]),
                           sloped, row);
    return row;
}

#endif
#if FK || RATES
/* The equation of hinges at an end of a rod, of which the coordinate at `place` is given: kept . u = value, kept a
   direction of what they are on. Of one hinge n it is n x line turned by the angle; of two, a and b, the first turns b,
   the second leaves a. */
static pfk_row *pfk_hinge_row(const pfk_state *state, int k, int place, pfk_real given, pfk_row *row)
{
    const pfk_leg *rod = &pfk_legs[k];
    const pfk_placed *own = &state->leg[k];
    const int at_platform_end = place >= PFK_PLATFORM_END;
    const int end = at_platform_end ? rod->platform_ending : rod->base_ending;
    const pfk_real (*axes)[3] = at_platform_end ? rod->platform_end_axes : rod->base_end_axes;
    pfk_real turned[3], across[3], kept[3], off, value = 0.0;
#if RATES
    pfk_real turning[3], now[3], by_value = 0.0;
#endif
    if (end == PFK_HINGE) {
        pfk_cross(axes[0], rod->line, across);
        pfk_about_angle(across, axes[0], given, turned);
    } else if (place == PFK_BASE_END || place == PFK_PLATFORM_END) {
        pfk_about_angle(axes[1], axes[0], given, turned);
        value = pfk_dot(axes[1], rod->line);
    } else {
        pfk_about_angle(rod->line, axes[1], given, across);
        pfk_copy(axes[0], turned);
        value = pfk_dot(turned, across);
#if RATES
        pfk_cross(axes[1], across, now);
        by_value = pfk_dot(axes[0], now);
#endif
    }
#if RATES
    pfk_cross(axes[0], turned, turning); /* 0 of the second of two hinges */
    if (at_platform_end)
        pfk_rotate(&state->frame[rod->frame], turning, now);
    else
        pfk_carried(&pfk_legs[rod->main], &state->leg[rod->main], 1.0, turning, now);
    row->by_given = (pfk_dot(now, own->span) - by_value * own->length) / PFK_SIZE;
#endif
    if (at_platform_end)
        pfk_rotate(&state->frame[rod->frame], turned, kept);
    else
        pfk_carried(&pfk_legs[rod->main], &state->leg[rod->main], 1.0, turned, kept);
    pfk_cross(kept, own->span, across);
    off = pfk_dot(kept, own->span) - value * own->length;
    pfk_along(kept, -value, own->u, kept);
    return pfk_put(state, k, PFK_SIZE, off, kept, at_platform_end ? pfk_zero : across,
                   at_platform_end ? across : pfk_zero, 1, row);
}

#if PIVOTS
#if RATES
/* The derivative of kept . R moved by a turn of `kept` about an axis, and by one of `moved` the other way. */
static pfk_real pfk_turning(const pfk_state *state, int k, const pfk_real axis[3], const pfk_real kept[3],
                            const pfk_real moved[3])
{
    pfk_real by_angle[3], turned[3];
    pfk_cross(axis, kept, by_angle);
    pfk_rotate(&state->frame[pfk_legs[k].frame], moved, turned);
    return pfk_dot(by_angle, turned);
}

static pfk_real pfk_turning_back(const pfk_state *state, int k, const pfk_real kept[3], const pfk_real axis[3],
                                 const pfk_real moved[3])
{
    pfk_real by_angle[3], turned[3];
    pfk_cross(axis, moved, by_angle);
    pfk_rotate(&state->frame[pfk_legs[k].frame], by_angle, turned);
    return -pfk_dot(kept, turned);
}

#endif
/* The equation of hinges a, b, c of a pivot, R = Rot(a) [Rot(b) [Rot(c)]]: kept . R moved = value, with one of both
   turned by the angle. */
static pfk_row *pfk_pivot_hinge_row(const pfk_state *state, int k, int place, pfk_real given, pfk_row *row)
{
    const pfk_leg *pivot = &pfk_legs[k];
    const pfk_real *a = pivot->base_end_axes[0], *b = pivot->base_end_axes[1], *c = pivot->base_end_axes[2];
    pfk_real across[3], turned[3];
    if (pivot->base_ending == PFK_HINGE) {
        pfk_about_angle(pivot->kept[0], a, given, turned);
#if RATES
        row->by_given = pfk_turning(state, k, a, turned, pivot->kept[1]);
#endif
        return pfk_pair_row(state, k, turned, pivot->kept[1], 0.0, 1, row);
    }
    if (pivot->base_ending == PFK_CROSS) {
        pfk_cross(a, b, across);
        pfk_about_angle(across, place == PFK_BASE_END ? a : b, place == PFK_BASE_END ? given : -given, turned);
#if RATES
        row->by_given = place == PFK_BASE_END ? pfk_turning(state, k, a, turned, b) : pfk_turning_back(state, k, a, b, turned);
#endif
        return place == PFK_BASE_END ? pfk_pair_row(state, k, turned, b, 0.0, 1, row)
                                 : pfk_pair_row(state, k, a, turned, 0.0, 1, row);
    }
    if (place == PFK_BASE_END) {
        pfk_about_angle(b, a, given, turned);
#if RATES
        row->by_given = pfk_turning(state, k, a, turned, c);
#endif
        return pfk_pair_row(state, k, turned, c, -pfk_dot(b, c), 1, row);
    }
    if (place == PFK_BASE_END + 1) {
        pfk_about_angle(c, b, given, turned);
#if RATES
        pfk_cross(b, turned, across);
        row->by_given = -pfk_dot(a, across);
#endif
        return pfk_pair_row(state, k, a, c, -pfk_dot(a, turned), 1, row);
    }
    pfk_about_angle(b, c, -given, turned);
#if RATES
    row->by_given = pfk_turning_back(state, k, a, c, turned);
#endif
    return pfk_pair_row(state, k, a, turned, -pfk_dot(a, b), 1, row);
}

#endif
/* The equation of an actuator whose coordinate is given, unless it is one that a proximal joint has. */
static pfk_row *pfk_drive_row(const pfk_state *state, const pfk_coordinate *driven, pfk_real given, pfk_row *row)
{
    const int k = driven->leg, place = driven->place;
    const pfk_placed *own = &state->leg[k];
#if PIVOTS
    if (pfk_legs[k].kind == PFK_PIVOT) {
        const pfk_real *slide = pfk_legs[k].rows[place >= PFK_PLATFORM_END ? place - PFK_PLATFORM_END : 0];
        if (place < PFK_PLATFORM_END)
            return pfk_pivot_hinge_row(state, k, place, given, row);
#if RATES
        row->by_given = -1.0 / PFK_SIZE;
#endif
        return pfk_put(state, k, PFK_SIZE, pfk_dot(slide, own->span) - given, slide, pfk_zero, pfk_zero, 1, row);
    }
#endif
    if (place == PFK_Q_PROXIMAL)
        return row;
#if RATES
    row->by_given = -1.0 / PFK_SIZE;
#endif
    if (place == PFK_SLIDE)
        return pfk_put(state, k, PFK_SIZE, own->value[PFK_SLIDE] - given, own->u, pfk_zero, pfk_zero, 1, row);
    return pfk_hinge_row(state, k, place, given, row);
}

#endif
/* Fills the equations of all legs, and those of actuators, if they are given; their derivatives if `sloped`. The leg
   whose equation is farthest from closed, and how far it is. */
static int pfk_equations(pfk_state *state, const pfk_real *given, int sloped, pfk_row row[PFK_ROWS], pfk_real *worst)
{
    pfk_row *end = row;
    int i, open = 0;
    for (i = 0; i < PFK_LEGS; ++i) {
#if PIVOTS
        if (pfk_legs[i].kind == PFK_PIVOT)
            end = pfk_pivot_rows(state, i, sloped, end);
#endif
        if (pfk_legs[i].kind == PFK_ROD)
            end = pfk_rod_rows(state, i, sloped, end);
    }
#if FK
    for (i = 0; given && i < PFK_ACTUATORS; ++i)
        end = pfk_drive_row(state, &pfk_driven[i], given[i], end);
#else
    (void)given;
#endif
    *worst = 0.0;
    for (; row < end; ++row) {
        if (!(fabs(row->off) <= 1e6)) {
            *worst = 1e6;
            return row->leg;
        }
        if (fabs(row->off) > *worst) {
            *worst = fabs(row->off);
            open = row->leg;
        }
    }
    return open;
}

#endif
#if MOVES
/* Turns a pose by a rotation vector, in base coordinates. */
static void pfk_spin(pfk_pose *pose, const pfk_real vector[3])
{
    const pfk_real angle = pfk_norm(vector);
    pfk_real axis[3], column[3], turned[3];
    int i, j;
    if (!(angle > 0.0))
        return;
    for (i = 0; i < 3; ++i)
        axis[i] = vector[i] / angle;
    for (j = 0; j < 3; ++j) {
        for (i = 0; i < 3; ++i)
            column[i] = pose->R[i][j];
        pfk_about_angle(column, axis, angle, turned);
        for (i = 0; i < 3; ++i)
            pose->R[i][j] = turned[i];
    }
}

#if YAW
/* The twist of a rotation about z: of R = S Rz(yaw), where S turns z the shortest way. */
static pfk_real pfk_yaw(const pfk_pose *pose)
{
    const pfk_real(*R)[3] = pose->R;
    const int about_x = R[0][0] >= R[1][1];
    const pfk_real z = about_x ? R[2][0] + R[0][2] : R[2][1] + R[1][2];
    const pfk_real w = about_x ? R[2][1] - R[1][2] : R[0][2] - R[2][0];
    if (R[2][2] >= 0.0)
        return atan2(R[1][0] - R[0][1], R[0][0] + R[1][1]);
    return atan2(2.0 * z * w, w * w - z * z); /* here nothing cancels */
}

/* Turns a pose about the base's z axis until its yaw is this. */
static void pfk_bring_yaw(pfk_pose *pose, pfk_real yaw)
{
    const pfk_real turn[3] = {0.0, 0.0, yaw - pfk_yaw(pose)};
    pfk_spin(pose, turn);
}

#endif
/* Solves m x = right by least squares, with reflections: `m` holds the right side in its last column and is used up.
   Unknowns that it does not tell stay 0; 1 where there are such. */
static int pfk_least_squares(pfk_real m[PFK_ROWS][PFK_UNKNOWNS + 1], int rows, int unknowns, pfk_real x[PFK_UNKNOWNS])
{
    pfk_real size, part, share, largest = 0.0;
    int row[PFK_UNKNOWNS] = {0}, i, j, k, rank = 0;
    for (k = 0; k < unknowns; ++k) {
        size = 0.0;
        for (i = rank; i < rows; ++i)
            size += m[i][k] * m[i][k];
        size = sqrt(size);
        largest = size > largest ? size : largest;
        row[k] = -1;
        if (!(size > PFK_RANK * largest))
            continue;
        row[k] = rank;
        size = m[rank][k] > 0.0 ? -size : size;
        part = size * (size - m[rank][k]);
        m[rank][k] -= size;
        for (j = k + 1; j <= unknowns; ++j) {
            share = 0.0;
            for (i = rank; i < rows; ++i)
                share += m[i][k] * m[i][j];
            for (i = rank; i < rows; ++i)
                m[i][j] -= share / part * m[i][k];
        }
        m[rank++][k] = size;
    }
    for (k = unknowns - 1; k >= 0; --k) {
        x[k] = 0.0;
        if (row[k] < 0)
            continue;
        x[k] = m[row[k]][unknowns];
        for (j = k + 1; j < unknowns; ++j)
            x[k] -= m[row[k]][j] * x[j];
        x[k] /= m[row[k]][k];
    }
    return rank < unknowns;
}

/* Gives a pose the opposite of the turn that it has made since the start. */
static void pfk_turn_back(const pfk_pose *start, pfk_pose *pose)
{
    pfk_pose turned;
    int i, j, k, n;
    for (i = 0; i < 3; ++i)
        for (j = 0; j < 3; ++j) {
            turned.R[i][j] = 0.0;
            for (k = 0; k < 3; ++k)
                for (n = 0; n < 3; ++n)
                    turned.R[i][j] += start->R[i][k] * pose->R[n][k] * start->R[n][j];
        }
    for (i = 0; i < 3; ++i)
        for (j = 0; j < 3; ++j)
            pose->R[i][j] = turned.R[i][j];
}

/* Unknowns: redundant joints, with nothing of the pose, what the task leaves open of it, or all of it. */
enum { PFK_REDUNDANT_ALONE, PFK_UNSET, PFK_ALL };

/* Fills the motions of the unknowns of a pose; returns their number. */
static int pfk_motions(const pfk_pose *pose, int moves, pfk_real motion[PFK_UNKNOWNS][PFK_COLUMNS])
{
    int i, j, count = 0;
    for (i = 0; i < PFK_UNKNOWNS; ++i)
        for (j = 0; j < PFK_COLUMNS; ++j)
            motion[i][j] = 0.0;
    for (i = 0; i < 3 && moves != PFK_REDUNDANT_ALONE; ++i)
        if (moves == PFK_ALL || !pfk_axes[i])
            motion[count++][i] = PFK_SIZE;
    if ((moves == PFK_ALL && PFK_TURNING) || (moves == PFK_UNSET && PFK_ROTATIONS == 0)) {
        for (i = 0; i < 3; ++i)
            motion[count++][3 + i] = 1.0;
    } else if (moves == PFK_UNSET && PFK_ROTATIONS == 2) {
        for (i = 0; i < 3; ++i)
            motion[count][3 + i] = pose->R[i][2];
        ++count;
#if YAW
    } else if (moves == PFK_UNSET) { /* about axes square to the mean of both z axes it turns without yaw */
        const pfk_real mean[3] = {pose->R[0][2], pose->R[1][2], pose->R[2][2] + 1.0}, x[3] = {1.0, 0.0, 0.0};
        pfk_real *first = motion[count++] + 3, *second = motion[count++] + 3;
        pfk_cross(x, mean, first);
        pfk_cross(mean, first, second);
        pfk_along(pfk_zero, 1.0 / pfk_norm(first), first, first);
        pfk_along(pfk_zero, 1.0 / pfk_norm(second), second, second);
#endif
    }
    return count;
}

#if REDUNDANT
/* Adds the motions of redundant joints that are not given to `count` of the pose; returns their number. */
static int pfk_arm_motions(const pfk_state *state, int count, pfk_real motion[PFK_UNKNOWNS][PFK_COLUMNS])
{
    int k;
    for (k = 0; k < PFK_LEGS; ++k) {
        const pfk_leg *joint = &pfk_legs[k];
        if (joint->kind == PFK_REDUNDANT && joint->has_rows && !joint->is_mirror && !state->leg[k].is_given)
            motion[count++][6 + joint->column] = joint->proximal == PFK_CRANK ? 1.0 : PFK_SIZE;
    }
    return count;
}

#endif

/* Moves what is open until all legs close, in no more than `most` steps that together go no farther than `farthest`, by
   Newton's method: 0, or the number of a leg that does not. All of the pose is open where actuators are given: then,
   where it is strict, steps must contract, for what closes otherwise may be in any assembly mode. Where it is strict
   without them, all legs must reach at every step. */
static int pfk_settle(pfk_pose *pose, const pfk_real *given, int moves, int most, pfk_real farthest, int strict,
                      pfk_state *state, int *steps)
{
    const int rows = given ? PFK_ROWS : PFK_OWN_ROWS;
    const pfk_pose start = *pose;
    pfk_row row[PFK_ROWS];
    pfk_real system[PFK_ROWS][PFK_UNKNOWNS + 1], motion[PFK_UNKNOWNS][PFK_COLUMNS], x[PFK_UNKNOWNS];
    pfk_real twist[PFK_COLUMNS], worst, last = 0.0, gone = 0.0, size, share;
    pfk_real most_size = PFK_FIRST_STEP;
    int i, j, k, open, missing, count, turned = 0;
#if REDUNDANT
    int redundant_from;
#endif
    for (*steps = 0;; ++*steps) {
        missing = pfk_place(pose, given, !given, state);
        if (missing && strict && !given)
            return missing;
        open = pfk_equations(state, given, 1, row, &worst);
        if (worst <= PFK_CLOSED || (*steps && worst <= PFK_CLOSE && worst > 0.25 * last))
            return missing;
        if (*steps == most || gone > farthest)
            return open;
        last = worst;
        count = pfk_motions(pose, moves, motion);
#if REDUNDANT
        redundant_from = count;
        count = pfk_arm_motions(state, count, motion);
#endif
        for (i = 0; i < rows; ++i) {
            for (j = 0; j < count; ++j) {
                system[i][j] = 0.0;
                for (k = 0; k < PFK_COLUMNS; ++k)
                    system[i][j] += row[i].slope[k] * motion[j][k];
            }
            system[i][count] = -row[i].off;
        }
        if (pfk_least_squares(system, rows, count, x) && moves != PFK_UNSET)
            return open; /* unknowns of the task may stay */
        for (k = 0; k < PFK_COLUMNS; ++k) {
            twist[k] = 0.0;
            for (j = 0; j < count; ++j)
                twist[k] += x[j] * motion[j][k];
        }
        size = pfk_norm(twist) / PFK_SIZE;
        size = pfk_norm(twist + 3) > size ? pfk_norm(twist + 3) : size;
#if REDUNDANT
        for (j = redundant_from; j < count; ++j)
            size = fabs(x[j]) > size ? fabs(x[j]) : size;
#endif
        /* at rest but open, as more actuators than freedoms can be: once more, turned the other way */
        if (given && !turned && size < 0.1 * worst) {
            turned = 1;
            pfk_turn_back(&start, pose);
            continue;
        }
        if (given && strict && worst > PFK_CLOSE && !(size <= most_size))
            return open;
        most_size = PFK_CONTRACTION * size;
        share = size > PFK_LONGEST_STEP ? PFK_LONGEST_STEP / size : 1.0;
        gone += share * size;
        for (k = 0; k < PFK_COLUMNS; ++k)
            twist[k] *= share;
        pfk_along(pose->p, 1.0, twist, pose->p);
#if YAW
        if (moves == PFK_UNSET) {
            const pfk_real yaw = pfk_yaw(pose);
            pfk_spin(pose, twist + 3);
            pfk_bring_yaw(pose, yaw);
        } else
#endif
            pfk_spin(pose, twist + 3);
#if REDUNDANT
        for (k = 0; k < PFK_N_REDUNDANT; ++k)
            state->q_redundant[k] += twist[6 + k];
#endif
    }
}

#endif
/* Makes the rotation of a pose the nearest that is orthonormal; 1 where it is no rotation, or not of finite numbers. */
static int pfk_make_exact(pfk_pose *pose)
{
    pfk_real gram[3][3], turned[3], off = 0.0;
    int i, j, k, step;
    for (step = 0; step < 2 && (step == 0 || off * off > 1e-3 * PFK_CLOSED); ++step) { /* off becomes its square */
        for (i = 0; i < 3; ++i)
            for (j = 0; j <= i; ++j) {
                gram[i][j] = i == j ? -1.0 : 0.0;
                for (k = 0; k < 3; ++k)
                    gram[i][j] += pose->R[k][i] * pose->R[k][j];
                gram[j][i] = gram[i][j];
                if (step == 0)
                    off += (i == j ? 1.0 : 2.0) * fabs(gram[i][j]);
            }
        for (k = 0; k < 3; ++k) {
            for (j = 0; j < 3; ++j)
                turned[j] = 0.5 * pfk_dot(pose->R[k], gram[j]);
            for (j = 0; j < 3; ++j)
                pose->R[k][j] -= turned[j];
        }
    }
    off += fabs(0.0 * (pose->p[0] + pose->p[1] + pose->p[2]));
    pfk_cross(pose->R[0], pose->R[1], turned);
    return !(off <= PFK_NO_ROTATION && pfk_dot(turned, pose->R[2]) > 0.0);
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

void pfk_pose_rpy(pfk_real x, pfk_real y, pfk_real z, pfk_real roll, pfk_real pitch, pfk_real yaw, pfk_pose *pose)
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
}

void pfk_rpy(const pfk_pose *pose, pfk_real angles[3])
{
    const pfk_real level = sqrt(pose->R[0][0] * pose->R[0][0] + pose->R[1][0] * pose->R[1][0]);
    angles[0] = atan2(pose->R[2][1], pose->R[2][2]);
    angles[1] = atan2(-pose->R[2][0], level);
    angles[2] = atan2(pose->R[1][0], pose->R[0][0]);
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

#if LIMITS
#if CONES
/* Angle between two directions. */
static pfk_real pfk_angle_between(const pfk_real a[3], const pfk_real b[3])
{
    pfk_real across[3];
    pfk_cross(a, b, across);
    return atan2(pfk_norm(across), pfk_dot(a, b));
}

#endif
#if CLEARANCE
#if BODIES
/* Fills the displacement of a rod on what its base end is on, of points of its line and of directions along it: it may spin
   about the line in any way. */
static void pfk_place_line(const pfk_state *state, const pfk_body *own, const pfk_pose *on, pfk_pose *body)
{
    const pfk_leg *rod = &pfk_legs[own->leg];
    const pfk_placed *placed = &state->leg[own->leg];
    const int at_base_end = own->moves == PFK_WITH_BASE_END;
    pfk_real end[3];
    int i, j;
    pfk_along(rod->base_end, at_base_end ? 0.0 : rod->length, rod->line, end);
    for (i = 0; i < 3; ++i) {
        for (j = 0; j < 3; ++j)
            body->R[i][j] = pfk_dot(on->R[i], placed->u) * rod->line[j];
        body->p[i] = on->p[i] + pfk_dot(on->R[i], at_base_end ? placed->base_end : placed->platform_end)
                     - pfk_dot(body->R[i], end);
    }
}

#endif
/* Fills the displacements of bodies from home: what is at x there is at R x + p. */
static void pfk_place_bodies(const pfk_state *state, pfk_pose body[PFK_BODIES])
{
    const pfk_frame *frame = &state->frame[PFK_FROM_BASE];
    int i, j;
#if BODIES
    int k;
#endif
    for (i = 0; i < 3; ++i) {
        for (j = 0; j < 3; ++j) {
            body[0].R[i][j] = i == j ? 1.0 : 0.0;
            body[1].R[i][j] = frame->R[i][j];
        }
        body[0].p[i] = 0.0;
        body[1].p[i] = frame->p[i] - pfk_dot(frame->R[i], pfk_reference);
    }
#if BODIES
    for (k = 2; k < PFK_BODIES; ++k) {
        const pfk_body *own = &pfk_bodies[k - 2];
        const pfk_pose *on = &body[own->on];
        const pfk_real value = own->sense * state->leg[own->leg].value[own->place];
        const pfk_real cosine = own->moves == PFK_TURNS ? cos(value) : 1.0;
        const pfk_real sine = own->moves == PFK_TURNS ? sin(value) : 0.0;
        body[k] = *on;
        if (own->moves > PFK_TURNS) {
            pfk_place_line(state, own, on, &body[k]);
            continue;
        }
        for (i = 0; i < 3; ++i) {
            if (own->moves == PFK_TURNS) {
                pfk_about(on->R[i], own->axis, cosine, -sine, body[k].R[i]);
                body[k].p[i] += pfk_dot(on->R[i], own->point) - pfk_dot(body[k].R[i], own->point);
            } else {
                body[k].p[i] += value * pfk_dot(on->R[i], own->axis);
            }
        }
    }
#endif
}

/* Fills the links at the state of the legs. */
static void pfk_place_links(const pfk_state *state, pfk_solid solid[PFK_LINKS])
{
    pfk_pose body[PFK_BODIES];
    int i, j, k;
    pfk_place_bodies(state, body);
    for (k = 0; k < PFK_LINKS; ++k) {
        const pfk_link *link = &pfk_links[k];
        solid[k] = link->home;
        for (j = 0; j < 2; ++j) {
            const pfk_pose *own = &body[link->body[j]];
            for (i = 0; i < 3; ++i)
                solid[k].at[j][i] = own->p[i] + pfk_dot(own->R[i], link->home.at[j]);
        }
#if SOLIDS
        for (j = 1; j < 4 && link->home.kind != PFK_CAPSULE; ++j)
            for (i = 0; i < 3; ++i)
                solid[k].at[j][i] = pfk_dot(body[link->body[0]].R[i], link->home.at[j]);
#endif
    }
}

static pfk_real pfk_between_0_and_1(pfk_real x)
{
    return x < 0.0 ? 0.0 : (x > 1.0 ? 1.0 : x);
}

/* The square of the distance of two segments from p to q and from x to y. With d = q - p, e = y - x, w = x - p and n =
   d x e the common perpendicular is at p + s d, s = (w x e) n / n^2: of nearly parallel segments that is more exact than by
   d^2 e^2 - (d e)^2. Clamped s gives t, and clamped t gives s once more. */
static pfk_real pfk_between_axes(const pfk_real p[3], const pfk_real q[3], const pfk_real x[3], const pfk_real y[3])
{
    pfk_real d[3], e[3], w[3], n[3], across[3], square, s, t;
    pfk_along(q, -1.0, p, d);
    pfk_along(y, -1.0, x, e);
    pfk_along(x, -1.0, p, w);
    pfk_cross(d, e, n);
    pfk_cross(w, e, across);
    square = pfk_dot(n, n);
    s = pfk_between_0_and_1(pfk_dot(across, n) / (square > 0.0 ? square : 1.0));
    square = pfk_dot(e, e);
    t = pfk_between_0_and_1((s * pfk_dot(d, e) - pfk_dot(w, e)) / (square > 0.0 ? square : 1.0));
    square = pfk_dot(d, d);
    s = pfk_between_0_and_1((t * pfk_dot(d, e) + pfk_dot(w, d)) / (square > 0.0 ? square : 1.0));
    pfk_along(w, t, e, w);
    pfk_along(w, -s, d, w);
    return pfk_dot(w, w);
}

#if SOLIDS
static pfk_real pfk_clamp(pfk_real x, pfk_real most)
{
    return x < -most ? -most : (x > most ? most : x);
}

/* The point of a core that is nearest to x: x itself if it is inside. */
static void pfk_nearest_in(const pfk_solid *own, const pfk_real x[3], pfk_real out[3])
{
    pfk_real offset[3], flat[3], along, size;
    int k;
    pfk_along(x, -1.0, own->at[0], offset);
    pfk_copy(own->at[0], out);
    if (own->kind == PFK_CAPSULE) {
        pfk_along(own->at[1], -1.0, own->at[0], flat);
        size = pfk_dot(flat, flat);
        pfk_along(out, size > 0.0 ? pfk_between_0_and_1(pfk_dot(offset, flat) / size) : 0.0, flat, out);
    } else if (own->kind == PFK_BOX) {
        for (k = 0; k < 3; ++k)
            pfk_along(out, pfk_clamp(pfk_dot(offset, own->at[1 + k]), own->half[k]), own->at[1 + k], out);
    } else {
        along = pfk_dot(offset, own->at[1]);
        pfk_along(offset, -along, own->at[1], flat);
        size = pfk_norm(flat);
        pfk_along(out, size > own->half[0] ? own->half[0] / size : 1.0, flat, out);
        pfk_along(out, pfk_clamp(along, own->half[1]), own->at[1], out);
    }
}

/* The point of a core that is farthest along n. */
static void pfk_farthest_in(const pfk_solid *own, const pfk_real n[3], pfk_real out[3])
{
    pfk_real flat[3], size;
    int k;
    pfk_copy(own->at[0], out);
    if (own->kind == PFK_CAPSULE) {
        if (pfk_dot(n, own->at[1]) > pfk_dot(n, out))
            pfk_copy(own->at[1], out);
    } else if (own->kind == PFK_BOX) {
        for (k = 0; k < 3; ++k)
            pfk_along(out, pfk_dot(n, own->at[1 + k]) > 0.0 ? own->half[k] : -own->half[k], own->at[1 + k], out);
    } else {
        pfk_along(n, -pfk_dot(n, own->at[1]), own->at[1], flat);
        pfk_along(flat, -pfk_dot(flat, own->at[1]), own->at[1], flat); /* of n along the axis rounding is left */
        size = pfk_norm(flat);
        pfk_along(out, size > 0.0 ? own->half[0] / size : 0.0, flat, out);
        pfk_along(out, pfk_dot(n, own->at[1]) > 0.0 ? own->half[1] : -own->half[1], own->at[1], out);
    }
}

/* The k-th of the directions that shape a core: of a box 3, of others 1; 0 where there is none. */
static int pfk_direction(const pfk_solid *own, int k, pfk_real out[3])
{
    pfk_real size;
    pfk_copy(own->at[1 + k], out);
    if (own->kind == PFK_BOX || (own->kind == PFK_DISC && k == 0))
        return 1;
    pfk_along(own->at[1], -1.0, own->at[0], out);
    size = pfk_norm(out);
    pfk_along(pfk_zero, own->kind == PFK_CAPSULE && k == 0 && size > 0.0 ? 1.0 / size : 0.0, out, out);
    return own->kind == PFK_CAPSULE && k == 0 && size > 0.0;
}

/* Two unit vectors square to a unit vector, and to each other. */
static void pfk_square_to(const pfk_real n[3], pfk_real first[3], pfk_real second[3])
{
    const pfk_real x = fabs(n[0]), y = fabs(n[1]), z = fabs(n[2]);
    pfk_real axis[3] = {0.0, 0.0, 0.0};
    axis[x <= y && x <= z ? 0 : (y <= z ? 1 : 2)] = 1.0;
    pfk_cross(n, axis, first);
    pfk_along(pfk_zero, 1.0 / pfk_norm(first), first, first);
    pfk_cross(n, first, second);
}

/* cos(angle) u + sin(angle) v. */
static void pfk_around(pfk_real angle, const pfk_real u[3], const pfk_real v[3], pfk_real out[3])
{
    pfk_along(pfk_zero, cos(angle), u, out);
    pfk_along(out, sin(angle), v, out);
}

/* Of two cores: the square of the least distance so far, and the squares of the places that have it. */
typedef struct {
    pfk_real square, scale;
} pfk_least;

/* The distance of a point from a core, along a line: fills the slope of half its square. */
static pfk_real pfk_off(const pfk_solid *other, const pfk_real x[3], const pfk_real line[3], pfk_real *slope)
{
    pfk_real off[3];
    pfk_nearest_in(other, x, off);
    pfk_along(x, -1.0, off, off);
    *slope = pfk_dot(off, line);
    return pfk_dot(off, off);
}

static void pfk_try_point(const pfk_real x[3], const pfk_solid *other, pfk_least *least)
{
    pfk_real y[3], gap[3], square;
    pfk_nearest_in(other, x, y);
    pfk_along(y, -1.0, x, gap);
    square = pfk_dot(gap, gap);
    if (square < least->square) {
        least->square = square;
        least->scale = pfk_dot(x, x) + pfk_dot(y, y);
    }
}

/* The point of a segment that is nearest to a core: half the square of its distance is convex, its slope rises; the
   root, between the ends or at one of them, by the false position of Illinois. */
static void pfk_nearest_along(const pfk_real p[3], const pfk_real q[3], const pfk_solid *other, pfk_real x[3])
{
    pfk_real d[3], low = 0.0, high = 1.0, at_low, at_high, slope, t = 0.0, before;
    int step, side = 0;
    pfk_along(q, -1.0, p, d);
    pfk_off(other, p, d, &at_low);
    pfk_off(other, q, d, &at_high);
    if (at_low >= 0.0 || at_high <= 0.0) {
        pfk_copy(at_low >= 0.0 ? p : q, x);
        return;
    }
    for (step = 0; step < PFK_ROOT_STEPS; ++step) {
        before = t;
        t = step % 4 < 3 ? high - at_high * (high - low) / (at_high - at_low) : 0.5 * (low + high);
        pfk_along(p, t, d, x);
        pfk_off(other, x, d, &slope);
        if (!(slope < 0.0 || slope > 0.0) || !(t < before || t > before) || !(low < t && t < high))
            break;
        if (slope > 0.0) {
            high = t;
            at_high = slope;
            at_low = side == 1 ? 0.5 * at_low : at_low;
            side = 1;
        } else {
            low = t;
            at_low = slope;
            at_high = side == -1 ? 0.5 * at_high : at_high;
            side = -1;
        }
    }
    pfk_along(p, t, d, x);
}

static void pfk_try_line(const pfk_real p[3], const pfk_real q[3], const pfk_solid *other, pfk_least *least)
{
    pfk_real x[3];
    pfk_nearest_along(p, q, other, x);
    pfk_try_point(x, other, least);
}

/* Tries the point of a disc's rim that is nearest to a core: of places all around, refined by the slope's sign. */
static void pfk_try_rim(const pfk_solid *own, const pfk_real centre[3], const pfk_solid *other, pfk_least *least)
{
    const pfk_real part = PFK_TURN / PFK_RIM;
    pfk_real u[3], v[3], x[3], tangent[3], square, slope, nearest = PFK_FAR, middle = 0.0, low, high;
    int k;
    pfk_square_to(own->at[1], u, v);
    pfk_along(pfk_zero, own->half[0], u, u);
    pfk_along(pfk_zero, own->half[0], v, v);
    for (k = 0; k < PFK_RIM; ++k) {
        pfk_around((pfk_real)k * part, u, v, x);
        pfk_along(centre, 1.0, x, x);
        square = pfk_off(other, x, u, &slope);
        if (square < nearest) {
            nearest = square;
            middle = (pfk_real)k * part;
        }
    }
    low = middle - part;
    high = middle + part;
    for (k = 0; k < PFK_RIM_HALVINGS; ++k) {
        middle = 0.5 * (low + high);
        pfk_around(middle, u, v, x);
        pfk_along(centre, 1.0, x, x);
        pfk_around(middle + 0.25 * PFK_TURN, u, v, tangent);
        pfk_off(other, x, tangent, &slope);
        if (slope > 0.0)
            high = middle;
        else
            low = middle;
    }
    pfk_try_point(x, other, least);
}

/* Tries the points of one core at which it may be nearest to another: on its lines and rims, or farthest along an axis
   of the other, above a face of it; of two discs beside each other on the common perpendicular of their axes. */
static void pfk_try_features(const pfk_solid *own, const pfk_solid *other, pfk_least *least)
{
    pfk_real axis[3], p[3], q[3], x[3], middle[3];
    int i, j, k, sign;
    if (own->kind == PFK_CAPSULE) {
        pfk_try_line(own->at[0], own->at[1], other, least);
        return;
    }
    if (other->kind == PFK_CAPSULE)
        return; /* its line is tried against the whole of this core */
    for (k = 0; k < 3; ++k)
        for (sign = -1; pfk_direction(other, k, axis) && sign < 2; sign += 2) {
            pfk_along(pfk_zero, (pfk_real)sign, axis, axis);
            pfk_farthest_in(own, axis, x);
            pfk_try_point(x, other, least);
        }
    for (k = 0; k < 12 && own->kind == PFK_BOX; ++k) { /* its edges along each axis */
        i = (k / 4 + 1) % 3;
        j = (k / 4 + 2) % 3;
        pfk_along(own->at[0], k & 1 ? own->half[i] : -own->half[i], own->at[1 + i], middle);
        pfk_along(middle, k & 2 ? own->half[j] : -own->half[j], own->at[1 + j], middle);
        pfk_along(middle, -own->half[k / 4], own->at[1 + k / 4], p);
        pfk_along(middle, own->half[k / 4], own->at[1 + k / 4], q);
        pfk_try_line(p, q, other, least);
    }
    if (own->kind == PFK_BOX)
        return;
    pfk_along(own->at[0], -own->half[1], own->at[1], p);
    pfk_along(own->at[0], own->half[1], own->at[1], q);
    pfk_try_rim(own, q, other, least);
    pfk_try_rim(own, p, other, least);
    if (other->kind == PFK_DISC) {
        pfk_nearest_along(p, q, other, x);
        pfk_nearest_in(other, x, middle);
        pfk_nearest_in(own, middle, x);
        pfk_try_point(x, other, least);
    }
}

/* Two cores that overlap; the unit vector along which the second has the shortest way out of the first, so far, and how
   long it is. */
typedef struct {
    const pfk_solid *own, *other;
    pfk_real n[3], out;
} pfk_exit;

static pfk_real pfk_overlap_along(const pfk_real n[3], const pfk_exit *found)
{
    pfk_real back[3], x[3], y[3];
    pfk_along(pfk_zero, -1.0, n, back);
    pfk_farthest_in(found->own, n, x);
    pfk_farthest_in(found->other, back, y);
    return pfk_dot(n, x) - pfk_dot(n, y);
}

/* Tries a direction of any length, either way round; 1 where it is shorter. */
static int pfk_try_way(const pfk_real n[3], pfk_exit *found)
{
    const pfk_real length = pfk_norm(n);
    pfk_real unit[3], overlap;
    int sign, is_shorter = 0;
    for (sign = 1; length > 1e-9 && sign > -2; sign -= 2) {
        pfk_along(pfk_zero, (pfk_real)sign / length, n, unit);
        overlap = pfk_overlap_along(unit, found);
        if (overlap < found->out) {
            found->out = overlap;
            pfk_copy(unit, found->n);
            is_shorter = 1;
        }
    }
    return is_shorter;
}

/* Tries the best of all directions square to an axis: of places all around, refined by halved steps. */
static void pfk_try_around(const pfk_real axis[3], pfk_exit *found)
{
    pfk_real u[3], v[3], n[3], least = PFK_FAR, at = 0.0, step = PFK_TURN / PFK_WAYS, angle, overlap;
    int k;
    pfk_square_to(axis, u, v);
    for (k = 0; k < PFK_WAYS + 2 * PFK_WAY_HALVINGS; ++k) {
        angle = k < PFK_WAYS ? (pfk_real)k * step : at + step;
        pfk_around(angle, u, v, n);
        overlap = pfk_overlap_along(n, found);
        if (overlap < least) {
            least = overlap;
            at = angle;
        }
        if (k >= PFK_WAYS)
            step *= (k - PFK_WAYS) % 2 == 0 ? -1.0 : -0.5;
    }
    pfk_around(at, u, v, n);
    pfk_try_way(n, found);
}

/* By how much the second of two cores that overlap has to move out of the first, at least. The faces of the difference
   of two boxes, or of a box and a line, are square to an axis of one or to one of each: the shortest way is one of these.
   With discs the difference is also round: a ball within touches it on a face, or square to one of these axes, or, between
   two rims, where it is curved both ways; never on an edge, which is sharp. */
static pfk_real pfk_way_out(const pfk_solid *own, const pfk_solid *other)
{
    pfk_exit found = {own, other, {0.0, 0.0, 1.0}, 0.0};
    pfk_real axis[2][3], u[3], v[3], n[3], step;
    int i, j, k, is_shorter;
    found.out = pfk_overlap_along(found.n, &found);
    for (i = 0; i < 2; ++i)
        for (k = 0; k < 3; ++k)
            if (pfk_direction(i ? other : own, k, axis[0])) {
                pfk_try_way(axis[0], &found);
                pfk_square_to(axis[0], u, v);
                pfk_try_way(u, &found);
                if (own->kind == PFK_DISC || other->kind == PFK_DISC)
                    pfk_try_around(axis[0], &found);
                for (j = 0; j < 3 && i == 0; ++j)
                    if (pfk_direction(other, j, axis[1])) {
                        pfk_cross(axis[0], axis[1], n);
                        pfk_try_way(n, &found);
                    }
            }
    if (own->kind != PFK_DISC || other->kind != PFK_DISC)
        return found.out;
    for (k = 0; k < PFK_WAYS; ++k) { /* spread over half a sphere: each is tried both ways */
        n[2] = ((pfk_real)k + 0.5) / PFK_WAYS;
        n[0] = sqrt(1.0 - n[2] * n[2]) * cos(PFK_GOLDEN * (pfk_real)k);
        n[1] = sqrt(1.0 - n[2] * n[2]) * sin(PFK_GOLDEN * (pfk_real)k);
        pfk_try_way(n, &found);
    }
    for (step = PFK_WAY_FIRST; step > PFK_WAY_LAST; step *= is_shorter ? 1.0 : 0.5) {
        is_shorter = 0;
        for (k = 0; k < 8; ++k) {
            pfk_square_to(found.n, u, v);
            pfk_around(PFK_GOLDEN * (pfk_real)k, u, v, n);
            pfk_along(found.n, step, n, n);
            is_shorter |= pfk_try_way(n, &found);
        }
    }
    return found.out;
}

/* The middle of a solid; how far it reaches from there. */
static pfk_real pfk_reach_of(const pfk_solid *own, pfk_real middle[3])
{
    pfk_real half[3];
    pfk_copy(own->at[0], middle);
    pfk_copy(own->half, half);
    if (own->kind == PFK_CAPSULE) {
        pfk_along(own->at[1], -1.0, own->at[0], half);
        pfk_along(pfk_zero, 0.5, half, half);
        pfk_along(middle, 1.0, half, middle);
    }
    return pfk_norm(half) + own->round;
}

/* The distance of two cores; less than 0, by how much they overlap. */
static pfk_real pfk_between_cores(const pfk_solid *own, const pfk_solid *other)
{
    pfk_least least = {PFK_FAR, 0.0};
    pfk_try_features(own, other, &least);
    pfk_try_features(other, own, &least);
    if (least.square > PFK_CLOSED * PFK_CLOSED * least.scale)
        return sqrt(least.square);
    return -pfk_way_out(own, other);
}

#endif
/* Fills the least distance between two links, negative where they overlap, and the number of their pair; 0, or PFK_PAIR +
   this number where it is less than the clearance. */
static int pfk_nearest(const pfk_state *state, pfk_real *least, int *pair)
{
    pfk_solid solid[PFK_LINKS];
    pfk_real distance;
#if SOLIDS
    pfk_real from[3], to[3], reach;
#endif
    int k;
    pfk_place_links(state, solid);
    *least = PFK_FAR;
    *pair = 1;
    for (k = 0; k < PFK_PAIRS; ++k) {
        const pfk_solid *own = &solid[pfk_pairs[k][0]], *other = &solid[pfk_pairs[k][1]];
#if SOLIDS
        if (own->kind != PFK_CAPSULE || other->kind != PFK_CAPSULE) {
            reach = pfk_reach_of(own, from) + pfk_reach_of(other, to);
            pfk_along(to, -1.0, from, to);
            if (pfk_norm(to) - reach >= *least)
                continue;
            distance = pfk_between_cores(own, other);
        } else
#endif
            distance = sqrt(pfk_between_axes(own->at[0], own->at[1], other->at[0], other->at[1]));
        distance -= own->round + other->round;
        if (distance < *least) {
            *least = distance;
            *pair = k + 1;
        }
    }
    return *least >= PFK_CLEARANCE - PFK_KEPT * PFK_SIZE ? 0 : PFK_PAIR + *pair;
}

static int pfk_too_near(const pfk_state *state)
{
    pfk_real distance;
    int pair;
    return pfk_nearest(state, &distance, &pair);
}

#endif
/* Fills the room that is left before every limit; 0, or the number of the one that is exceeded most. */
#if CLEARANCE
/* Where none is, PFK_PAIR + the number of the nearest pair of links, if it is too near. */
#endif
static int pfk_slacks(const pfk_state *state, pfk_real slack[])
{
    pfk_real value, unit, worst = PFK_KEPT;
    int i, exceeded = 0;
    for (i = 0; i < PFK_RANGES; ++i) {
        value = pfk_deviation(&pfk_limited[i], state);
        slack[2 * i] = value - pfk_limited[i].lo;
        slack[2 * i + 1] = pfk_limited[i].hi - value;
    }
#if CONES
    for (i = 0; i < PFK_CONES; ++i) {
        const pfk_placed *leg = &state->leg[pfk_cones[i].leg];
        const pfk_real *line = pfk_cones[i].is_platform_end ? leg->platform_line : leg->base_line;
        slack[2 * PFK_RANGES + i] = pfk_cones[i].half_angle - pfk_angle_between(pfk_cones[i].axis, line);
    }
#endif
    for (i = 0; i < PFK_LIMITS; ++i) {
        unit = i < 2 * PFK_RANGES && pfk_limited[i / 2].is_length ? PFK_SIZE : 1.0;
        if (!(-slack[i] / unit <= worst)) {
            worst = -slack[i] / unit;
            exceeded = i + 1;
        }
    }
#if CLEARANCE
    return exceeded ? exceeded : pfk_too_near(state);
#else
    return exceeded;
#endif
}

#endif
#if CONTINUES
/* Turns a pose a share of the way to another. */
static void pfk_turn_toward(pfk_pose *pose, const pfk_pose *target, pfk_real share)
{
    pfk_real off[3][3], turn[3], sine, cosine;
    int i, j;
    for (i = 0; i < 3; ++i)
        for (j = 0; j < 3; ++j)
            off[i][j] = pfk_dot(target->R[i], pose->R[j]);
    for (i = 0; i < 3; ++i)
        turn[i] = 0.5 * (off[(i + 2) % 3][(i + 1) % 3] - off[(i + 1) % 3][(i + 2) % 3]);
    sine = pfk_norm(turn);
    cosine = 0.5 * (off[0][0] + off[1][1] + off[2][2] - 1.0);
    for (i = 0; i < 3 && sine > 0.0; ++i)
        turn[i] *= share * atan2(sine, cosine) / sine;
    if (share < 1.0)
        pfk_spin(pose, turn);
    for (i = 0; i < 3 && !(share < 1.0); ++i)
        for (j = 0; j < 3; ++j)
            pose->R[i][j] = target->R[i][j];
}

/* Turns a pose a share of the shortest way that brings its z axis to a target's; 1 where that is turned over. */
static int pfk_lean_toward(pfk_pose *pose, const pfk_pose *target, pfk_real share)
{
    pfk_real now[3], aim[3], turn[3], sine, cosine;
    int i;
    for (i = 0; i < 3; ++i) {
        now[i] = pose->R[i][2];
        aim[i] = target->R[i][2];
    }
    pfk_cross(now, aim, turn);
    sine = pfk_norm(turn);
    cosine = pfk_dot(now, aim);
    for (i = 0; i < 3 && sine > 0.0; ++i)
        turn[i] *= share * atan2(sine, cosine) / sine;
    pfk_spin(pose, turn);
    return !(cosine > PFK_RANK - 1.0);
}

#if ONE_TILT
/* Turns a target so that its z axis is one that the only rotation leads to: the angle about its axis alone counts. */
static void pfk_along_tilt(pfk_pose *target)
{
    pfk_pose goal = *target;
    pfk_real z[3], lift, length, height = pfk_tilt_axis[2];
    int i;
    for (i = 0; i < 3; ++i)
        z[i] = target->R[i][2];
    lift = pfk_dot(z, pfk_tilt_axis);
    for (i = 0; i < 3; ++i)
        z[i] -= lift * pfk_tilt_axis[i];
    length = pfk_norm(z);
    if (!(length > PFK_RANK))
        return;
    for (i = 0; i < 3; ++i)
        goal.R[i][2] = height * pfk_tilt_axis[i] + sqrt(1.0 - height * height) / length * z[i];
    pfk_lean_toward(target, &goal, 1.0);
}

#endif
/* Continues what a task sets of a pose, or all of it where redundant joints alone follow, to a target in so many
   steps, each completed from the one before: 0, PFK_NO_POSE, or the number of a leg that does not reach or close. */
static int pfk_continue(const pfk_pose *target, int moves, int parts, pfk_real farthest, pfk_pose *own,
                        pfk_state *state)
{
    const int is_whole = moves == PFK_REDUNDANT_ALONE;
    int i, left, steps, code = 0;
    pfk_real share;
#if REDUNDANT
    pfk_start(state);
#endif
    for (left = parts; left > 0 && (is_whole || !code); --left) {
        share = 1.0 / (pfk_real)left;
        for (i = 0; i < 3; ++i)
            if (is_whole || pfk_axes[i])
                own->p[i] = left > 1 ? own->p[i] + share * (target->p[i] - own->p[i]) : target->p[i];
        if (is_whole || PFK_ROTATIONS == 3)
            pfk_turn_toward(own, target, share);
        else if (PFK_ROTATIONS == 2 && pfk_lean_toward(own, target, share))
            return PFK_NO_POSE;
#if YAW
        else if (!(own->R[2][2] > PFK_RANK - 1.0 && target->R[2][2] > PFK_RANK - 1.0))
            return PFK_NO_POSE; /* upside down there is no yaw */
        else
            pfk_bring_yaw(own, pfk_yaw(own) + share * pfk_wrap(pfk_yaw(target) - pfk_yaw(own), 0.0));
#endif
        code = pfk_settle(own, 0, moves, PFK_IK_STEPS, farthest, parts == 1, state, &steps);
    }
    return code;
}

/* Continues to a target in one of several attempts: from a start at once, from there in steps, and from home in steps,
   where the redundant joints are known; then, with implicit joints, so that what follows may go farther. */
static int pfk_go(const pfk_pose *target, const pfk_pose *start, int moves, int attempt, pfk_pose *own,
                  pfk_state *state)
{
    *own = *start;
    if (attempt % 3 == 2)
        pfk_home(own);
    return pfk_continue(target, moves, attempt % 3 ? PFK_PARTS : 1, attempt < 3 ? PFK_NEAR : PFK_FARTHEST, own, state);
}

/* Takes the first attempt that ends within all limits, else the first that ends where all legs close: 0, or what the
   first of all says. More than one pose may close: beyond a limit need not mean that there is none within. */
static int pfk_reach(const pfk_pose *target, const pfk_pose *start, int moves, pfk_pose *own, pfk_state *state)
{
    int attempt, closing = -1;
    for (attempt = 0; attempt < PFK_ATTEMPTS; ++attempt) {
        if (pfk_go(target, start, moves, attempt, own, state))
            continue;
#if LIMITS
        pfk_real slack[PFK_LIMITS + 1];
        if (pfk_slacks(state, slack)) {
            closing = closing < 0 ? attempt : closing;
            continue;
        }
#endif
        return 0;
    }
    return pfk_go(target, start, moves, closing < 0 ? 0 : closing, own, state);
}

#endif
#if RESTS
#if SOLVES
/* Places legs at a whole pose, and fills their equations, with derivatives if `sloped`; `angles` as of pfk_place. 0, or
   the number of a leg that does not reach or close. */
static int pfk_close(const pfk_pose *pose, int angles, int sloped, pfk_state *state, pfk_row row[PFK_ROWS])
{
    pfk_real worst;
    int code, open;
#if IMPLICIT
    pfk_pose own;
    (void)angles;
    code = pfk_reach(pose, pose, PFK_REDUNDANT_ALONE, &own, state);
    if (!sloped)
        return code;
#else
#if REDUNDANT
    pfk_start(state);
#endif
    code = pfk_place(pose, 0, angles, state);
#endif
    if (code)
        return code;
    open = pfk_equations(state, 0, sloped, row, &worst);
    return worst <= PFK_CLOSE ? 0 : open;
}

#endif
/* Places legs at a whole pose: 0, or the number of a leg that does not reach or close. */
static int pfk_rest(const pfk_pose *pose, pfk_state *state)
{
#if SOLVES
    pfk_row row[PFK_ROWS];
    return pfk_close(pose, 1, 0, state, row);
#else
#if REDUNDANT
    pfk_start(state);
#endif
    return pfk_place(pose, 0, 1, state);
#endif
}

#endif
#if LIMITS
int pfk_limits(const pfk_pose *pose, pfk_real slack[])
{
    pfk_state state;
    pfk_pose own = *pose;
    int code;
    if (pfk_make_exact(&own))
        return PFK_NO_POSE;
    code = pfk_rest(&own, &state);
    return code ? PFK_LEG + code : pfk_slacks(&state, slack);
}

#endif
#if CLEARANCE
int pfk_clearance(const pfk_pose *pose, pfk_real *distance, int *pair)
{
    pfk_state state;
    pfk_pose own = *pose;
    int code;
    if (pfk_make_exact(&own))
        return PFK_NO_POSE;
    code = pfk_rest(&own, &state);
    if (code)
        return PFK_LEG + code;
    return pfk_nearest(&state, distance, pair);
}

#endif
#if IK || FK
/* The actuators at the state of the legs. */
static void pfk_read(const pfk_state *state, pfk_real actuators[PFK_ACTUATORS])
{
    int i;
    for (i = 0; i < PFK_ACTUATORS; ++i)
        actuators[i] = pfk_driven[i].home + pfk_deviation(&pfk_driven[i], state);
}

#endif
#if IK
int pfk_ik(const pfk_pose *target, pfk_pose *pose, pfk_real actuators[PFK_ACTUATORS])
{
    pfk_state state;
    pfk_pose own, wanted = *target;
#if COMPLETES
    pfk_pose begin;
#endif
    int i, code;
    pfk_home(&own);
    for (i = 0; i < 3; ++i)
        wanted.p[i] = pfk_axes[i] ? wanted.p[i] : own.p[i];
    for (i = 0; i < 9 && PFK_ROTATIONS == 0; ++i)
        wanted.R[i / 3][i % 3] = own.R[i / 3][i % 3];
    if (pfk_make_exact(&wanted))
        return PFK_NO_POSE;
#if ONE_TILT
    pfk_along_tilt(&wanted);
#endif
#if COMPLETES
    begin = *pose;
    if (pfk_make_exact(&begin))
        return PFK_NO_POSE;
    code = pfk_reach(&wanted, &begin, PFK_UNSET, &own, &state);
    if (code < 0)
        return code;
#else
    own = wanted;
    code = pfk_rest(&own, &state);
#endif
    if (code)
        return PFK_LEG + code;
#if LIMITS
    {
        pfk_real slack[PFK_LIMITS + 1];
        code = pfk_slacks(&state, slack);
        if (code)
            return code;
    }
#endif
    *pose = own;
    pfk_read(&state, actuators);
    return 0;
}

#endif
#if JOINTS
/* Turns a vector about a unit axis, and a point about a joint. */
static void pfk_turn_vector(pfk_real v[3], const pfk_real axis[3], pfk_real cosine, pfk_real sine)
{
    pfk_real turned[3];
    pfk_about(v, axis, cosine, sine, turned);
    pfk_copy(turned, v);
}

static void pfk_turn_point(pfk_real point[3], const pfk_joint *joint, pfk_real cosine, pfk_real sine)
{
    pfk_along(point, -1.0, joint->point, point);
    pfk_turn_vector(point, joint->axis, cosine, sine);
    pfk_along(joint->point, 1.0, point, point);
}

/* 1 if a pose has finite numbers alone. */
static int pfk_is_finite(const pfk_pose *pose)
{
    return fabs(0.0 * (pose->p[0] + pose->p[1] + pose->p[2] + pose->R[0][0] + pose->R[1][0] + pose->R[2][0])) <= 0.0;
}

/* The pose at joint coordinates, and its twist by each of them. */
static void pfk_walk(const pfk_real joints[PFK_JOINTS], pfk_pose *pose, pfk_real twist[PFK_JOINTS][6])
{
    pfk_real at[PFK_JOINTS][3], x[3] = {1.0, 0.0, 0.0}, y[3] = {0.0, 1.0, 0.0}, z[3];
    int i, k;
    pfk_home(pose);
    /* from the end effector inward: each joint moves all that comes after it */
    for (k = PFK_JOINTS - 1; k >= 0; --k) {
        const pfk_joint *joint = &pfk_joints[k];
        const pfk_real value = joint->sense * (joints[joint->place] - joint->home);
        pfk_copy(joint->axis, twist[joint->place] + 3);
        pfk_copy(joint->point, at[k]);
        if (!joint->turns) {
            for (i = k + 1; i < PFK_JOINTS; ++i)
                pfk_along(at[i], value, joint->axis, at[i]);
            pfk_along(pose->p, value, joint->axis, pose->p);
            continue;
        }
        const pfk_real cosine = cos(value), sine = sin(value);
        for (i = k + 1; i < PFK_JOINTS; ++i) {
            pfk_turn_vector(twist[pfk_joints[i].place] + 3, joint->axis, cosine, sine);
            pfk_turn_point(at[i], joint, cosine, sine);
        }
        pfk_turn_point(pose->p, joint, cosine, sine);
        pfk_turn_vector(x, joint->axis, cosine, sine);
        pfk_turn_vector(y, joint->axis, cosine, sine);
    }
    pfk_cross(x, y, z);
    for (i = 0; i < 3; ++i) {
        pose->R[i][0] = x[i];
        pose->R[i][1] = y[i];
        pose->R[i][2] = z[i];
    }
    for (k = 0; k < PFK_JOINTS; ++k) {
        pfk_real *own = twist[pfk_joints[k].place], lever[3];
        for (i = 0; i < 3; ++i)
            own[3 + i] *= pfk_joints[k].sense;
        if (pfk_joints[k].turns) {
            pfk_along(pose->p, -1.0, at[k], lever);
            pfk_cross(own + 3, lever, own);
        } else {
            pfk_copy(own + 3, own);
            pfk_copy(pfk_zero, own + 3);
        }
    }
}

void pfk_pose_at(const pfk_real joints[PFK_JOINTS], pfk_pose *pose)
{
    pfk_real twist[PFK_JOINTS][6];
    pfk_walk(joints, pose, twist);
}

#endif
#if TO_ACTUATORS
int pfk_to_actuators(const pfk_real joints[PFK_JOINTS], pfk_real actuators[PFK_ACTUATORS])
{
    pfk_state state;
    pfk_pose pose;
    int code;
    pfk_pose_at(joints, &pose);
    if (!pfk_is_finite(&pose))
        return PFK_NO_POSE;
    code = pfk_rest(&pose, &state);
    if (code)
        return PFK_LEG + code;
#if LIMITS
    {
        pfk_real slack[PFK_LIMITS + 1];
        code = pfk_slacks(&state, slack);
        if (code)
            return code;
    }
#endif
    pfk_read(&state, actuators);
    return 0;
}

#endif
#if RATES
/* Takes orthonormal vectors (`count` of them, `width` numbers each) off v, once more where most of it goes; fills their
   shares; the length left. */
static pfk_real pfk_take_off(const pfk_real *basis, int count, int width, pfk_real *v, pfk_real *shares)
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

/* Makes v square to `count` vectors, orthonormal ones, and of length 1; 0 where no more than rounding is left of it. */
static int pfk_make_square(pfk_real basis[][6], int count, pfk_real v[6])
{
    pfk_real shares[6];
    const pfk_real size = pfk_take_off(&basis[0][0], count, 6, v, shares);
    int j;
    for (j = 0; j < 6 && size > PFK_RANK; ++j)
        v[j] *= 1.0 / size;
    return size > PFK_RANK;
}

/* Rates of actuators by the twist of the end effector: `raw` ones, of twists that the legs allow, or of all. */
static int pfk_twist_rates(const pfk_pose *pose, int raw, pfk_real rates[PFK_ACTUATORS][6])
{
    pfk_state state;
    pfk_row row[PFK_ROWS];
    pfk_real drive[PFK_ACTUATORS][PFK_COLUMNS], basis[6][6], share;
    const int sloped = !raw || PFK_N_REDUNDANT > 0;
    int i, j, k, count = 0, code = pfk_close(pose, 0, sloped, &state, row);
#if REDUNDANT
    int used[PFK_ROWS] = {0};
#endif
    if (code)
        return PFK_LEG + code;
    for (i = 0; i < PFK_LEGS && !sloped; ++i)
        if (pfk_has_proximal(&pfk_legs[i]))
            pfk_follow(&state.frame[pfk_legs[i].frame], &pfk_legs[i], &state.leg[i]);
    for (i = 0; i < PFK_ACTUATORS; ++i) {
        const pfk_coordinate *driven = &pfk_driven[i];
        const pfk_placed *own = &state.leg[driven->leg];
        if (driven->place == PFK_Q_PROXIMAL) {
            for (j = 0; j < PFK_COLUMNS; ++j)
                drive[i][j] = j < 6 ? own->follow[j] : 0.0;
#if REDUNDANT
            if (pfk_legs[driven->leg].kind == PFK_REDUNDANT) {
                for (j = 0; j < 6; ++j)
                    drive[i][j] = 0.0;
                drive[i][6 + pfk_legs[driven->leg].column] = 1.0;
            } else {
                for (j = pfk_legs[driven->leg].on; j > 0; j = pfk_legs[j - 1].on)
                    drive[i][6 + pfk_legs[j - 1].column] += pfk_dot(drive[i], state.leg[j - 1].follow)
                                                            + pfk_dot(drive[i] + 3, state.leg[j - 1].follow + 3);
            }
#endif
        } else {
            pfk_row one;
            pfk_drive_row(&state, driven, driven->sense * pfk_deviation(driven, &state), &one);
            share = one.by_given != 0.0 ? -1.0 / one.by_given : 0.0;
            for (j = 0; j < PFK_COLUMNS; ++j)
                drive[i][j] = share * one.slope[j];
        }
        for (j = 0; j < PFK_COLUMNS; ++j)
            drive[i][j] *= driven->sense;
    }
#if REDUNDANT
    /* redundant joints follow by the equation that tells most of each */
    for (k = 6; k < PFK_COLUMNS; ++k) {
        int best = -1;
        for (i = 0; i < PFK_OWN_ROWS; ++i)
            if (!used[i] && fabs(row[i].slope[k]) * PFK_SIZE > PFK_RANK
                && (best < 0 || fabs(row[i].slope[k]) > fabs(row[best].slope[k])))
                best = i;
        if (best < 0)
            continue;
        used[best] = 1;
        for (i = 0; i < PFK_OWN_ROWS; ++i) {
            share = i == best ? 0.0 : row[i].slope[k] / row[best].slope[k];
            for (j = 0; j < PFK_COLUMNS && share != 0.0; ++j)
                row[i].slope[j] = j == k ? 0.0 : row[i].slope[j] - share * row[best].slope[j];
        }
        for (i = 0; i < PFK_ACTUATORS; ++i) {
            share = drive[i][k] / row[best].slope[k];
            for (j = 0; j < PFK_COLUMNS; ++j)
                drive[i][j] = j == k ? 0.0 : drive[i][j] - share * row[best].slope[j];
        }
    }
#endif
    for (k = 0; k < 3 && !raw && !PFK_TURNING; ++k, ++count)
        for (j = 0; j < 6; ++j)
            basis[count][j] = j == 3 + k ? 1.0 : 0.0;
    for (i = 0; i < PFK_OWN_ROWS && !raw && count < 6; ++i) {
#if REDUNDANT
        if (used[i])
            continue;
#endif
        for (j = 0; j < 6; ++j)
            basis[count][j] = row[i].slope[j] * (j < 3 ? PFK_SIZE : 1.0);
        count += pfk_make_square(basis, count, basis[count]);
    }
    for (i = 0; i < PFK_ACTUATORS; ++i) {
        for (j = 0; j < 6; ++j)
            rates[i][j] = drive[i][j] * (j < 3 ? PFK_SIZE : 1.0);
        for (k = 0; k < count; ++k) {
            share = pfk_dot(basis[k], rates[i]) + pfk_dot(basis[k] + 3, rates[i] + 3);
            for (j = 0; j < 6; ++j)
                rates[i][j] -= share * basis[k][j];
        }
        for (j = 0; j < 3; ++j)
            rates[i][j] *= 1.0 / PFK_SIZE;
    }
    return 0;
}

#if JOINTS
int pfk_jacobian(pfk_at at, pfk_real jacobian[PFK_ACTUATORS][PFK_RATES])
{
    pfk_real rates[PFK_ACTUATORS][6], twist[PFK_JOINTS][6];
    pfk_pose pose;
    int i, j, code;
    pfk_walk(at, &pose, twist);
    if (!pfk_is_finite(&pose))
        return PFK_NO_POSE;
    code = pfk_twist_rates(&pose, 1, rates);
    for (i = 0; i < PFK_ACTUATORS && !code; ++i)
        for (j = 0; j < PFK_JOINTS; ++j)
            jacobian[i][j] = pfk_dot(rates[i], twist[j]) + pfk_dot(rates[i] + 3, twist[j] + 3);
    return code;
}
#else
int pfk_jacobian(pfk_at at, pfk_real jacobian[PFK_ACTUATORS][PFK_RATES])
{
    pfk_pose own = *at;
    return pfk_make_exact(&own) ? PFK_NO_POSE : pfk_twist_rates(&own, 0, jacobian);
}
#endif

/* A Jacobian, its lengths over L, as u t q: orthonormal rows q and columns u, `rank` of each, a triangle t. */
typedef struct {
    int rank;
    pfk_real u[PFK_RATES][PFK_ACTUATORS], t[PFK_RATES][PFK_RATES], q[PFK_RATES][PFK_RATES];
} pfk_factors;

static pfk_real pfk_per_unit(int actuator)
{
    return pfk_driven[actuator].is_length ? 1.0 / PFK_SIZE : 1.0;
}

static void pfk_factorise(pfk_real jacobian[PFK_ACTUATORS][PFK_RATES], pfk_factors *own)
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
        size = pfk_take_off(&own->q[0][0], own->rank, PFK_RATES, row, shares);
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
        for (i = 0; i < PFK_ACTUATORS; ++i) {
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
        size = pfk_take_off(&own->u[0][0], k, PFK_ACTUATORS, own->u[k], shares);
        for (j = 0; j < k; ++j)
            own->t[j][k] = shares[j];
        own->t[k][k] = size;
        for (i = 0; i < PFK_ACTUATORS; ++i)
            own->u[k][i] /= size;
    }
}

int pfk_speeds(pfk_at at, const pfk_real rates[PFK_RATES], pfk_real speeds[PFK_ACTUATORS])
{
    pfk_real jacobian[PFK_ACTUATORS][PFK_RATES];
    int i, j, code = pfk_jacobian(at, jacobian);
    for (i = 0; i < PFK_ACTUATORS && !code; ++i)
        for (speeds[i] = 0.0, j = 0; j < PFK_RATES; ++j)
            speeds[i] += jacobian[i][j] * rates[j];
    return code;
}

int pfk_torques_back(pfk_at at, const pfk_real torques[PFK_ACTUATORS], pfk_real given[PFK_RATES])
{
    pfk_real jacobian[PFK_ACTUATORS][PFK_RATES];
    int i, j, code = pfk_jacobian(at, jacobian);
    for (j = 0; j < PFK_RATES && !code; ++j)
        for (given[j] = 0.0, i = 0; i < PFK_ACTUATORS; ++i)
            given[j] += jacobian[i][j] * torques[i];
    return code;
}

int pfk_torques(pfk_at at, const pfk_real wanted[PFK_RATES], pfk_real torques[PFK_ACTUATORS])
{
    pfk_real jacobian[PFK_ACTUATORS][PFK_RATES], z[PFK_RATES];
    pfk_factors own;
    int i, j, k, code = pfk_jacobian(at, jacobian);
    if (code)
        return code;
    pfk_factorise(jacobian, &own);
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

int pfk_speeds_back(pfk_at at, const pfk_real speeds[PFK_ACTUATORS], pfk_real rates[PFK_RATES])
{
    pfk_real jacobian[PFK_ACTUATORS][PFK_RATES], z[PFK_RATES];
    pfk_factors own;
    int i, j, k, code = pfk_jacobian(at, jacobian);
    if (code)
        return code;
    pfk_factorise(jacobian, &own);
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
#if TO_JOINTS
int pfk_to_joints(const pfk_real actuators[PFK_ACTUATORS], pfk_real joints[PFK_JOINTS], int *steps)
{
    pfk_state state;
    pfk_pose pose;
    pfk_row row[PFK_ROWS];
    pfk_real system[PFK_ROWS][PFK_UNKNOWNS + 1], x[PFK_UNKNOWNS], twist[PFK_JOINTS][6], given[PFK_ACTUATORS];
    pfk_real now[PFK_JOINTS], worst, last = 0.0, size, off;
    int i, j, count;
    for (i = 0; i < PFK_ACTUATORS; ++i) {
        given[i] = pfk_driven[i].sense * (actuators[i] - pfk_driven[i].home);
        if (!(fabs(0.0 * given[i]) <= 0.0))
            return PFK_NO_ACTUATORS;
    }
    for (j = 0; j < PFK_JOINTS; ++j)
        now[j] = joints[j];
    for (count = 0;; ++count) {
        int open;
        pfk_walk(now, &pose, twist);
        if (!pfk_is_finite(&pose))
            return PFK_NO_POSE;
        pfk_place(&pose, given, 0, &state);
        open = pfk_equations(&state, given, 1, row, &worst);
        if (worst <= PFK_CLOSED || (count && worst <= PFK_CLOSE && worst > 0.25 * last))
            break;
        if (count == PFK_FK_STEPS)
            return PFK_LEG + open;
        last = worst;
        for (i = 0; i < PFK_ROWS; ++i) {
            for (j = 0; j < PFK_JOINTS; ++j)
                system[i][j] = pfk_rate_units[j]
                               * (pfk_dot(row[i].slope, twist[j]) + pfk_dot(row[i].slope + 3, twist[j] + 3));
            system[i][PFK_JOINTS] = -row[i].off;
        }
        if (pfk_least_squares(system, PFK_ROWS, PFK_JOINTS, x))
            return PFK_LEG + open;
        size = 0.0;
        for (j = 0; j < PFK_JOINTS; ++j)
            size = fabs(x[j]) > size ? fabs(x[j]) : size;
        for (j = 0; j < PFK_JOINTS; ++j)
            now[j] += pfk_rate_units[j] * x[j] * (size > PFK_LONGEST_STEP ? PFK_LONGEST_STEP / size : 1.0);
    }
    if (steps)
        *steps = count;
    if (pfk_place(&pose, 0, 1, &state))
        return PFK_OTHER_MODE;
    pfk_read(&state, given);
    for (i = 0; i < PFK_ACTUATORS; ++i) {
        off = given[i] - actuators[i];
        off = pfk_driven[i].is_length ? off / PFK_SIZE : pfk_wrap(off, 0.0);
        if (!(fabs(off) <= PFK_MODE_APART))
            return PFK_OTHER_MODE;
    }
    for (j = 0; j < PFK_JOINTS; ++j)
        joints[j] = now[j];
#if CLEARANCE
    return pfk_too_near(&state);
#else
    return 0;
#endif
}

#endif
#if TURNS
void pfk_count_turns(const pfk_real before[PFK_ACTUATORS], pfk_real now[PFK_ACTUATORS])
{
    pfk_real near;
    int i;
    for (i = 0; i < PFK_ACTUATORS; ++i) {
        const pfk_coordinate *driven = &pfk_driven[i];
        near = pfk_wrap(now[i], before[i]);
        if (driven->turns && driven->hi - driven->lo > PFK_TURN && near >= driven->home + driven->lo
            && near <= driven->home + driven->hi)
            now[i] = near;
    }
}

#endif
#if FK
int pfk_fk(const pfk_real actuators[PFK_ACTUATORS], pfk_pose *pose, int *steps)
{
    pfk_state state;
    pfk_pose own = *pose;
    pfk_real given[PFK_ACTUATORS], off;
    int i, code, count = 0;
#if STAYS
    pfk_pose trial, home;
    pfk_real begin[PFK_ACTUATORS], way = 0.0, share = 1.0;
    int more, known = 0;
#endif
    for (i = 0; i < PFK_ACTUATORS; ++i)
        if (!(fabs(0.0 * actuators[i]) <= 0.0))
            return PFK_NO_ACTUATORS;
    if (pfk_make_exact(&own))
        return PFK_NO_POSE;
#if STAYS
    while (way < 1.0) { /* at once, or in steps from the actuators at the pose that stay in its assembly mode */
        for (i = 0; i < PFK_ACTUATORS; ++i) {
            off = way + share < 1.0 ? (1.0 - way - share) * (begin[i] - actuators[i]) : 0.0;
            given[i] = pfk_driven[i].sense * (actuators[i] + off - pfk_driven[i].home);
        }
        trial = own;
#if REDUNDANT
        pfk_rest(&trial, &state); /* redundant joints begin where the pose has them */
#endif
        code = pfk_settle(&trial, given, PFK_ALL, PFK_FK_STEPS, PFK_FAR, known < 2, &state, &more);
        count += more;
        if (steps)
            *steps = count;
        if (known > 1) { /* the mode ends on the way */
            if (code)
                return PFK_LEG + code;
            *pose = trial;
            return PFK_OTHER_MODE;
        }
        if (!code) {
            own = trial;
            way += share;
            share = 2.0 * share < 1.0 - way ? 2.0 * share : 1.0 - way;
            continue;
        }
        if (!known) {
            trial = own;
            pfk_home(&home);
            for (i = 0, off = 0.0; i < 3; ++i)
                off += fabs(own.p[i] - home.p[i]) / PFK_SIZE + fabs(own.R[i][i] - 1.0);
#if IMPLICIT
            known = 1 + pfk_settle(&trial, 0, PFK_REDUNDANT_ALONE, PFK_IK_STEPS, PFK_NEAR, 0, &state, &more);
#else
            known = 1 + pfk_place(&trial, 0, 1, &state);
#endif
            pfk_read(&state, begin);
            for (i = 0; i < PFK_ACTUATORS; ++i)
                begin[i] = pfk_driven[i].is_length ? begin[i] : pfk_wrap(begin[i], actuators[i]);
            if (off <= PFK_CLOSE) { /* home, which may be at a dead point */
                known = 1;
                for (i = 0; i < PFK_ACTUATORS; ++i)
                    begin[i] = pfk_driven[i].home;
            }
        }
        share *= 0.5;
        if (known > 1 || share < PFK_SHORTEST_SHARE) {
            known = 2;
            share = 1.0 - way;
        }
    }
#else
    /* more actuators than freedoms: what they agree on is in one place */
    for (i = 0; i < PFK_ACTUATORS; ++i)
        given[i] = pfk_driven[i].sense * (actuators[i] - pfk_driven[i].home);
#if REDUNDANT
    pfk_rest(&own, &state); /* redundant joints begin where the pose has them */
#endif
    code = pfk_settle(&own, given, PFK_ALL, PFK_FK_STEPS, PFK_FAR, 0, &state, &count);
    if (steps)
        *steps = count;
    if (code)
        return PFK_LEG + code;
#endif
    pfk_make_exact(&own);
    *pose = own;
#if IMPLICIT
    code = pfk_settle(&own, 0, PFK_REDUNDANT_ALONE, PFK_IK_STEPS, PFK_NEAR, 0, &state, &i);
#else
    code = pfk_place(&own, 0, 1, &state);
#endif
    if (code)
        return PFK_OTHER_MODE;
    pfk_read(&state, given);
    for (i = 0; i < PFK_ACTUATORS; ++i) {
        off = given[i] - actuators[i];
        off = pfk_driven[i].is_length ? off / PFK_SIZE : pfk_wrap(off, 0.0);
        if (!(fabs(off) <= PFK_MODE_APART))
            return PFK_OTHER_MODE;
    }
#if CLEARANCE
    return pfk_too_near(&state);
#else
    return 0;
#endif
}

#endif
#if IK
#ifdef PFK_SELF_TEST

#include <stdio.h>

#if CHECKED
/* A pose, the actuators there, and whether those are within all limits. */
#if CLEARANCE
/* And the least distance between its links. */
#endif
typedef struct {
    pfk_pose target;
    pfk_real actuators[PFK_ACTUATORS];
    int kept;
#if CLEARANCE
    pfk_real distance;
#endif
} pfk_check;

#include "checks.h"

int main(void)
{
    pfk_real found[PFK_ACTUATORS], size;
#if CLEARANCE
    pfk_real distance;
#endif
    pfk_pose pose;
    int i, j, code, wrong = 0;
    for (i = 0; i < PFK_CHECKS; ++i) {
        pfk_home(&pose);
        code = pfk_ik(&pfk_checks[i].target, &pose, found);
        if ((code == 0) != pfk_checks[i].kept) {
            printf("pose %d: %s\n", i, pfk_what(code));
            ++wrong;
        }
        for (j = 0; code == 0 && j < PFK_ACTUATORS; ++j) {
            size = pfk_driven[j].is_length ? PFK_SIZE : 1.0;
            if (!(fabs(found[j] - pfk_checks[i].actuators[j]) <= PFK_EXACT * size)) {
                printf("pose %d, actuator %d: %.9g\n", i, j, (double)found[j]);
                ++wrong;
            }
        }
#if CLEARANCE
        if (code == 0) {
            pfk_clearance(&pose, &distance, &j);
            if (!(fabs(distance - pfk_checks[i].distance) <= PFK_EXACT * PFK_SIZE)) {
                printf("pose %d, links: %.9g\n", i, (double)distance);
                ++wrong;
            }
        }
#endif
#if FK
        if (code == 0) {
            pfk_pose back = pose;
            if (pfk_fk(found, &back, 0) != 0) {
                printf("pose %d: no way back\n", i);
                ++wrong;
            }
            for (j = 0; j < 3; ++j)
                if (!(fabs(back.p[j] - pose.p[j]) <= PFK_EXACT * PFK_SIZE)) {
                    printf("pose %d, back: %.9g\n", i, (double)back.p[j]);
                    ++wrong;
                }
        }
#endif
    }
    printf("%d poses, %d wrong\n", PFK_CHECKS, wrong);
    return wrong != 0;
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
