/* Memory of a call from Python: first the caller's stack, then pieces that are given back at its end. */
#include <setjmp.h>
#include <stdlib.h>

union number { integer word; real number; };
struct piece { struct piece *before; };
struct host { arena memory; struct piece *last; jmp_buf none_left; char first[8192 + 64]; };

enum { LEAST_PIECE = 65536 };

static inline char *aligned(char *at) { return (char *)(((uintptr_t)at + 63) & ~(uintptr_t)63); }

static void more(void *owner, size_t size) {
    struct host *host = owner;
    size_t whole = sizeof(struct piece) + 64 + (size > LEAST_PIECE ? size : LEAST_PIECE);
    struct piece *piece = whole > size ? malloc(whole) : NULL;
    if (!piece) longjmp(host->none_left, 1);
    piece->before = host->last;
    host->last = piece;
    host->memory.next = aligned((char *)(piece + 1));
    host->memory.end = (char *)piece + whole;
}

/* Call a kernel with memory of its own; 1 if there is not enough. */
static int with_memory(void (*run)(arena *, const integer *, integer *), const integer *words, integer *results) {
    struct host host;
    int status = 1;
    host.memory.next = aligned(host.first);
    host.memory.end = host.first + sizeof host.first;
    host.memory.more = more;
    host.memory.owner = &host;
    host.last = NULL;
    if (!setjmp(host.none_left)) {
        run(&host.memory, words, results);
        status = 0;
    }
    while (host.last) {
        struct piece *piece = host.last;
        host.last = piece->before;
        free(piece);
    }
    return status;
}
