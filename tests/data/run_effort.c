/* Reads poses, twists, accelerations and gravity, and prints the code and the forces of actuators. With `hostile` it asks
   all functions, whatever they are given. */
#include EXPORTED
#include <stdio.h>
#include <string.h>
#include HOSTILE

int main(int argc, char **argv)
{
    double in[27];
    pfk_real twist[6], gain[6], gravity[3], effort[PFK_ACTUATORS];
    static pfk_memory memory;
    pfk_pose pose;
    int i, code;
    if (argc > 1 && !strcmp(argv[1], "hostile"))
        return hostile_all() != 0;
    pfk_begin(&memory);
    for (;;) {
        for (i = 0; i < 27; ++i)
            if (scanf("%lf", &in[i]) != 1)
                return 0;
        for (i = 0; i < 12; ++i)
            *(i < 3 ? &pose.p[i] : &pose.R[(i - 3) / 3][i % 3]) = (pfk_real)in[i];
        for (i = 0; i < 6; ++i) {
            twist[i] = (pfk_real)in[12 + i];
            gain[i] = (pfk_real)in[18 + i];
        }
        for (i = 0; i < 3; ++i)
            gravity[i] = (pfk_real)in[24 + i];
        for (i = 0; i < PFK_ACTUATORS; ++i)
            effort[i] = 0.0;
        code = pfk_effort(&memory, &pose, twist, gain, gravity, effort);
        printf("%d", code);
        for (i = 0; i < PFK_ACTUATORS; ++i)
            printf(" %.17g", (double)effort[i]);
        printf("\n");
    }
}
