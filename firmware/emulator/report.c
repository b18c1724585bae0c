#include "report.h"

#include <inttypes.h>
#include <stdio.h>

#define WORST_STRAYS 12u

static const char *const RESET_NAMES[RESETS] = {"power_on",    "brown_out",      "watchdog",       "watchdog_window",
                                                "instruction", "stack_overflow", "stack_underflow"};

static double us(const run_report *r, uint64_t cycles) { return (double)cycles * r->chip->cycle_ns / 1000.0; }

static double cpu_part(const run_report *r)
{
    return r->times == NULL ? 0 : (double)r->times->busy / (double)r->cycles;
}

const char *report_fault(const run_report *r)
{
    const bool board = r->options->world.role == ROLE_BOARD;
    if (r->chip->stray_total > 0) {
        return "the program uses registers that the emulator does not model";
    }
    if (r->chip->bad_opcodes > 0 || r->chip->resets[RESET_BY_OVERFLOW] > 0 || r->chip->resets[RESET_BY_UNDERFLOW] > 0) {
        return "unknown instructions, or the stack ran over";
    }
    if (r->options->faulty) {
        return NULL;
    }
    if (r->times != NULL && us(r, r->times->all.longest) >= r->options->worst_us) {
        return "a slot is too long";
    }
    if (r->chip->bus_misuse > 0 || r->chip->adc_rushed > 0) {
        return "a bus or the ADC is used against its data sheet";
    }
    if (board && (r->frames.frames == 0 || r->frames.lost > 0 || r->frames.unsound > 0 || r->frames.overruns > 0)) {
        return "frames are missing";
    }
    if (!board &&
        (r->line.packets == 0 || r->line.missing > 0 || r->line.unsound > 0 || r->world->frames_refused > 0)) {
        return "frames are missing on the serial line";
    }
    if (r->chip->resets[RESET_BY_WDT] > 0 || r->chip->resets[RESET_BY_WDT_WINDOW] > 0) {
        return "the watchdog struck";
    }
    return NULL;
}

static void print_slots(const run_report *r)
{
    const watch *w = r->times;
    printf("\n%-24s %9s %10s %10s %12s\n", "slot", "count", "mean us", "worst us", "worst at s");
    for (size_t i = 0; i <= w->table->count; ++i) {
        const slot_time *s = &w->slots[i];
        if (s->count > 0) {
            printf("%-24s %9" PRIu64 " %10.1f %10.1f %12.4f\n",
                   i < w->table->count ? w->table->items[i].name : "(other)", s->count,
                   us(r, s->cycles) / (double)s->count, us(r, s->longest), (double)s->longest_ns * 1e-9);
        }
    }
    const slot_time *all = &w->all;
    printf("%-24s %9" PRIu64 " %10.1f %10.1f %12.4f\n", "all", all->count,
           all->count > 0 ? us(r, all->cycles) / (double)all->count : 0.0, us(r, all->longest),
           (double)all->longest_ns * 1e-9);
    printf("CPU %.1f %% in slots and interrupts, %" PRIu64 " interrupts\n", 100.0 * cpu_part(r), w->interrupts);
}

static void print_functions(const run_report *r)
{
    const watch *w = r->times;
    bool done[SYMBOLS_MOST + 1u] = {false};
    printf("\n%-24s %9s %12s %12s %10s %10s\n", "function", "calls", "own cycles", "own us/call", "us/call",
           "worst us");
    for (size_t row = 0; row <= w->table->count; ++row) {
        size_t best = w->table->count + 1u;
        for (size_t i = 0; i <= w->table->count; ++i) {
            if (!done[i] && (best > w->table->count || w->functions[i].own > w->functions[best].own)) {
                best = i;
            }
        }
        done[best] = true;
        const function_time *f = &w->functions[best];
        if (f->own == 0) {
            return;
        }
        const double calls = f->calls > 0 ? (double)f->calls : 1.0;
        printf("%-24s %9" PRIu64 " %11.2f%% %12.1f %10.1f %10.1f\n",
               best < w->table->count ? w->table->items[best].name : "(start)", f->calls,
               100.0 * (double)f->own / (double)r->cycles, us(r, f->own) / calls, us(r, f->whole) / calls,
               us(r, f->longest));
    }
}

