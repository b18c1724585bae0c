"""Registers of the MF624.

Sources: UIO: Linux drivers/uio/uio_mf624.c; COM: Linux drivers/comedi/drivers/mf6x4.c; HUD: Humusoft's HUDAQ library,
MF624.c of 2006. Digital and analog registers stand in two of them alike; counters and encoders rest on HUD alone. The
kernel's BADR0, 1, 2 are the card's PCI BARs 0, 2, 4 (COM), mapped by UIO as map0, map1, map2.
"""

from __future__ import annotations

UIO_NAME = "mf624"  # of the device in /sys/class/uio (UIO)

# BADR0, 32 bit
GPIOC = 0x54  # COM, HUD
GPIOC_EOLC = 1 << 17  # 1: an A/D conversion goes on, 0: done (COM)
GPIOC_LDAC = 1 << 23  # 1: all D/A outputs held, 0: updated at once (COM, HUD)
GPIOC_DACEN = 1 << 26  # D/A outputs on (COM, HUD)

# BADR1, 16 bit (COM, HUD)
ADCTRL = 0x00  # write: mask of the A/D channels
ADDATA = 0x00  # read: results, lowest selected channel first; 14-bit two's complement
DIN = 0x10  # read
DOUT = 0x10  # write
ADSTART = 0x20  # reading starts a conversion
DA0 = 0x20  # write; channel n at DA0 + 2 n
DA_CHANNELS = 8
DA_ZERO = 0x2000  # 0 V; offset binary

# BADR2, 32 bit (HUD)
CTR_SPACING = 0x10  # counter n's registers begin at 0x10 n
CTR_MODE, CTR_A, CTR_B = 0x00, 0x04, 0x08
CTR_COUNT = 5
CTRXCTRL = 0x60  # 6 command bits per counter, shifted by 6 n
IRCCTRL = 0x6C  # one byte per encoder
IRC0 = 0x70  # encoder k at IRC0 + 4 k, signed

CTR_START, CTR_STOP, CTR_LOAD, CTR_RESET, CTR_OUT_RESET = 1, 2, 4, 8, 0x20  # HUD
CTR_RESTART = CTR_STOP | CTR_LOAD | CTR_RESET | CTR_OUT_RESET
MODE_PWM = 0x0E  # repeat, A and B in turn, output toggles; down from 50 MHz (HUD)
MODE_FORCED_LOW = 0x20  # HUD
MODE_FORCED_HIGH = 0x30  # HUD
CTR_CLOCK = 50.0e6  # Hz

IRC_RESET_ALL = 0x10101010  # hold at 0 (HUD)
IRC_FILTER = 0x80  # quadrature, free-running, input filter (HUD)
IRC_RUN = 0x00

ALL_ONES = 0xFFFFFFFF  # what a PCI read without a card gives
