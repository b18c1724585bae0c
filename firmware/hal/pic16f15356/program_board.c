/* The board's program. */
#include "program.h"

#include "board.h"
#include "counters.h"
#include "hal.h"

#ifndef BOARD_PROFILE
#define BOARD_PROFILE board_profile_default
#endif

static board the_board;

void program_run(void)
{
    board_init(&the_board, &BOARD_PROFILE, 0);
    for (;;) {
        const uint32_t due = board_step(&the_board);
        while (!time_reached(hal_micros(), due)) {
        }
    }
}
