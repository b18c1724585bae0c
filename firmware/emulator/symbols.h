/* Functions of the program by address, from the map file of gplink (-m). */
#ifndef GSENSE_EMULATOR_SYMBOLS_H
#define GSENSE_EMULATOR_SYMBOLS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SYMBOL_NAME 48u
#define SYMBOLS_MOST 1024u

typedef struct {
    uint16_t address;
    char name[SYMBOL_NAME];
} symbol;

typedef struct {
    symbol items[SYMBOLS_MOST]; /* by address */
    size_t count;
} symbol_table;

/* False: no such file, or no program symbol in it (one line in `error`). */
bool symbols_load(symbol_table *table, const char *path, char *error, size_t error_size);
/* The last symbol at or before the address; `count` where there is none. */
size_t symbols_at(const symbol_table *table, uint16_t address);
/* Index of a name (a leading underscore may be left out); `count` where there is none. */
size_t symbols_find(const symbol_table *table, const char *name);

#endif
