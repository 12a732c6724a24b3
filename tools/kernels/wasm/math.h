/* The part of math.h that kernels use: what the processor has, and the rest from the page's Math. */
#ifndef PAGE_MATH
#define PAGE_MATH
#define INFINITY __builtin_inff()
#define NAN __builtin_nanf("")
double sin(double), cos(double), tan(double), atan2(double, double), acos(double), hypot(double, double), pow(double, double);
static inline double sqrt(double x) { return __builtin_sqrt(x); }
static inline double fabs(double x) { return __builtin_fabs(x); }
static inline double floor(double x) { return __builtin_floor(x); }
static inline double rint(double x) { return __builtin_rint(x); }
static inline double copysign(double x, double y) { return __builtin_copysign(x, y); }
#define isnan(x) __builtin_isnan(x)
#define isfinite(x) __builtin_isfinite(x)
#define isinf(x) __builtin_isinf(x)
#endif
