/* SPDX-License-Identifier: MIT */
/* environment - what a call of a plugin must leave as it was, since it belongs to the whole program */
#pragma once
#include <sys/types.h>

/* Rounding, masks of exceptions, and what becomes of very small numbers; not the flags that arithmetic raises. Of this
 * thread. */
unsigned quern_arithmetic(void);
void quern_arithmetic_set(unsigned);

typedef struct quern_environment {
	unsigned arithmetic, open; /* bits: of the standard streams */
	int folder;                /* the working folder, or -1 */
	dev_t device;
	ino_t inode;
} quern_environment;

quern_environment quern_environment_take(void);
/* Puts back what can be; returns what had changed, "the rounding or another mode of arithmetic", or NULL. */
const char *quern_environment_restore(quern_environment *);
void quern_environment_drop(quern_environment *);
