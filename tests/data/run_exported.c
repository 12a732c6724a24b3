/* Reads poses in double precision and writes what an exported file answers: see tests/test_export_c.py. */

#include EXPORTED

#include <stdio.h>

static void load(const double numbers[12], pfk_pose *pose)
{
    int i;
    for (i = 0; i < 12; ++i) {
        if (i < 3)
            pose->p[i] = (pfk_real)numbers[i];
        else
            pose->R[(i - 3) / 3][i % 3] = (pfk_real)numbers[i];
    }
}

static void store(const pfk_pose *pose, double numbers[12])
{
    int i;
    for (i = 0; i < 12; ++i)
        numbers[i] = i < 3 ? (double)pose->p[i] : (double)pose->R[(i - 3) / 3][i % 3];
}

int main(void)
{
    double given[24], told[28];
    pfk_real actuators[PFK_ACTUATORS], slack[PFK_LIMITS + 1];
    pfk_pose target, whole, pose, back;
    double number;
    int i, steps;
    while (fread(given, sizeof(double), 24, stdin) == 24) {
        load(given, &target);
        load(given + 12, &whole);
        pfk_home(&pose);
        pfk_home(&back);
        for (i = 0; i < PFK_ACTUATORS; ++i)
            actuators[i] = 0;
        for (i = 0; i < PFK_LIMITS; ++i)
            slack[i] = 0;
        steps = 0;
        told[0] = pfk_ik(&target, &pose, actuators);
        told[1] = pfk_limits(&whole, slack);
        told[2] = pfk_fk(actuators, &back, &steps);
        told[3] = steps;
        store(&pose, told + 4);
        store(&back, told + 16);
        fwrite(told, sizeof(double), 28, stdout);
        for (i = 0; i < PFK_ACTUATORS; ++i) {
            number = (double)actuators[i];
            fwrite(&number, sizeof(double), 1, stdout);
        }
        for (i = 0; i < PFK_LIMITS; ++i) {
            number = (double)slack[i];
            fwrite(&number, sizeof(double), 1, stdout);
        }
    }
    return 0;
}
