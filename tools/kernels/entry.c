/* From Python into kernels that were compiled ahead.

   A kernel takes its arguments as eight-byte words: numbers as they are, an array as its address and its shape, records
   field by field. `take` checks each argument against the kernel's code (numbers i, f, b; arrays with dimensions and
   bytes of an element, in capitals if only read; records in parentheses), and `call` releases the GIL meanwhile. Limited
   API: one build for every Python from 3.11 on. */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef int64_t word;

struct kernel {
    const char *name;
    int (*run)(const word *words, word *result); /* 0, or 1 where there is not enough memory */
    const char *takes;
    char gives; /* n, i or b */
    int n_words, level; /* level: 0, or from 1 on the processor's that it needs */
};

#include "table.h" /* KERNELS, N_KERNELS, LEVELS, N_LEVELS, MOST_WORDS, MOST_ARRAYS */

/* ---- Arguments ---- */

struct arguments {
    const struct kernel *kernel;
    int place; /* of the argument that is read, for messages */
    const char *code;
    word *word;
    Py_buffer views[MOST_ARRAYS];
    int n_views;
    word words[MOST_WORDS];
};

static int refuse(struct arguments *a, const char *expected) {
    PyErr_Format(PyExc_TypeError, "%s: argument %d: expected %s", a->kernel->name, a->place, expected);
    return 0;
}

/* Whether the elements of an array are of a kind, whatever letter this platform has for eight-byte integers. */
static int is_of(char kind, const char *format) {
    if (kind == 'r') return 1;
    if (!format || !format[0] || format[1]) return 0;
    return kind == 'f' ? *format == 'd' : kind == 'i' && (*format == 'l' || *format == 'q');
}

static int take_array(struct arguments *a, PyObject *given) {
    char letter = *a->code++, kind = letter | ' ';
    int is_read = letter != kind, n = *a->code++ - '0';
    long itemsize = strtol(a->code, (char **)&a->code, 10);
    Py_buffer *view = a->views + a->n_views;
    a->code++;
    if (PyObject_GetBuffer(given, view, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | (is_read ? 0 : PyBUF_WRITABLE))) {
        PyErr_Clear();
        return refuse(a, is_read ? "a contiguous array" : "a contiguous array that can be written to");
    }
    a->n_views++;
    if (view->ndim != n || view->itemsize != itemsize || !is_of(kind, view->format)) {
        PyErr_Format(PyExc_TypeError, "%s: argument %d: expected an array of %d dimensions, %ld-byte %s; found %d, %zd-byte '%s'",
                     a->kernel->name, a->place, n, itemsize,
                     kind == 'f' ? "floats" : kind == 'i' ? "integers" : "records",
                     view->ndim, view->itemsize, view->format ? view->format : "");
        return 0;
    }
    word *to = a->word;
    to[0] = (word)(intptr_t)view->buf;
    for (int i = 0; i < n; i++) to[1 + i] = view->shape[i];
    a->word += 1 + n;
    return 1;
}

static int take(struct arguments *a, PyObject *given) {
    double number;
    switch (*a->code) {
    case 'i':
        if (a->code[1] >= '0' && a->code[1] <= '9') return take_array(a, given);
        *a->word = PyLong_AsLongLong(given);
        if (*a->word == -1 && PyErr_Occurred()) return PyErr_Clear(), refuse(a, "an integer");
        break;
    case 'f':
        if (a->code[1] >= '0' && a->code[1] <= '9') return take_array(a, given);
        number = PyFloat_AsDouble(given);
        if (number == -1.0 && PyErr_Occurred()) return PyErr_Clear(), refuse(a, "a number");
        memcpy(a->word, &number, sizeof number);
        break;
    case 'b':
        if ((*a->word = PyObject_IsTrue(given)) < 0) return PyErr_Clear(), refuse(a, "True or False");
        break;
    case '(':
        if (!PyTuple_Check(given)) return refuse(a, "a record");
        a->code++;
        for (Py_ssize_t i = 0; i < PyTuple_Size(given); i++)
            if (*a->code == ')') return refuse(a, "a record of fewer fields");
            else if (!take(a, PyTuple_GetItem(given, i))) return 0;
        if (*a->code != ')') return refuse(a, "a record of more fields");
        a->code++;
        return 1;
    default:
        return take_array(a, given);
    }
    a->code++, a->word++;
    return 1;
}

