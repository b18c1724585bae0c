/* Places the registers of chip.h. */
#define CHIP_DEFINE_REGISTERS
#include "chip.h"
