/* SPDX-License-Identifier: MIT */
/* renew - a set without some of its entries, and with new ones; its blocks stay what they were */
#pragma once
#include <quern/solver.h>

typedef struct renewal {
	const char *set;
	const bool *drop; /* by entry: it goes; NULL: all stay */
	uint32_t
		n_new; /* entries behind the others, a block of their own: list them by when and where they appear */
	const int32_t *parent; /* by new entry: the old one that it is a copy of, -1: none; NULL: of all none */
	int32_t *now;   /* out, by old entry: the new one, of what has gone that of the next; NULL: nobody asks */
	uint32_t first; /* out: the first of the new ones */
} renewal;

/* [stage] One remap() and arrange(). Does nothing if nothing changes. */
quern_status quern_renew(const quern_step *, renewal *);
