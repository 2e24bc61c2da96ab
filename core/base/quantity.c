/* SPDX-License-Identifier: MIT */
#include "quantity.h"
#include "text.h"
#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <udunits2.h>

struct quern_units {
	ut_system *system; /* read at the first unit: a scene in bare SI never needs it */
};

quern_units *quern_units_create(void) { return quern_take(1, sizeof(quern_units)); }

void quern_units_destroy(quern_units *units) {
	if (!units) return;
	if (units->system) ut_free_system(units->system);
	free(units);
}

static ut_system *load(quern_units *units) {
	if (units->system) return units->system;
	ut_set_error_message_handler(ut_ignore);
	units->system = ut_read_xml(NULL);
	if (!units->system) return NULL;
	ut_unit *degree = ut_get_unit_by_name(units->system, "degree"),
			*micro = ut_parse(units->system, "um", UT_ASCII);
	if (degree) ut_map_name_to_unit("deg", UT_ASCII, degree);
	if (micro) ut_map_symbol_to_unit("mum", UT_ASCII, micro);
	ut_free(degree);
	ut_free(micro);
	return units->system;
}

static ut_unit *parse(ut_system *system, const char *unit) {
	if (!*unit || !strcmp(unit, "1")) return ut_get_dimensionless_unit_one(system);
	return ut_parse(system, unit, UT_UTF8);
}

/* To UDUNITS-2 an angle is a pure number; a share of "30 deg" is none. */
static bool is_angle(const ut_unit *unit) {
	char text[64];
	return ut_format(unit, text, sizeof text, UT_ASCII | UT_DEFINITION) > 0 && strstr(text, "rad");
}

/* "2 3" would be twice three; "2 1/s" is meant. */
static bool names_a_unit(const char *text) {
	return strchr("+-.,", *text) == NULL && (!isdigit((unsigned char)*text) || !strncmp(text, "1/", 2));
}

static bool convertible(const ut_unit *a, const ut_unit *b) {
	if (!ut_are_convertible(a, b) || ut_is_dimensionless(a) != ut_is_dimensionless(b)) return false;
	return !ut_is_dimensionless(b) || is_angle(a) == is_angle(b);
}

static bool convert(quern_units *units, const char *from, const char *to, double *value, char why[160]) {
	ut_system *system = load(units);
	if (!system) {
		snprintf(why, 160, "the unit database of UDUNITS-2 cannot be read; is libudunits2-data installed?");
		return false;
	}
	ut_unit *a = names_a_unit(from) ? parse(system, from) : NULL, *b = parse(system, to);
	bool good = false;
	if (*from == ',') snprintf(why, 160, "a decimal comma: write a point");
	else if (!a)
		snprintf(why, 160, "'%.40s' is no unit; %s is wanted", from, strcmp(to, "1") ? to : "a pure number");
	else if (!b || !convertible(a, b))
		snprintf(why, 160, "'%.40s' cannot be turned into %s", from, strcmp(to, "1") ? to : "a pure number");
	else {
		cv_converter *converter = ut_get_converter(a, b);
		if (!converter || cv_convert_double(converter, 0.0) != 0.0)
			snprintf(why, 160, "'%.40s' has an offset; give the value in %s", from, to);
		else {
			*value = cv_convert_double(converter, *value);
			good = true;
		}
		cv_free(converter);
	}
	ut_free(a);
	ut_free(b);
	return good;
}

bool quern_quantity_read(
	quern_units *units, const char *text, const char *unit, double *value, char why[160]) {
	char *end;
	const char *digits = text + (*text == '-' || *text == '+');
	if (!isdigit((unsigned char)*digits) && !(*digits == '.' && isdigit((unsigned char)digits[1]))) {
		snprintf(why, 160, "'%.40s' is no number", text);
		return false;
	}
	errno = 0;
	const double number = strtod(text, &end);
	if (digits[0] == '0' && tolower((unsigned char)digits[1]) == 'x') {
		snprintf(why, 160, "'%.40s' is no decimal number", text);
		return false;
	}
	if (!isfinite(number)) {
		snprintf(why, 160, "'%.40s' is too large", text);
		return false;
	}
	if (number == 0 && errno == ERANGE) {
		snprintf(why, 160, "'%.40s' is too small", text);
		return false;
	}
	*value = number;
	while (isspace((unsigned char)*end)) end++;
	if (*end && !convert(units, end, unit, value, why)) return false;
	if (isfinite(*value)) return true;
	snprintf(why, 160, "'%.40s' is too large", text);
	return false;
}

int quern_units_mass(quern_units *units, const char *unit) {
	ut_system *system = load(units);
	ut_unit *u = system ? parse(system, unit) : NULL;
	char text[128] = ""; /* in base units: "0.001 m-3.kg" */
	if (u && ut_format(u, text, sizeof text, UT_ASCII | UT_DEFINITION) < 0) *text = 0;
	ut_free(u);
	const char *kg = strstr(text, "kg");
	if (!kg) return 0;
	return kg[2] == '-' || isdigit((unsigned char)kg[2]) ? (int)strtol(kg + 2, NULL, 10) : 1;
}

bool quern_units_equal(quern_units *units, const char *a, const char *b) {
	if (!strcmp(a, b)) return true;
	ut_system *system = load(units);
	if (!system) return false;
	ut_unit *u = parse(system, a), *v = parse(system, b);
	const bool same = u && v && ut_compare(u, v) == 0;
	ut_free(u);
	ut_free(v);
	return same;
}
