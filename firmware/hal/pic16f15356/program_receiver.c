/* The receiver's program. */
#include "program.h"

#include "board.h"
#include "receiver.h"

static receiver the_receiver;

void program_run(void)
{
    receiver_init(&the_receiver, &radio_config);
    for (;;) {
        receiver_step(&the_receiver);
    }
}
