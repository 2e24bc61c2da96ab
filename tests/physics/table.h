/* SPDX-License-Identifier: MIT */
/* table - rows of what was measured, what was asked and how far apart they may be */
#pragma once
#include <math.h>
#include <stdbool.h>
#include <stdio.h>

static inline void table_head(const char *title) {
	printf("\n  %-58s %13s %13s %10s\n", title, "measured", "asked", "tolerance");
}

/* Prints the row; false (and a mark in the table) if it is out of tolerance or not a number. */
static inline bool table_row(const char *what, double measured, double asked, double tolerance) {
	const bool good = fabs(measured - asked) <= tolerance;
	printf("  %-58s %13.6g %13.6g %10.2g%s\n", what, measured, asked, tolerance, good ? "" : "  <- out");
	return good;
}

/* A row that is only reported. */
static inline void table_note(const char *what, double measured) {
	printf("  %-58s %13.6g\n", what, measured);
}