/* ---- Calls ---- */

static PyObject *call(PyObject *self, PyObject *const *given, Py_ssize_t n_given) {
    const struct kernel *kernel = PyCapsule_GetPointer(self, NULL);
    struct arguments a;
    word result = 0;
    int is_taken = 1, status = 0;
    a.kernel = kernel, a.code = kernel->takes, a.word = a.words, a.n_views = 0;
    for (a.place = 1; is_taken && a.place <= n_given; a.place++)
        is_taken = *a.code ? take(&a, given[a.place - 1]) : refuse(&a, "fewer arguments");
    if (is_taken && *a.code) is_taken = refuse(&a, "more arguments");
    if (is_taken) {
        Py_BEGIN_ALLOW_THREADS
        status = kernel->run(a.words, &result);
        Py_END_ALLOW_THREADS
    }
    while (a.n_views) PyBuffer_Release(a.views + --a.n_views);
    if (!is_taken) return NULL;
    if (status != 0) return PyErr_NoMemory();
    if (kernel->gives == 'i') return PyLong_FromLongLong(result);
    if (kernel->gives == 'b') return PyBool_FromLong(result & 1 ? 1 : 0);
    Py_INCREF(Py_None);
    return Py_None;
}

/* ---- The module ---- */

/* How many of LEVELS this processor has. */
static int n_levels(void) {
#if defined(__x86_64__) || defined(_M_X64)
    __builtin_cpu_init();
    if (!__builtin_cpu_supports("sse4.2") || !__builtin_cpu_supports("popcnt")) return 0;
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") || !__builtin_cpu_supports("bmi2")) return 1;
    if (!__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512bw") || !__builtin_cpu_supports("avx512cd") ||
        !__builtin_cpu_supports("avx512dq") || !__builtin_cpu_supports("avx512vl")) return 2;
    return 3;
#else
    return N_LEVELS;
#endif
}

static PyMethodDef METHODS[N_KERNELS];

static int fill(PyObject *module) {
    int level = n_levels();
    if (level == 0 && N_LEVELS > 0) {
        PyErr_SetString(PyExc_ImportError, "this processor is older than x86-64-v2");
        return -1;
    }
    for (int i = 0; i < N_KERNELS; i++) {
        if (KERNELS[i].level > level) continue;
        PyObject *self = PyCapsule_New((void *)(KERNELS + i), NULL, NULL);
        METHODS[i] = (PyMethodDef){KERNELS[i].name, (PyCFunction)(void (*)(void))call, METH_FASTCALL, NULL};
        PyObject *function = self ? PyCFunction_NewEx(METHODS + i, self, NULL) : NULL;
        Py_XDECREF(self);
        if (!function || PyModule_AddObjectRef(module, KERNELS[i].name, function)) return -1;
        Py_DECREF(function);
    }
    PyObject *levels = PyTuple_New(level);
    for (int i = 0; levels && i < level; i++) PyTuple_SetItem(levels, i, PyUnicode_FromString(LEVELS[i]));
    if (!levels || PyModule_AddObjectRef(module, "LEVELS", levels)) return -1;
    Py_DECREF(levels);
    return 0;
}

static PyModuleDef_Slot SLOTS[] = {{Py_mod_exec, (void *)fill}, {0, NULL}};
static struct PyModuleDef MODULE = {PyModuleDef_HEAD_INIT, "_compiled", NULL, 0, NULL, SLOTS, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__compiled(void) { return PyModuleDef_Init(&MODULE); }
