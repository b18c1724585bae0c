#include "symbols.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LINE 300u

static int by_address(const void *a, const void *b)
{
    const symbol *x = a;
    const symbol *y = b;
    return x->address != y->address ? (x->address < y->address ? -1 : 1) : strcmp(x->name, y->name);
}

/* A row of the list "sorted by address": name, address, "program", storage, file. Labels inside of functions are left
 * out. */
static bool take(symbol_table *table, const char *line)
{
    char name[200];
    char where[32];
    unsigned address = 0;
    if (sscanf(line, " %199s 0x%x %31s", name, &address, where) != 3 || strcmp(where, "program") != 0 ||
        table->count == SYMBOLS_MOST || name[0] != '_' || strlen(name) >= SYMBOL_NAME || strstr(name, "_DS_") != NULL ||
        strncmp(name, "_S_", 3) == 0) {
        return false;
    }
    symbol *item = &table->items[table->count];
    item->address = (uint16_t)address;
    (void)snprintf(item->name, sizeof item->name, "%.47s", name);
    ++table->count;
    return true;
}

bool symbols_load(symbol_table *table, const char *path, char *error, size_t error_size)
{
    char line[LINE];
    bool wanted = false;
    table->count = 0;
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        (void)snprintf(error, error_size, "%s: cannot be read", path);
        return false;
    }
    while (fgets(line, (int)sizeof line, file) != NULL) {
        wanted = wanted || strstr(line, "Sorted by Address") != NULL;
        if (wanted) {
            (void)take(table, line);
        }
    }
    (void)fclose(file);
    if (table->count == 0) {
        (void)snprintf(error, error_size, "%s: no program symbols; want the map file of gplink -m", path);
        return false;
    }
    qsort(table->items, table->count, sizeof table->items[0], by_address);
    return true;
}

size_t symbols_at(const symbol_table *table, uint16_t address)
{
    size_t found = table->count;
    for (size_t low = 0, high = table->count; low < high;) {
        const size_t middle = low + (high - low) / 2u;
        if (table->items[middle].address <= address) {
            found = middle;
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return found;
}

size_t symbols_find(const symbol_table *table, const char *name)
{
    for (size_t i = 0; i < table->count; ++i) {
        const char *have = table->items[i].name;
        if (strcmp(have, name) == 0 || (have[0] == '_' && strcmp(have + 1, name) == 0)) {
            return i;
        }
    }
    return table->count;
}
