#include "report.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static void write_line(FILE *out, const host *h, const board *b)
{
    const truth *t = &h->pty.delivered;
    fprintf(out, "{\"schema\": \"gsense-truth/1\", \"seed\": %" PRIu32 ", \"received\": %" PRIu64 ", \"lost\": %" PRIu64
            ", \"corrupt\": %" PRIu64 ", \"duplicate\": %" PRIu64 ", \"restarts\": %" PRIu64 ", \"unknowable\": %" PRIu64
            ", \"unsent\": %zu, \"unread\": %zu, \"dropped\": %" PRIu64,
            h->options.seed, t->received, t->lost, t->corrupt, t->duplicate, t->restarts, t->unknowable, h->pty.waiting,
            pty_unread(&h->pty), h->pty.dropped);
    fprintf(out, ", \"air\": {\"frames\": %" PRIu64 ", \"attempts\": %" PRIu64 ", \"undelivered\": %" PRIu64 "}",
            h->air.frames, h->air.attempts, h->air.undelivered);
    fprintf(out, ", \"radio\": {\"given_up\": %u, \"stuck\": %u, \"restarts\": %u}", b->radio.given_up, b->radio.stuck,
            b->radio.restarts);
    fprintf(out, ", \"i2c\": {\"errors\": %u, \"timeouts\": %u, \"recoveries\": %u, \"stuck\": %u}", b->bus.errors,
            b->bus.timeouts, b->bus.recoveries, b->bus.stuck);
    fprintf(out, ", \"slots_skipped\": %u, \"receiver_overflow\": %u}\n", b->slots.skipped, h->receiver.overflow);
}

void report_truth(const host *h, const board *b)
{
    const char *path = h->options.faults.truth_path;
    if (path == NULL) {
        write_line(stderr, h, b);
        return;
    }
    char temporary[4096];
    const int length = snprintf(temporary, sizeof temporary, "%s.%ld", path, (long)getpid());
    FILE *file = length > 0 && (size_t)length < sizeof temporary ? fopen(temporary, "w") : NULL;
    if (file == NULL) {
        fprintf(stderr, "gsense_board: --truth %s: %s\n", path, strerror(errno));
        return;
    }
    write_line(file, h, b);
    if (fclose(file) != 0 || rename(temporary, path) != 0) {
        fprintf(stderr, "gsense_board: --truth %s: %s\n", path, strerror(errno));
        unlink(temporary);
    }
}
