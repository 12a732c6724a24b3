/* Inverse kinematics of two known machines as plain C, every limit looked at: the least that a row may cost. */
#include <math.h>

#define PI 3.14159265358979323846

/* Struts: feet, tops as seen from the reference point, strokes, cones about unit axes by their cosines. */
typedef struct {
    double foot[3], top[3], low, high, foot_axis[3], foot_cosine, head_axis[3], head_cosine;
} strut;

int struts(long n, const double *targets, int legs, const strut *table, double *lengths)
{
    int left = 0;
    for (long i = 0; i < n; ++i, targets += 16, lengths += legs) {
        int kept = 1;
        for (int k = 0; k < legs; ++k) {
            const strut *leg = table + k;
            double line[3], square = 0.0, foot = 0.0, head = 0.0, length;
            for (int row = 0; row < 3; ++row) {
                const double *T = targets + 4 * row;
                line[row] = T[3] - leg->foot[row] + T[0] * leg->top[0] + T[1] * leg->top[1] + T[2] * leg->top[2];
                square += line[row] * line[row];
                foot += line[row] * leg->foot_axis[row];
                head -= line[row] * (T[0] * leg->head_axis[0] + T[1] * leg->head_axis[1] + T[2] * leg->head_axis[2]);
            }
            lengths[k] = length = sqrt(square);
            kept &= leg->low <= length && length <= leg->high;
            kept &= foot >= leg->foot_cosine * length && head >= leg->head_cosine * length;
        }
        left += !kept;
    }
    return left;
}

/* Cranks and forearms in a plane: its two directions, the shoulder in it, links at home, home's coordinates and
   senses, ranges of shoulder and elbow. */
typedef struct {
    double plane[2][3], shoulder[2], links[2][2], homes[2], senses[2], ranges[2][2];
} crank;

static double turn(const double *from, const double *to)
{
    return atan2(from[0] * to[1] - from[1] * to[0], from[0] * to[0] + from[1] * to[1]);
}

static double coordinate(const crank *leg, int joint, double turned)
{
    const double middle = 0.5 * (leg->ranges[joint][0] + leg->ranges[joint][1]);
    const double value = leg->homes[joint] + leg->senses[joint] * turned - middle;
    return value - 2.0 * PI * round(value / (2.0 * PI)) + middle;
}

static int within(const crank *leg, int joint, double value)
{
    return leg->ranges[joint][0] <= value && value <= leg->ranges[joint][1];
}

int cranks(long n, const double *targets, int legs, const crank *table, double *angles)
{
    int left = 0;
    for (long i = 0; i < n; ++i, targets += 16, angles += legs) {
        int reached = 1;
        for (int k = 0; k < legs; ++k) {
            const crank *leg = table + k;
            const double (*plane)[3] = leg->plane, *inner = leg->links[0], *outer = leg->links[1];
            double tip[2], square = 0.0, along, height, a = inner[0] * inner[0] + inner[1] * inner[1];
            double b = outer[0] * outer[0] + outer[1] * outer[1];
            int kept = 0;
            for (int j = 0; j < 2; ++j) {
                tip[j] = plane[j][0] * targets[3] + plane[j][1] * targets[7] + plane[j][2] * targets[11];
                tip[j] -= leg->shoulder[j];
                square += tip[j] * tip[j];
            }
            along = (square + a - b) / (2.0 * square);
            height = a / square - along * along;
            for (int side = 1; side >= -1 && !kept && height >= 0.0; side -= 2) {
                const double across = side * sqrt(height);
                const double arm[2] = {along * tip[0] - across * tip[1], along * tip[1] + across * tip[0]};
                const double rest[2] = {tip[0] - arm[0], tip[1] - arm[1]};
                angles[k] = coordinate(leg, 0, turn(inner, arm));
                kept = within(leg, 0, angles[k])
                    && within(leg, 1, coordinate(leg, 1, turn(arm, rest) - turn(inner, outer)));
            }
            reached &= kept;
        }
        left += !reached;
    }
    return left;
}