static void print_strays(const run_report *r)
{
    unsigned shown = 0;
    for (unsigned at = 0; at < PIC_DATA && shown < WORST_STRAYS; ++at) {
        if (r->chip->strays[at] > 0) {
            printf("  not modelled: 0x%03X, %" PRIu32 " accesses\n", at, r->chip->strays[at]);
            ++shown;
        }
    }
}

static void print_frames(const run_report *r)
{
    const tally *t = &r->frames;
    printf("frames %" PRIu64 ": MPU %" PRIu64 ", BNO %" PRIu64 ", STATUS %" PRIu64 "; lost %" PRIu64
           ", unsound %" PRIu64 ", reads failed %" PRIu64 ", overruns %" PRIu64 ", restarts %" PRIu32 "\n",
           t->frames, t->by_type[1], t->by_type[2] + t->by_type[4], t->by_type[3], t->lost, t->unsound, t->failed,
           t->overruns, t->restarts);
    printf("air: %" PRIu64 " frames in %" PRIu64 " attempts, %" PRIu64
           " not delivered; an MPU read begins at most %" PRIu32 " us late\n",
           r->world->air.frames, r->world->air.attempts, r->world->air.undelivered, t->mpu_late_us);
}

void report_print(const run_report *r)
{
    const pic *p = r->chip;
    const bool board = r->options->world.role == ROLE_BOARD;
    printf("%s: %.3f s at %.0f MIPS, %.0f times real time\n", r->options->hex, r->options->seconds,
           1000.0 / p->cycle_ns, r->speed);
    if (board) {
        printf("profile: MPU every %u us, BNO every %u us\n", r->frames.mpu_period_us, r->frames.bno_period_us);
        print_frames(r);
    } else {
        printf("frames sent to it %zu, refused %" PRIu64 "; line: %" PRIu64 " packets, unsound %" PRIu64
               ", missing %" PRIu64 ", out %.2f to %.2f ms after their sending, %.0f baud\n",
               r->world->frames.count, r->world->frames_refused, r->line.packets, r->line.unsound, r->line.missing,
               (double)r->line.shortest_ns * 1e-6, (double)r->line.longest_ns * 1e-6,
               r->line.baud_ns > 0 ? 1e10 / (double)r->line.baud_ns : 0.0);
    }
    printf("stack: %u of %u levels; resets:", p->deepest, PIC_STACK);
    for (unsigned i = 0; i < RESETS; ++i) {
        if (p->resets[i] > 0) {
            printf(" %s %" PRIu32, RESET_NAMES[i], p->resets[i]);
        }
    }
    printf("\nregisters not modelled: %" PRIu64 " accesses; unknown instructions %" PRIu32 "; bus misuse %" PRIu32
           "; ADC rushed %" PRIu32 "\n",
           p->stray_total, p->bad_opcodes, p->bus_misuse, p->adc_rushed);
    print_strays(r);
    if (r->times != NULL) {
        print_slots(r);
        if (r->options->profile) {
            print_functions(r);
        }
    }
    const char *fault = report_fault(r);
    printf("\n%s\n", fault == NULL ? "good" : fault);
}

/* files */

static FILE *opened(const char *path)
{
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        (void)fprintf(stderr, "gsense_pic: %s cannot be written\n", path);
    }
    return file;
}

static void put_hex(FILE *file, const uint8_t *bytes, unsigned size)
{
    for (unsigned i = 0; i < size; ++i) {
        (void)fprintf(file, "%02x", bytes[i]);
    }
    (void)fputc('\n', file);
}

static bool write_frames(const run_report *r)
{
    FILE *file = opened(r->options->frames_path);
    if (file == NULL) {
        return false;
    }
    const heard_frame *items = r->world->frames.items;
    for (size_t i = 0; i < r->world->frames.count; ++i) {
        (void)fprintf(file, "%" PRIu64 " ", items[i].ns);
        put_hex(file, items[i].bytes, NRF_PAYLOAD);
    }
    return fclose(file) == 0;
}

static bool write_bursts(const run_report *r)
{
    FILE *file = opened(r->options->bursts_path);
    if (file == NULL) {
        return false;
    }
    const burst *items = r->world->bursts.items;
    for (size_t i = 0; i < r->world->bursts.count; ++i) {
        (void)fprintf(file, "%" PRIu64 " 0x%02x 0x%02x ", items[i].start_ns, items[i].address, items[i].reg);
        put_hex(file, items[i].bytes, items[i].size);
    }
    return fclose(file) == 0;
}

