; The inner loops of I2C and SPI over the pointer FSR1 (chip_point_fsr1). Every wait counts down.
	include "p16f15356.inc"

	extern	STK00
	extern	STK01
	extern	STK02
	extern	STK03

	global	_i2c_select
	global	_i2c_burst
	global	_spi_send
	global	_spi_take

#define	SPI_POLLS 0x20		; of 5 cycles: a byte takes 32

bursts_code	code

; uint8_t i2c_select(uint8_t address, uint8_t reg, uint16_t polls): START, address for writing, register, repeated START,
; address for reading. `address` is in its upper seven bits. 1: done; 2: refused; 0: the polls are used up, or the bus is lost.
_i2c_select:
	movwf	STK03
	incf	STK01,F
	banksel	SSP1CON2
	bsf	SSP1CON2,SEN
select_start:
	btfss	SSP1CON2,SEN
	bra	select_started
	decfsz	STK02,F
	bra	select_start
	decfsz	STK01,F
	bra	select_start
	retlw	0
select_started:
	movf	STK03,W
	call	i2c_put
	xorlw	1
	btfss	STATUS,Z
	bra	select_failed
	movf	STK00,W
	call	i2c_put
	xorlw	1
	btfss	STATUS,Z
	bra	select_failed
	bsf	SSP1CON2,RSEN
select_again:
	btfss	SSP1CON2,RSEN
	bra	select_restarted
	decfsz	STK02,F
	bra	select_again
	decfsz	STK01,F
	bra	select_again
	retlw	0
select_restarted:
	movf	STK03,W
	iorlw	1
	bra	i2c_put
select_failed:
	xorlw	1
	return

; W to the bus: 1, 2 (refused) or 0. SSPxSTAT.R_W is set until the acknowledgement is in.
i2c_put:
	movwf	SSP1BUF
i2c_putting:
	btfss	SSP1STAT,R_NOT_W
	bra	i2c_put_done
	decfsz	STK02,F
	bra	i2c_putting
	decfsz	STK01,F
	bra	i2c_putting
	retlw	0
i2c_put_done:
	btfsc	SSP1CON2,ACKSTAT
	retlw	2
	retlw	1

; uint8_t i2c_burst(uint8_t length, uint16_t polls): reads and acknowledges, refuses the last byte. 1, or 0 when the polls (of
; 6 cycles, all waits together) are used up.
_i2c_burst:
	movwf	STK02
	incf	STK00,F
	banksel	SSP1CON2
i2c_next:
	bsf	SSP1CON2,RCEN
i2c_receiving:
	btfss	SSP1CON2,RCEN
	bra	i2c_received
	decfsz	STK01,F
	bra	i2c_receiving
	decfsz	STK00,F
	bra	i2c_receiving
	retlw	0
i2c_received:
	movf	SSP1BUF,W
	movwi	FSR1++
	bcf	SSP1CON2,ACKDT
	decf	STK02,F
	btfsc	STATUS,Z
	bsf	SSP1CON2,ACKDT
	bsf	SSP1CON2,ACKEN
i2c_answering:
	btfss	SSP1CON2,ACKEN
	bra	i2c_answered
	decfsz	STK01,F
	bra	i2c_answering
	decfsz	STK00,F
	bra	i2c_answering
	retlw	0
i2c_answered:
	movf	STK02,F
	btfss	STATUS,Z
	bra	i2c_next
	retlw	1

; void spi_send(uint8_t length), length not 0. The next byte is fetched while one goes out.
_spi_send:
	movwf	STK00
	banksel	SSP2BUF
	moviw	FSR1++
send_next:
	movwf	SSP2BUF
	moviw	FSR1++
	movwf	STK01
	movlw	SPI_POLLS
sending:
	btfsc	SSP2STAT,BF
	bra	sent
	decfsz	WREG,F
	bra	sending
sent:
	movf	SSP2BUF,W
	movf	STK01,W
	decfsz	STK00,F
	bra	send_next
	return

; void spi_take(uint8_t length), length not 0
_spi_take:
	movwf	STK00
	banksel	SSP2BUF
take_next:
	movlw	0xFF
	movwf	SSP2BUF
	movlw	SPI_POLLS
taking:
	btfsc	SSP2STAT,BF
	bra	taken
	decfsz	WREG,F
	bra	taking
taken:
	movf	SSP2BUF,W
	movwi	FSR1++
	decfsz	STK00,F
	bra	take_next
	return

	end
