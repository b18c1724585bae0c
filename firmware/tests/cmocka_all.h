/* cmocka wants these before itself. */
#ifndef GSENSE_CMOCKA_ALL_H
#define GSENSE_CMOCKA_ALL_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#endif
