#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(__FAST_MATH__)
#error "kernels need IEEE arithmetic: no -ffast-math"
#endif
#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16
#error "kernels need arithmetic in the precision of their numbers: no x87"
#endif

#if defined(__GNUC__)
#define INLINED static inline __attribute__((always_inline))
#define FLATTENED __attribute__((flatten))
#else
#define INLINED static inline
#define FLATTENED
#endif

typedef REAL real;
typedef INTEGER integer;

/* Memory of one call: taken in order, given back as a whole. */
typedef struct { char *next, *end; void (*more)(void *owner, size_t size); void *owner; } arena;

static inline void *take(arena *memory, size_t size, int is_cleared) {
    char *at;
    size = (size + 63) & ~(size_t)63;
    if (size > (size_t)(memory->end - memory->next)) memory->more(memory->owner, size);
    at = memory->next;
    memory->next += size;
    if (is_cleared) for (size_t i = 0; i < size; i++) at[i] = 0;
    return at;
}

#ifdef CHECKED
#include <stdio.h>
#include <stdlib.h>
static inline integer checked(integer i, integer n, const char *file, int line) {
    if (i < 0 || i >= n) {
        fprintf(stderr, "%s:%d: index %lld of %lld\n", file, line, (long long)i, (long long)n);
        abort();
    }
    return i;
}
#define IN(i, n) checked(i, n, __FILE__, __LINE__)
#else
#define IN(i, n) (i)
#endif

#define AT1(a, i) (a).data[IN(i, (a).n[0])]
#define AT2(a, i, j) (a).data[IN(i, (a).n[0]) * (a).n[1] + IN(j, (a).n[1])]
#define AT3(a, i, j, k) (a).data[(IN(i, (a).n[0]) * (a).n[1] + IN(j, (a).n[1])) * (a).n[2] + IN(k, (a).n[2])]
#define AT4(a, i, j, k, l) \
    (a).data[((IN(i, (a).n[0]) * (a).n[1] + IN(j, (a).n[1])) * (a).n[2] + IN(k, (a).n[2])) * (a).n[3] + IN(l, (a).n[3])]
#define WIDE2(a, width, i, j) (a).data[IN(i, (a).n[0]) * (width) + IN(j, (a).n[1])]
#define STRIDED1(a, i) (a).data[IN(i, (a).n[0]) * (a).step[0]]
#define STRIDED2(a, i, j) (a).data[IN(i, (a).n[0]) * (a).step[0] + IN(j, (a).n[1]) * (a).step[1]]
#define STRIDED3(a, i, j, k) \
    (a).data[IN(i, (a).n[0]) * (a).step[0] + IN(j, (a).n[1]) * (a).step[1] + IN(k, (a).n[2]) * (a).step[2]]

static inline real max_f(real a, real b) { return b > a ? b : a; }

static inline real min_f(real a, real b) { return b < a ? b : a; }

static inline integer max_i(integer a, integer b) { return b > a ? b : a; }

static inline integer min_i(integer a, integer b) { return b < a ? b : a; }

static inline integer abs_i(integer a) { return a < 0 ? -a : a; }

static inline real square_of(real a) { return a * a; }

static inline real cube_of(real a) { return a * (a * a); }

static inline integer power_i(integer a, integer n) {
    integer result = 1;
    for (; n > 0; n--) result *= a;
    return result;
}

/* Python's division of integers, rounded down. */
static inline integer div_i(integer a, integer b) {
    integer q = a / b;
    return a % b != 0 && (a % b < 0) != (b < 0) ? q - 1 : q;
}

static inline integer mod_i(integer a, integer b) {
    integer r = a % b;
    return r != 0 && (r < 0) != (b < 0) ? r + b : r;
}

/* Where an end of a slice is. */
static inline integer place(integer at, integer n) {
    integer from = at < 0 ? at + n : at;
    return from < 0 ? 0 : from > n ? n : from;
}
