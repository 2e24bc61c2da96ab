/* SPDX-License-Identifier: MIT */
#include "render.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

const render_colour quern_render_sand = { 0.87, 0.72, 0.48 }, quern_render_sky = { 0.52, 0.68, 0.85 },
					quern_render_grey = { 0.72, 0.72, 0.72 }, quern_render_rose = { 0.80, 0.24, 0.38 },
					quern_render_ink = { 0.13, 0.13, 0.15 };

render_colour quern_render_mix(render_colour a, render_colour b, double t) {
	return (render_colour) { a.r + t * (b.r - a.r), a.g + t * (b.g - a.g), a.b + t * (b.b - a.b) };
}

static double to_screen(double linear) {
	const double x = linear < 0 ? 0 : linear > 1 ? 1 : linear;
	return x < 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
}

/* Oklab (Ottosson 2020): equal steps of L, a and b look equal. */
static render_colour from_oklab(double lightness, double a, double b) {
	const double l = pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
	const double m = pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
	const double s = pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
	return (render_colour) { to_screen(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
		to_screen(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
		to_screen(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s) };
}

/* Lightness rises evenly while the hue turns from violet over blue and green to yellow: it reads in print, and for
 * those who do not see all colours. The chroma is what a screen can show all along the way. */
render_colour quern_render_map(double t) {
	const double x = t < 0 ? 0 : t > 1 ? 1 : t, off = x - 0.45;
	const double hue = (300 - 195 * x) * 0.017453292519943295, chroma = 0.10 + 0.28 * off * off;
	return from_oklab(0.33 + 0.58 * x, chroma * cos(hue), chroma * sin(hue));
}

/* ---- the range of the values ---- */

double quern_render_round_step(double wanted) {
	const double power = pow(10, floor(log10(wanted))), lead = wanted / power;
	return (lead >= 5 ? 5 : lead >= 2 ? 2 : 1) * power;
}

static int by_value(const void *a, const void *b) {
	const double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

double quern_render_quantile(double *values, size_t n, double share) {
	qsort(values, n, sizeof(double), by_value);
	return n ? values[(size_t)ceil(share * (double)(n - 1))] : 0;
}

/* Values that can be drawn. */
static bool has_colour(double value) { return fabs(value) <= RENDER_MOST_VALUE; }

/* All of them but those of fixed grains, which are not coloured; sorted. */
static double *gather(const render_frame *f, size_t *n) {
	const render_cloud *clouds[3] = { &f->grains, &f->points, &f->cells };
	double *all = quern_take(f->grains.n + f->points.n + f->cells.n + 1, sizeof(double));
	*n = 0;
	for (int k = 0; k < 3; k++)
		for (size_t i = 0; clouds[k]->value && i < clouds[k]->n; i++) {
			const bool shown = k != 0 || clouds[k]->sort[i] != RENDER_FIXED;
			if (shown && has_colour(clouds[k]->value[i])) all[(*n)++] = clouds[k]->value[i];
		}
	qsort(all, *n, sizeof(double), by_value);
	return all;
}

/* A few stray values must not take all the colours: beyond twice the spread of the rest they are cut, and marked. */
static void set_ends(render_range *range, const double *all, size_t n, bool signs) {
	double low = all[0], high = all[n - 1];
	const double least = all[n / 200], most = all[n - 1 - n / 200], middle = all[n / 2];
	if (high - middle > 2 * (most - middle) && most > middle) high = most, range->above = true;
	if (middle - low > 2 * (middle - least) && middle > least) low = least, range->below = true;
	if (!signs || (low > 0 && low < 0.5 * high)) low = 0, range->below = false;
	/* one value, or too close to tell apart by marks that are numbers: some range around it */
	if (!(high - low > fmax(1e-9 * fmax(fabs(high), fabs(low)), 1 / RENDER_MOST_VALUE))) {
		const double some = fabs(high) > 1 / RENDER_MOST_VALUE ? fabs(high) : 1;
		if (low < 0) low -= 0.5 * some;
		high = low + some;
	}
	range->step = quern_render_round_step((high - low) / 3);
	const double half = 0.5 * range->step;
	range->low = range->below ? low : half * floor(low / half + 1e-9);
	range->high = range->above ? high : half * ceil(high / half - 1e-9);
}

/* ---- units ---- */

/* Appends a unit, with raised figures for "^2" and the like. */
static void add_unit(char *out, size_t size, const char *unit) {
	static const char *const raised[] = { "⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹" };
	size_t n = strlen(out);
	bool high = false;
	for (; *unit && n + 4 < size; unit++) {
		const bool digit = *unit >= '0' && *unit <= '9';
		high = *unit == '^' || (high && (digit || *unit == '-'));
		if (*unit == '^') continue;
		if (high) n += (size_t)snprintf(out + n, size - n, "%s", digit ? raised[*unit - '0'] : "⁻");
		else out[n++] = *unit;
		out[n] = 0;
	}
}

/* A prefix stands before the first unit, unless that has a power of its own or is one already. */
static bool takes_prefix(const char *unit) {
	static const char *const plain[] = { "Pa", "m", "N", "J", "s", "W", "Hz" };
	const size_t n = strcspn(unit, "/ *");
	for (size_t k = 0; k < sizeof plain / sizeof *plain; k++)
		if (strlen(plain[k]) == n && !strncmp(plain[k], unit, n)) return true;
	return false;
}

/* The unit in which numbers up to `size` are shown, and the factor from SI to it. */
static double choose_unit(double size, const char *si, char *unit, size_t room) {
	static const char *const prefixes[] = { "n", "µ", "m", "", "k", "M", "G" };
	const int third = size >= 0.1 && size < 1 ? 0 : (int)floor(log10(size * 1.0001) / 3);
	const bool prefix = takes_prefix(si) && third >= -3 && third <= 3;
	double by = 1;
	*unit = 0;
	if (prefix) snprintf(unit, room, "%s", prefixes[third + 3]), by = pow(1000, -third);
	else if (size >= 1e4 || size < 1e-3) {
		const int power = (int)floor(log10(size * 1.0001));
		char factor[16];
		snprintf(factor, sizeof factor, "10^%d ", power);
		add_unit(unit, room, factor);
		by = pow(10, -power);
	}
	if (strcmp(si, "1") != 0) add_unit(unit, room, si);
	return by;
}

void quern_render_quantity(char *out, size_t size, double value, const char *si) {
	char unit[64];
	const double factor = choose_unit(value, si, unit, sizeof unit);
	snprintf(out, size, "%.3g%s%s", value * factor, *unit ? " " : "", unit);
}

static void set_label(render_range *range, const render_frame *f) {
	char unit[64];
	const char *name = f->field;
	range->factor = choose_unit(fmax(fabs(range->low), fabs(range->high)), f->unit, unit, sizeof unit);
	size_t n = (size_t)snprintf(range->label, sizeof range->label, f->signs ? "%s" : "|%s|", name);
	for (size_t i = 0; i < n; i++)
		if (range->label[i] == '.' || range->label[i] == '_') range->label[i] = ' ';
	if (*unit) snprintf(range->label + n, sizeof range->label - n, " (%s)", unit);
}

/* As they are wished; only what lies beyond is the frame's. */
static void fix_ends(render_range *range, const double *all, size_t n, const double wished[2]) {
	range->low = wished[0], range->high = wished[1];
	range->step = quern_render_round_step((range->high - range->low) / 3);
	range->below = n && all[0] < range->low;
	range->above = n && all[n - 1] > range->high;
}

render_range quern_render_range_of(const render_frame *f, const render_wish *wish) {
	render_range range = { .high = 1, .step = 0.2, .factor = 1 };
	size_t n;
	double *all = gather(f, &n);
	range.empty = !n || all[0] == all[n - 1];
	if (wish->has_range) fix_ends(&range, all, n, wish->range);
	else if (n) set_ends(&range, all, n, f->signs);
	if (*f->field) set_label(&range, f);
	free(all);
	return range;
}

double quern_render_share(const render_range *range, double value) {
	const double t = (value - range->low) / (range->high - range->low);
	return t > 0 ? (t < 1 ? t : 1) : 0;
}
