/* pic_trace HEX STEPS: one line an instruction with the state before it, then the RAM; to be held against another
 * simulator. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "fake_outside.h"
#include "hexfile.h"

#define RAM_BYTES 2032u
#define LINEAR 0x2000u
#define COMMON 0x70u

static pic chip;
static struct outside around;

int main(int count, char **arguments)
{
    char error[200];
    pic_init(&chip, &around);
    if (count != 3 || !hexfile_load(&chip, arguments[1], error, sizeof error)) {
        (void)fprintf(stderr, "pic_trace: %s\n", count != 3 ? "want HEX STEPS" : error);
        return 2;
    }
    pic_program(&chip);
    pic_reset(&chip, RESET_BY_POWER);
    const uint64_t start = chip.cycles;
    for (long left = strtol(arguments[2], NULL, 10); left > 0; --left) {
        printf("%" PRIu64 " %04x %02x %02x %02x %04x %04x %02x\n", chip.cycles - start, chip.pc, chip.w, chip.status,
               chip.bsr, chip.fsr[0], chip.fsr[1], chip.pclath);
        pic_step(&chip);
    }
    for (unsigned i = 0; i < RAM_BYTES; ++i) {
        printf("%02x", pic_read_far(&chip, (uint16_t)(LINEAR + i)));
    }
    for (unsigned i = 0; i < 16u; ++i) {
        printf("%02x", chip.mem[COMMON + i]);
    }
    printf("\n");
    return chip.bad_opcodes == 0 ? 0 : 1;
}
