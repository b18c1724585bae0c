; The core's CRC, and the multiplications that SDCC calls: in place of its own, which always take all their rounds.
; Arguments and results as SDCC's pic14 port passes them: first byte in W, the others from STK00 on, most significant first.
; The hardware pointers serve as scratch registers: they lie in every bank, and interrupts save them.
	include "p16f15356.inc"

	extern	STK00
	extern	STK01
	extern	STK02
	extern	STK03
	extern	STK04

	global	_crc16
	global	__muluchar
	global	__mulint

arithmetic_code	code

; uint16_t crc16(const uint8_t *data, uint8_t length), as core/crc16.c: 23 cycles a byte, SDCC's C takes 54.
_crc16:
	iorwf	STK00,W		; 0x80 in W: flash, which is where the pointer has flash, too
	movwf	FSR1H
	movf	STK01,W
	movwf	FSR1L
	movlw	0xFF
	movwf	STK00		; low
	movwf	STK01		; high
	movf	STK02,F
	btfsc	STATUS,Z
	bra	crc_done
crc_byte:
	moviw	FSR1++
	xorwf	STK01,W
	movwf	STK03
	swapf	STK03,W
	andlw	0x0F
	xorwf	STK03,F		; s = t ^ t >> 4
	swapf	STK03,W
	andlw	0xF0
	movwf	STK04		; s << 4
	xorwf	STK00,W
	movwf	STK01
	lslf	STK04,W
	xorwf	STK03,W
	movwf	STK00		; low = s ^ s << 5
	lsrf	STK03,F
	lsrf	STK03,F
	lsrf	STK03,W
	xorwf	STK01,F		; high = low ^ s << 4 ^ s >> 3
	decfsz	STK02,F
	bra	crc_byte
crc_done:
	movf	STK01,W
	return

; uint16_t __muluchar(uint8_t, uint8_t): W by STK00, as many rounds as STK00 has bits.
__muluchar:
	movwf	FSR1L
	clrf	FSR1H
	clrf	FSR0L
	clrf	FSR0H
char_round:
	lsrf	STK00,F
	btfss	STATUS,C
	bra	char_shift
	movf	FSR1L,W
	addwf	FSR0L,F
	movf	FSR1H,W
	addwfc	FSR0H,F
char_shift:
	lslf	FSR1L,F
	rlf	FSR1H,F
	movf	STK00,F
	btfss	STATUS,Z
	bra	char_round
	movf	FSR0L,W
	movwf	STK00
	movf	FSR0H,W
	return

; int __mulint(int, int): W, STK00 by STK01, STK02.
__mulint:
	movwf	FSR0L
	movf	STK01,W
	movwf	FSR1H
	movf	FSR0L,W
	movwf	STK01
	movf	STK02,W
	movwf	FSR1L
	clrf	FSR0L
	clrf	FSR0H
int_round:
	lsrf	STK01,F
	rrf	STK00,F
	btfss	STATUS,C
	bra	int_shift
	movf	FSR1L,W
	addwf	FSR0L,F
	movf	FSR1H,W
	addwfc	FSR0H,F
int_shift:
	lslf	FSR1L,F
	rlf	FSR1H,F
	movf	STK00,W
	iorwf	STK01,W
	btfss	STATUS,Z
	bra	int_round
	movf	FSR0L,W
	movwf	STK00
	movf	FSR0H,W
	return

	end
