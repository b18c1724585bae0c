#ifndef GSENSE_PARSED_STRING_H
#define GSENSE_PARSED_STRING_H
#include "stddef.h"
void *memcpy(void *to, const void *from, size_t size);
void *memset(void *to, unsigned char value, size_t size);
int memcmp(const void *one, const void *other, size_t size);
#endif
