/* SPDX-License-Identifier: MIT */
/* quantity - numbers with units: "5 mm", "24 deg", "70 GPa", "10 %"; bare numbers are SI */
#pragma once
#include <stdbool.h>

typedef struct quern_units quern_units;

quern_units *quern_units_create(void);
void quern_units_destroy(quern_units *);

/* Reads `text` as a value in `unit` (UDUNITS-2 syntax, "1" for a pure number). On failure returns false and
 * leaves in `why` what was found and what is allowed. NaN, infinities and units with an offset (degC) are
 * refused, and so is a number too large for a double, or so small that it would be 0. */
bool quern_quantity_read(quern_units *, const char *text, const char *unit, double *value, char why[160]);
/* To which power a unit contains the mass: 1 for N/m, 0 for m/s, -1 for 1/kg; 0 where it is no unit. */
int quern_units_mass(quern_units *, const char *unit);
/* true if both name the same dimension and scale: "m/s" and "m s-1" */
bool quern_units_equal(quern_units *, const char *a, const char *b);
