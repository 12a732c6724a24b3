/* Asks functions of an exported file what no caller should; tests/hostile.py writes the calls of a file's functions.
   Whatever an argument is, what is written is finite, 0 is returned for nothing else, and what is only read stays. */

typedef struct {
    const char *name;
    pfk_real *at;
    int n, is_read, is_written;
} hostile_argument;

static const double hostile_numbers[] = {NAN,  INFINITY, -INFINITY, 1e200,  -1e200, 1e308, 1e38,
                                         1e19, 1e12,     5e-324,    1e-310, 1e-40,  0.0};
static const int hostile_counts[] = {0, -1, 1, 2147483647, -2147483647 - 1};
static int hostile_steps, hostile_starts, hostile_pair, hostile_wrong;
static char hostile_holding[PFK_LIMITS + 1];
static pfk_memory hostile_memory;

enum { HOSTILE_NUMBERS = sizeof hostile_numbers / sizeof *hostile_numbers, HOSTILE_COUNTS = 5, HOSTILE_DRAWS = 20 };

/* Arguments that a machine is built for: poses at home, small rates and forces. */
static void hostile_begin(const hostile_argument *arguments)
{
    pfk_pose pose;
    int i;
    pfk_home(&pose);
    hostile_steps = 25;
    hostile_starts = 1;
    hostile_pair = 0;
    hostile_holding[0] = 0;
    for (; arguments->at; ++arguments)
        for (i = 0; i < arguments->n; ++i)
            arguments->at[i] = !arguments->is_read    ? (pfk_real)7.25
                               : arguments->n == 12   ? (i < 3 ? pose.p[i] : pose.R[(i - 3) / 3][i % 3])
                                                      : (pfk_real)0.25;
}

static void hostile_call(const char *name, int (*call)(void), const hostile_argument *arguments, const char *what)
{
    static pfk_real before[4096];
    const hostile_argument *each;
    const char *told = "";
    int i, n = 0, code;
    for (each = arguments; each->at; n += each->n, ++each)
        memcpy(before + n, each->at, (size_t)each->n * sizeof *before);
    code = call();
    for (n = 0, each = arguments; each->at; n += each->n, ++each) {
        const int is_same = !memcmp(before + n, each->at, (size_t)each->n * sizeof *before);
        for (i = 0; i < each->n && each->is_written; ++i)
            if (!(fabs((double)each->at[i]) < (double)INFINITY) && (!code || !is_same))
                told = "a result is not finite";
        if (!is_same && !each->is_written)
            told = "an argument that is only read has changed";
        if (!is_same && code == PFK_NOT_FINITE)
            told = "written, but not finite";
        if (is_same && !code && each->n && !each->is_read)
            told = "nothing is written";
    }
    if (!strcmp(pfk_what(code), "no code of this file"))
        told = "no words for the code";
    if (*told && ++hostile_wrong <= 20)
        printf("%s, %s: code %d, %s\n", name, what, code, told);
}

/* Every number of every argument by itself, then counts, and one number of each argument at once. */
static void hostile_ask(const char *name, int (*call)(void), const hostile_argument *arguments)
{
    const hostile_argument *each;
    unsigned draw = 1;
    char what[99];
    int i, k;
    for (each = arguments; each->at; ++each)
        for (i = 0; i < each->n && each->is_read; ++i)
            for (k = 0; k < HOSTILE_NUMBERS; ++k) {
                hostile_begin(arguments);
                each->at[i] = (pfk_real)hostile_numbers[k];
                sprintf(what, "%s[%d] = %g", each->name, i, hostile_numbers[k]);
                hostile_call(name, call, arguments, what);
            }
    for (k = 0; k < HOSTILE_COUNTS + HOSTILE_DRAWS; ++k) {
        hostile_begin(arguments);
        if (k < HOSTILE_COUNTS)
            hostile_starts = hostile_steps = hostile_counts[k];
        if (hostile_starts == 2147483647)
            hostile_steps = 2; /* from all places */
        for (each = arguments; each->at; ++each)
            if (each->is_read) {
                draw = draw * 1103515245u + 12345u;
                each->at[(draw >> 16) % (unsigned)each->n] = (pfk_real)hostile_numbers[(draw >> 24) % HOSTILE_NUMBERS];
            }
        hostile_call(name, call, arguments, "several");
    }
}