static bool write_serial(const run_report *r)
{
    FILE *file = opened(r->options->serial_path);
    if (file == NULL) {
        return false;
    }
    const serial_byte *items = r->world->serial.items;
    for (size_t i = 0; i < r->world->serial.count; ++i) {
        (void)fputc(items[i].byte, file);
    }
    return fclose(file) == 0;
}

static void json_slots(const run_report *r, FILE *file)
{
    const watch *w = r->times;
    (void)fprintf(file, ", \"cpu\": %.4f, \"worst_us\": %.3f, \"slots\": {", cpu_part(r), us(r, w->all.longest));
    const char *comma = "";
    for (size_t i = 0; i < w->table->count; ++i) {
        const slot_time *s = &w->slots[i];
        if (s->count > 0) {
            (void)fprintf(file, "%s\"%s\": {\"count\": %" PRIu64 ", \"mean_us\": %.3f, \"worst_us\": %.3f}", comma,
                          w->table->items[i].name, s->count, us(r, s->cycles) / (double)s->count, us(r, s->longest));
            comma = ", ";
        }
    }
    (void)fputs("}", file);
}

static bool write_json(const run_report *r)
{
    FILE *file = opened(r->options->json_path);
    if (file == NULL) {
        return false;
    }
    const tally *t = &r->frames;
    const pic *p = r->chip;
    const char *fault = report_fault(r);
    (void)fprintf(file,
                  "{\"schema\": \"gsense-pic/1\", \"fault\": \"%s\", \"speed\": %.1f, \"mpu_period_us\": %u, "
                  "\"bno_period_us\": %u",
                  fault == NULL ? "" : fault, r->speed, t->mpu_period_us, t->bno_period_us);
    (void)fprintf(file,
                  ", \"frames\": %" PRIu64 ", \"mpu\": %" PRIu64 ", \"bno\": %" PRIu64 ", \"status\": %" PRIu64
                  ", \"lost\": %" PRIu64 ", \"unsound\": %" PRIu64 ", \"failed\": %" PRIu64 ", \"overruns\": %" PRIu64
                  ", \"restarts\": %" PRIu32,
                  t->frames, t->by_type[1], t->by_type[2] + t->by_type[4], t->by_type[3], t->lost, t->unsound,
                  t->failed, t->overruns, t->restarts);
    (void)fprintf(file,
                  ", \"line\": {\"packets\": %" PRIu64 ", \"unsound\": %" PRIu64 ", \"missing\": %" PRIu64
                  ", \"refused\": %" PRIu64 ", \"shortest_ms\": %.3f, \"longest_ms\": %.3f}",
                  r->line.packets, r->line.unsound, r->line.missing, r->world->frames_refused,
                  (double)r->line.shortest_ns * 1e-6, (double)r->line.longest_ns * 1e-6);
    (void)fprintf(file, ", \"undelivered\": %" PRIu64 ", \"attempts\": %" PRIu64 ", \"mpu_late_us\": %" PRIu32,
                  r->world->air.undelivered, r->world->air.attempts, t->mpu_late_us);
    (void)fprintf(file,
                  ", \"stack\": %u, \"strays\": %" PRIu64 ", \"bad_opcodes\": %" PRIu32 ", \"bus_misuse\": %" PRIu32
                  ", \"adc_rushed\": %" PRIu32 ", \"interrupts\": %" PRIu64 ", \"resets\": {",
                  p->deepest, p->stray_total, p->bad_opcodes, p->bus_misuse, p->adc_rushed,
                  r->times == NULL ? (uint64_t)0 : r->times->interrupts);
    for (unsigned i = 0; i < RESETS; ++i) {
        (void)fprintf(file, "%s\"%s\": %" PRIu32, i > 0 ? ", " : "", RESET_NAMES[i], p->resets[i]);
    }
    (void)fputs("}", file);
    if (r->times != NULL) {
        json_slots(r, file);
    }
    (void)fputs("}\n", file);
    return fclose(file) == 0;
}

bool report_write_files(const run_report *r)
{
    const emulator_options *o = r->options;
    return (o->frames_path == NULL || write_frames(r)) && (o->bursts_path == NULL || write_bursts(r)) &&
           (o->serial_path == NULL || write_serial(r)) && (o->json_path == NULL || write_json(r));
}
