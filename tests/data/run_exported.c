/* Runs an exported file: see tests/exported.py.
       check                          its own test
       nearest STEPS STARTS IS_WARM N MOST
                                      the nearest poses to targets, each from home or from the one before, in turn of N
                                      machines, each with its memory; at most MOST steps of all searches, and of forward
                                      kinematics from home, whose code and steps follow
       hostile                        all functions, whatever they are given
       home, there                    all else; forward kinematics start there
   Numbers are read and written in double precision, whatever the file's. */

#define main pfk_checks_itself
#include EXPORTED
#undef main

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include HOSTILE

static pfk_memory its_memory, *const the_memory = &its_memory;

static int read_numbers(pfk_real *numbers, int n)
{
    double number;
    int i;
    for (i = 0; i < n && fread(&number, sizeof number, 1, stdin) == 1; ++i)
        numbers[i] = (pfk_real)number;
    return i == n;
}

static int read_pose(pfk_pose *pose)
{
    return read_numbers(pose->p, 3) && read_numbers(pose->R[0], 3) && read_numbers(pose->R[1], 3) &&
           read_numbers(pose->R[2], 3);
}

static void write_numbers(const pfk_real *numbers, int n)
{
    int i;
    for (i = 0; i < n; ++i) {
        const double number = (double)numbers[i];
        fwrite(&number, sizeof number, 1, stdout);
    }
}

static void write_code(int code)
{
    const double number = code;
    fwrite(&number, sizeof number, 1, stdout);
}

static void write_pose(const pfk_pose *pose)
{
    int i;
    write_numbers(pose->p, 3);
    for (i = 0; i < 3; ++i)
        write_numbers(pose->R[i], 3);
}

#ifdef HAS_jacobian
static void write_rates(const pfk_pose *pose)
{
    const pfk_real w[6] = {1, 2, 3, 4, 5, 6};
    pfk_real J[PFK_ACTUATORS][6] = {{0}}, torques[PFK_ACTUATORS] = {0}, speeds[PFK_ACTUATORS] = {0};
    pfk_real wrench[6] = {0}, twist[6] = {0};
    int i;
    write_code(pfk_jacobian(the_memory, pose, J));
    pfk_speeds(the_memory, pose, w, speeds);
    pfk_speeds_back(the_memory, pose, speeds, twist);
    pfk_torques(the_memory, pose, w, torques);
    pfk_torques_back(the_memory, pose, torques, wrench);
    for (i = 0; i < PFK_ACTUATORS; ++i)
        write_numbers(J[i], 6);
    write_numbers(torques, PFK_ACTUATORS);
    write_numbers(twist, 6);
    write_numbers(wrench, 6);
}
#endif

#ifdef HAS_nearest
static int find_nearest(int steps, int starts, int is_warm, int n, int most)
{
    static pfk_memory memories[2];
    pfk_pose target, poses[2], pose;
    pfk_real actuators[PFK_ACTUATORS] = {0};
    char holding[PFK_LIMITS + 1] = {0};
    int i, k, code;
    for (k = 0; k < 2; ++k) {
        pfk_begin(&memories[k]);
        memories[k].most_steps = most;
        pfk_home(&poses[k]);
    }
    for (k = 0; read_pose(&target); k = (k + 1) % n) {
        pfk_memory *const memory = &memories[k];
        pose = poses[k];
        if (!is_warm)
            pfk_home(&pose);
        code = pfk_ik_or_nearest(memory, &target, &pose, actuators, steps, starts, holding);
        write_code(code);
        write_code(strlen(pfk_what(code)) > 0);
        write_pose(&pose);
        for (i = 0; i < PFK_LIMITS; ++i)
            write_code(holding[i]);
        write_code(memory->told.held);
        write_code(memory->told.jumped);
        write_numbers(&memory->told.moved, 1);
        write_code(memory->told.steps);
        write_numbers(actuators, PFK_ACTUATORS);
        poses[k] = pose;
        pfk_home(&pose);
        write_code(pfk_fk(memory, actuators, &pose, &i));
        write_code(i);
    }
    return 0;
}
#endif

int main(int argc, char **argv)
{
    pfk_real actuators[PFK_ACTUATORS], given[PFK_ACTUATORS], slack[PFK_LIMITS + 1];
    pfk_pose target, whole, pose, back;
    int i, steps;
    pfk_begin(the_memory);
    if (argc > 1 && !strcmp(argv[1], "check"))
        return pfk_checks_itself();
    if (argc > 1 && !strcmp(argv[1], "hostile"))
        return hostile_all() != 0;
#ifdef HAS_nearest
    if (argc > 6 && !strcmp(argv[1], "nearest"))
        return find_nearest(atoi(argv[2]), atoi(argv[3]), atoi(argv[4]), atoi(argv[5]), atoi(argv[6]));
#endif
    while (read_pose(&target) && read_pose(&whole) && read_numbers(given, PFK_ACTUATORS)) {
        pfk_home(&pose);
        back = pose;
        if (argc > 1 && !strcmp(argv[1], "there"))
            back = whole;
        for (i = 0; i < PFK_ACTUATORS; ++i)
            actuators[i] = 0;
        for (i = 0; i < PFK_LIMITS; ++i)
            slack[i] = 0;
        steps = 0;
        write_code(pfk_ik(the_memory, &target, &pose, actuators));
        write_code(pfk_limits(the_memory, &whole, slack));
        write_code(pfk_fk(the_memory, given, &back, &steps));
        write_code(steps);
        write_pose(&pose);
        write_pose(&back);
        write_numbers(actuators, PFK_ACTUATORS);
        write_numbers(slack, PFK_LIMITS);
#ifdef HAS_jacobian
        write_rates(&whole);
#endif
#ifdef HAS_clearance
        {
            pfk_real distance = 0;
            int pair = 0;
            write_code(pfk_clearance(the_memory, &target, &distance, &pair));
            write_numbers(&distance, 1);
            write_code(pair);
            fprintf(stderr, "%s\n", pfk_what(PFK_PAIR + pair));
        }
#endif
    }
    return 0;
}
