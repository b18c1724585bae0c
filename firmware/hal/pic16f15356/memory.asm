; memcpy, memset, memcmp over the two hardware pointers: 7 to 10 cycles a byte where SDCC's C takes 60.
; Arguments as SDCC's pic14 port passes them: W holds the first byte, STK00 on the following ones, most significant first. A
; pointer has three bytes; its first is 0x80 for flash, which is where the hardware pointers have flash, too.
	include "p16f15356.inc"

	extern	STK00
	extern	STK01
	extern	STK02
	extern	STK03
	extern	STK04
	extern	STK05
	extern	STK06
	extern	STK07

	global	_memcpy
	global	___memcpy
	global	_memset
	global	_memcmp

; A count of two bytes for two nested DECFSZ; Z set: nothing to do.
prepare	macro	high_byte, low_byte
	movf	low_byte,W
	btfss	STATUS,Z
	incf	high_byte,F
	movf	high_byte,F
	endm

first_to_fsr0	macro
	iorwf	STK00,W
	movwf	FSR0H
	movf	STK01,W
	movwf	FSR0L
	endm

second_to_fsr1	macro
	movf	STK03,W
	iorwf	STK02,W
	movwf	FSR1H
	movf	STK04,W
	movwf	FSR1L
	endm

memory_code	code

___memcpy:		; what SDCC assigns structures with
_memcpy:
	movwf	STK07
	first_to_fsr0
	second_to_fsr1
	prepare	STK05, STK06
	btfsc	STATUS,Z
	bra	copied
copy:
	moviw	FSR1++
	movwi	FSR0++
	decfsz	STK06,F
	bra	copy
	decfsz	STK05,F
	bra	copy
copied:
	movf	STK07,W
	return

_memset:
	movwf	STK07
	first_to_fsr0
	prepare	STK03, STK04
	btfsc	STATUS,Z
	bra	filled
	movf	STK02,W
set_bytes:
	movwi	FSR0++
	decfsz	STK04,F
	bra	set_bytes
	decfsz	STK03,F
	bra	set_bytes
filled:
	movf	STK07,W
	return

_memcmp:
	first_to_fsr0
	second_to_fsr1
	prepare	STK05, STK06
	btfsc	STATUS,Z
	bra	equal
compare:
	moviw	FSR1++
	movwf	STK07
	moviw	FSR0++
	subwf	STK07,W		; second minus first
	btfss	STATUS,Z
	bra	differ
	decfsz	STK06,F
	bra	compare
	decfsz	STK05,F
	bra	compare
equal:
	clrf	STK00
	retlw	0
differ:
	movlw	1
	movwf	STK00
	btfss	STATUS,C	; C: the second is the larger one, so the first is less
	retlw	0
	movlw	0xFF
	movwf	STK00
	retlw	0xFF

	end
