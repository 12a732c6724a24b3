/* What legs are made of. `export/source.py` takes from here what a machine needs, and writes the names and numbers in
   the precision that is asked for. */

static pfk_real pfk_dot(const pfk_real a[3], const pfk_real b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static pfk_real pfk_norm(const pfk_real a[3])
{
    return sqrt(pfk_dot(a, a));
}

/* `out` is neither of the two. */
static void pfk_cross(const pfk_real a[3], const pfk_real b[3], pfk_real out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* a + k b; `out` may be one of them. */
static void pfk_along(const pfk_real a[3], pfk_real k, const pfk_real b[3], pfk_real out[3])
{
    int i;
    for (i = 0; i < 3; ++i)
        out[i] = a[i] + k * b[i];
}

static void pfk_rotate(const pfk_frame *frame, const pfk_real v[3], pfk_real out[3])
{
    int i;
    for (i = 0; i < 3; ++i)
        out[i] = pfk_dot(frame->R[i], v);
}

static void pfk_rotate_back(const pfk_frame *frame, const pfk_real v[3], pfk_real out[3])
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

/* The platform as seen from the base, and the base as seen from the platform. */
static void pfk_frames(const pfk_pose *pose, pfk_frame *forward, pfk_frame *back)
{
    static const pfk_real reference[3] = PFK_REFERENCE;
    pfk_real moved[3];
    int i, j;
    pfk_along(pose->p, -1.0, reference, moved);
    for (i = 0; i < 3; ++i) {
        forward->p[i] = forward->centre[i] = pose->p[i];
        forward->moved[i] = moved[i];
        back->centre[i] = reference[i];
        back->moved[i] = 0.0;
        for (j = 0; j < 3; ++j) {
            forward->R[i][j] = pose->R[i][j];
            back->R[i][j] = pose->R[j][i];
            back->moved[i] -= pose->R[j][i] * moved[j] + (pose->R[j][i] - (i == j ? 1.0 : 0.0)) * reference[j];
        }
        back->p[i] = back->moved[i];
    }
    forward->is_back = 0;
    back->is_back = 1;
}

/* How far a point of the platform has moved since home. */
static void pfk_displaced(const pfk_frame *frame, const pfk_real point[3], pfk_real out[3])
{
    int i;
    for (i = 0; i < 3; ++i)
        out[i] = frame->moved[i] + (frame->R[i][0] - (i == 0 ? 1.0 : 0.0)) * point[0]
                 + (frame->R[i][1] - (i == 1 ? 1.0 : 0.0)) * point[1]
                 + (frame->R[i][2] - (i == 2 ? 1.0 : 0.0)) * point[2];
}

/* v turned about a unit vector; `out` is not v. */
static void pfk_about(const pfk_real v[3], const pfk_real axis[3], pfk_real cosine, pfk_real sine, pfk_real out[3])
{
    const pfk_real rest = (1.0 - cosine) * pfk_dot(axis, v);
    int i;
    pfk_cross(axis, v, out);
    for (i = 0; i < 3; ++i)
        out[i] = cosine * v[i] + sine * out[i] + rest * axis[i];
}

static void pfk_about_angle(const pfk_real v[3], const pfk_real axis[3], pfk_real angle, pfk_real out[3])
{
    pfk_about(v, axis, cos(angle), sin(angle), out);
}

/* Angle from u to w about a unit vector; what lies along it does not count. */
static pfk_real pfk_angle(const pfk_real axis[3], const pfk_real u[3], const pfk_real w[3])
{
    pfk_real across[3];
    pfk_cross(u, w, across);
    return atan2(pfk_dot(axis, across), pfk_dot(u, w) - pfk_dot(axis, u) * pfk_dot(axis, w));
}

/* Angle between two directions. */
static pfk_real pfk_angle_between(const pfk_real a[3], const pfk_real b[3])
{
    pfk_real across[3];
    pfk_cross(a, b, across);
    return atan2(pfk_norm(across), pfk_dot(a, b));
}

/* The same angle within half a turn of `centre`. */
static pfk_real pfk_wrap(pfk_real angle, pfk_real centre)
{
    return angle - PFK_TURN * floor((angle - centre) / PFK_TURN + 0.5);
}

/* The same angle where a range of more than a turn has it, near 0 if it can be. */
static pfk_real pfk_wrap_into(pfk_real angle, pfk_real lo, pfk_real hi)
{
    angle = pfk_wrap(angle, 0.0);
    if (angle > hi + PFK_KEPT)
        return angle - PFK_TURN;
    return angle < lo - PFK_KEPT ? angle + PFK_TURN : angle;
}

/* One of the two solutions of A cos q + B sin q = C, where over = A - C; how far it is from the double root, negative
   where there is none: then the angle is that of the double root. */
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

/* Angles of two crossed hinges that turn u, given at home, into w; how sure they are, as above. */
static pfk_real pfk_aim(const pfk_real axes[3][3], const pfk_real u[3], const pfk_real w[3], pfk_real side,
                        pfk_real angles[])
{
    const pfk_real *a = axes[0], *b = axes[1], bu = pfk_dot(b, u);
    pfk_real flat[3], across[3], turned[3], A, C, cosine, sine, sure;
    pfk_along(u, -bu, b, flat);
    pfk_cross(b, u, across);
    A = pfk_dot(a, flat);
    C = pfk_dot(a, w) - pfk_dot(a, b) * bu;
    sure = pfk_either(A, pfk_dot(a, across), C, A - C, side, &cosine, &sine);
    pfk_about(u, b, cosine, sine, turned);
    angles[0] = pfk_angle(a, turned, w);
    angles[1] = atan2(sine, cosine);
    return sure;
}

/* Angle of a rotation about its own axis. */
static pfk_real pfk_spin_angle(const pfk_frame *frame, const pfk_real axis[3])
{
    const pfk_real sine = axis[0] * (frame->R[2][1] - frame->R[1][2]) + axis[1] * (frame->R[0][2] - frame->R[2][0])
                          + axis[2] * (frame->R[1][0] - frame->R[0][1]);
    return atan2(sine, frame->R[0][0] + frame->R[1][1] + frame->R[2][2] - 1.0);
}

/* Angle about the last of hinges through a point, once the `before` ones have turned; `across` is square to it. */
static pfk_real pfk_last_angle(const pfk_frame *frame, const pfk_real axes[3][3], const pfk_real across[3],
                               const pfk_real angles[], int before)
{
    pfk_real now[3], back[3];
    int i, k;
    pfk_rotate(frame, across, now);
    for (k = 0; k < before; ++k) {
        pfk_about_angle(now, axes[k], -angles[k], back);
        for (i = 0; i < 3; ++i)
            now[i] = back[i];
    }
    return pfk_angle(axes[before], across, now);
}

/* Turns a crank until its rod reaches the head, or to where it comes nearest; whether it is near a dead point. What
   the head has moved since home tells more digits than where it is: with x = reach + moved, C = spoke . reach + c. */
static int pfk_crank(const pfk_rod *rod, const pfk_real moved[3], pfk_leg *leg)
{
    const pfk_real a = pfk_dot(rod->spoke, moved), B = pfk_dot(rod->across, rod->reach) + pfk_dot(rod->across, moved);
    const pfk_real c = pfk_dot(moved, rod->reach) + 0.5 * pfk_dot(moved, moved), A = pfk_dot(rod->spoke, rod->reach);
    const pfk_real sure = pfk_either(A + a, B, A + c, a - c, rod->side, &leg->cosine, &leg->sine);
    leg->carrier = atan2(leg->sine, leg->cosine);
    return !(sure > PFK_DEAD);
}

/* Moves a carriage until its rod reaches the head, or to where it comes nearest; whether it is near a dead point. */
static int pfk_carriage(const pfk_rod *rod, const pfk_real moved[3], pfk_leg *leg)
{
    const pfk_real middle = pfk_dot(rod->reach, rod->axis) + pfk_dot(moved, rod->axis);
    const pfk_real rest = middle * middle - 2.0 * pfk_dot(moved, rod->reach) - pfk_dot(moved, moved);
    leg->carrier = middle + (rest > 0.0 ? rod->side * sqrt(rest) : 0.0);
    return !(rest > PFK_DEAD * rod->length * rod->length);
}

/* Derivative of a . H + c . w by the velocity and the angular velocity of the platform; H is the head, w the angular
   velocity of what it is on as `frame` has them. */
static void pfk_slope(const pfk_frame *frame, const pfk_real head[3], const pfk_real a[3], const pfk_real c[3],
                      pfk_real slope[6])
{
    pfk_real arm[3], spin[3];
    int i;
    pfk_along(head, -1.0, frame->centre, arm);
    pfk_cross(arm, a, spin);
    pfk_along(spin, 1.0, c, spin);
    if (!frame->is_back) {
        for (i = 0; i < 3; ++i) {
            slope[i] = a[i];
            slope[3 + i] = spin[i];
        }
        return;
    }
    pfk_rotate_back(frame, a, slope);
    pfk_rotate_back(frame, spin, slope + 3);
    for (i = 0; i < 6; ++i)
        slope[i] = -slope[i];
}

/* Adds what a row gains by its carrier: `rate` by its coordinate. */
static void pfk_follow(pfk_real rate, const pfk_real follow[6], pfk_real slope[6])
{
    int i;
    for (i = 0; i < 6; ++i)
        slope[i] += rate * follow[i];
}

/* Derivative of - a . F + b . W by the angle of a crank, F the foot at `arm` from its axis. */
static pfk_real pfk_crank_rate(const pfk_real axis[3], const pfk_real arm[3], const pfk_real a[3], const pfk_real b[3])
{
    pfk_real moved[3];
    pfk_cross(axis, arm, moved);
    return pfk_dot(b, axis) - pfk_dot(a, moved);
}

/* Rate at which an end of a rod on one hinge n spins about u, by du and by the angular velocity of its body. */
static void pfk_hinge_spin(const pfk_real n[3], const pfk_real u[3], pfk_real by_line[3], pfk_real by_body[3])
{
    const pfk_real lengthwise = pfk_dot(n, u);
    pfk_real flat[3], across[3], square;
    int i;
    pfk_along(n, -lengthwise, u, flat);
    square = pfk_dot(flat, flat);
    pfk_cross(u, flat, across);
    for (i = 0; i < 3; ++i) {
        across[i] /= square;
        by_line[i] = -lengthwise * across[i];
    }
    pfk_cross(n, across, by_body);
}

/* The same of an end on two crossed hinges a, on the body, and b, on the rod. */
static void pfk_cross_spin(const pfk_real a[3], const pfk_real b[3], const pfk_real u[3], pfk_real by_line[3],
                           pfk_real by_body[3])
{
    pfk_real normal[3], D;
    int i;
    pfk_cross(a, u, normal);
    D = pfk_dot(normal, b);
    for (i = 0; i < 3; ++i)
        by_line[i] = (pfk_dot(a, u) * b[i] - pfk_dot(b, u) * a[i]) / D;
    pfk_cross(u, by_line, by_body);
    for (i = 0; i < 3; ++i)
        by_body[i] = u[i] - by_body[i];
}

/* Solves m x = right by least squares, with reflections: `m` holds the right side in its last column and is used up.
   0 where it tells x; 1 where it does not, or is not of numbers. */
static int pfk_least_squares(pfk_real m[PFK_ROWS][PFK_UNKNOWNS + 1], int rows, int unknowns, pfk_real x[PFK_UNKNOWNS])
{
    pfk_real size, part, share, largest = 0.0;
    int i, j, k;
    for (k = 0; k < unknowns; ++k) {
        size = 0.0;
        for (i = k; i < rows; ++i)
            size += m[i][k] * m[i][k];
        size = m[k][k] > 0.0 ? -sqrt(size) : sqrt(size);
        largest = fabs(size) > largest ? fabs(size) : largest;
        if (!(fabs(size) > PFK_RANK * largest))
            return 1;
        part = size * (size - m[k][k]);
        m[k][k] -= size;
        for (j = k + 1; j <= unknowns; ++j) {
            share = 0.0;
            for (i = k; i < rows; ++i)
                share += m[i][k] * m[i][j];
            for (i = k; i < rows; ++i)
                m[i][j] -= share / part * m[i][k];
        }
        m[k][k] = size;
    }
    for (k = unknowns - 1; k >= 0; --k) {
        x[k] = m[k][unknowns];
        for (j = k + 1; j < unknowns; ++j)
            x[k] -= m[k][j] * x[j];
        x[k] /= m[k][k];
    }
    return 0;
}

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

/* Makes the rotation of a pose the nearest that is orthonormal; 1 where it is no rotation, or not of finite numbers. */
static int pfk_make_exact(pfk_pose *pose)
{
    pfk_real gram[3][3], turned[3], off = 0.0;
    int i, j, k, step;
    for (step = 0; step < 2; ++step) {
        for (i = 0; i < 3; ++i)
            for (j = 0; j < 3; ++j) {
                gram[i][j] = i == j ? -1.0 : 0.0;
                for (k = 0; k < 3; ++k)
                    gram[i][j] += pose->R[k][i] * pose->R[k][j];
                if (step == 0)
                    off += fabs(gram[i][j]);
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
    static const pfk_real reference[3] = PFK_REFERENCE;
    int i, j;
    for (i = 0; i < 3; ++i) {
        pose->p[i] = reference[i];
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
