/* Drives an exported machine along a stream: see tests/test_export_live.py. Reads, in double precision, its speeds and
   accelerations, a time, and targets until there are no more; writes a row for each: the code, actuators and the pose. */

#include EXPORTED

#include <stdio.h>

static int read_numbers(pfk_real *numbers, int n)
{
    double number;
    int i;
    for (i = 0; i < n && fread(&number, sizeof number, 1, stdin) == 1; ++i)
        numbers[i] = (pfk_real)number;
    return i == n;
}

static void write_numbers(const pfk_real *numbers, int n)
{
    int i;
    for (i = 0; i < n; ++i) {
        const double number = (double)numbers[i];
        fwrite(&number, sizeof number, 1, stdout);
    }
}

int main(void)
{
    static pfk_memory memory;
    pfk_real speeds[PFK_ACTUATORS], accelerations[PFK_ACTUATORS], actuators[PFK_ACTUATORS], dt, code;
    pfk_pose home, target, pose;
    pfk_begin(&memory);
    pfk_home(&home);
    if (!read_numbers(speeds, PFK_ACTUATORS) || !read_numbers(accelerations, PFK_ACTUATORS) || !read_numbers(&dt, 1) ||
        pfk_live_begin(&memory, &home, speeds, accelerations, actuators))
        return 1;
    while (read_numbers(target.p, 3) && read_numbers(target.R[0], 3) && read_numbers(target.R[1], 3) &&
           read_numbers(target.R[2], 3)) {
        code = (pfk_real)pfk_live_tick(&memory, &target, dt, &pose, actuators);
        write_numbers(&code, 1);
        write_numbers(actuators, PFK_ACTUATORS);
        write_numbers(pose.p, 3);
        write_numbers(pose.R[0], 3);
        write_numbers(pose.R[1], 3);
        write_numbers(pose.R[2], 3);
    }
    return 0;
}
