/* Random decisions that repeat with the seed; every kind of fault has a stream of its own. */
#ifndef GSENSE_CHANCE_H
#define GSENSE_CHANCE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint64_t state;
} chance;

static inline chance chance_stream(uint32_t seed, uint32_t stream)
{
    const chance c = {(uint64_t)(seed + 1u) * 0x9E3779B97F4A7C15u ^ (uint64_t)(stream + 1u) * 0xD1342543DE82EF95u};
    return c;
}

/* splitmix64 (Steele, Lea, Flood 2014) */
static inline uint64_t chance_bits(chance *c)
{
    c->state += 0x9E3779B97F4A7C15u;
    uint64_t z = c->state;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/* 0 <= x < 1 */
static inline double chance_part(chance *c) { return (double)(chance_bits(c) >> 11) / 9007199254740992.0; }

/* Draws even where the probability is 0, so that one option does not change another's course. */
static inline bool chance_of(chance *c, double probability) { return chance_part(c) < probability; }

#endif
