; The ADC's interrupt: 3 us a conversion, where SDCC's C takes 8. No local, no call: an interrupt must not touch STKxx.
	include "p16f15356.inc"

	global	_adc_serve
	global	_adc_left
	global	_adc_lisy_sum
	global	_adc_battery

#define	BATTERY_ON	0x05	; RA1, ADON
#define	ACQUIRE	0x0D		; of 3 cycles: 5 us

conversions_data	udata
_adc_left	res	1
_adc_lisy_sum	res	2
_adc_battery	res	2

conversions_code	code

_adc_serve:
	banksel	PIR1
	bcf	PIR1,ADIF
	banksel	_adc_left
	decf	_adc_left,F
	btfsc	STATUS,Z
	bra	battery
	banksel	ADRESL
	movf	ADRESL,W
	banksel	_adc_lisy_sum
	addwf	_adc_lisy_sum,F
	banksel	ADRESH
	movf	ADRESH,W
	banksel	_adc_lisy_sum
	addwfc	_adc_lisy_sum+1,F
	decf	_adc_left,W
	banksel	ADCON0
	btfsc	STATUS,Z
	bra	switch
	bsf	ADCON0,GO
	return
switch:
	movlw	BATTERY_ON
	movwf	ADCON0
	movlw	ACQUIRE
acquire:
	decfsz	WREG,F
	bra	acquire
	bsf	ADCON0,GO
	return
battery:
	banksel	ADRESL
	movf	ADRESL,W
	banksel	_adc_battery
	movwf	_adc_battery
	banksel	ADRESH
	movf	ADRESH,W
	banksel	_adc_battery
	movwf	_adc_battery+1
	return

	end
