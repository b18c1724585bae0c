/* What SDCC's own header says for this chip, without its extensions: for the parser of specialise.py alone. */
#ifndef GSENSE_PARSED_STDINT_H
#define GSENSE_PARSED_STDINT_H
typedef unsigned char uint8_t;
typedef signed char int8_t;
typedef unsigned int uint16_t;
typedef int int16_t;
typedef unsigned long uint32_t;
typedef long int32_t;
#define UINT8_MAX 255
#define UINT16_MAX 65535u
#define SIZE_MAX 65535u
#endif
