#ifndef GSENSE_PARSED_STDDEF_H
#define GSENSE_PARSED_STDDEF_H
typedef unsigned int size_t;
#define NULL ((void *)0)
#endif
