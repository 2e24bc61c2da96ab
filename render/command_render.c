/* SPDX-License-Identifier: MIT */
/* quern render - a picture of a frame, to look at and to print */
#include "command.h"
#include "h5.h"
#include "options.h"
#include "quantity.h"
#include "render.h"
#include "render_watch.h"
#include "text.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef struct {
	const char *folder, *out, *view, *range, *widest, *longest;
	int64_t frame, width;
	bool measure, watch;
	render_wish wish;
	render_form form;
} options;

/* ---- the command line ---- */

/* A picture under another name would not be what its name says. */
static int check_name(options *o) {
	static const char *const ends[] = { [RENDER_PNG] = ".png", [RENDER_SVG] = ".svg", [RENDER_PDF] = ".pdf" };
	const char *slash = o->out ? strrchr(o->out, '/') : NULL, *name = slash ? slash + 1 : o->out;
	const char *dot = name ? strrchr(name, '.') : NULL;
	o->form = RENDER_PNG;
	if (!dot) return QUERN_OPTIONS_READ;
	for (size_t k = 0; k < sizeof ends / sizeof *ends; k++)
		if (!strcasecmp(dot, ends[k])) return o->form = (render_form)k, QUERN_OPTIONS_READ;
	return quern_usage(
		&quern_command_render, "PNG, SVG and PDF can be written: let %s end in .png, .svg or .pdf", o->out);
}

static int check_together(const options *o) {
	const quern_command *us = &quern_command_render;
	if (o->watch && o->frame >= 0)
		return quern_usage(us, "--watch draws the newest frame: leave out --frame");
	if (o->watch && o->measure) return quern_usage(us, "--measure draws nothing: leave out --watch");
	if (o->measure && o->out) return quern_usage(us, "--measure draws nothing: leave out --output");
	if (o->widest && !o->wish.chains)
		return quern_usage(us, "--widest is of the lines of --chains: give both");
	if (o->longest && !o->wish.vectors)
		return quern_usage(us, "--longest is of the arrows of --vectors: give both");
	return QUERN_OPTIONS_READ;
}

static int read_options(int argc, char **argv, options *o) {
	quern_words words = { .missing = "the folder of a run is missing", .least = 1, .most = 1 };
	const quern_option known[] = { QUERN_NUMBER(&o->frame, "frame", 0, INT64_MAX,
									   "which one, from 0; default: the last"),
		QUERN_TEXT(&o->wish.field, 0, "field", "NAME", "what to colour by: grain.velocity"),
		QUERN_TEXT(&o->out, 'o', "output", "FILE", "where to write it: .png, .svg or .pdf"),
		QUERN_NUMBER(&o->width, "width", 600, 8000, "in pixels; default: 1600"),
		QUERN_TEXT(&o->view, 0, "view", "X0,Y0,X1,Y1",
			"what to show, in m; in 3-D X0,Y0,Z0,X1,Y1,Z1; default: all that moves but 0.2 % that strays far"),
		QUERN_TEXT(
			&o->range, 0, "range", "LOW,HIGH", "what the first and the last colour stand for: 0,1.5 m/s"),
		QUERN_FLAG(&o->wish.chains, "chains",
			"a line for each contact that presses, as wide as its force; grains are plain without --field"),
		QUERN_TEXT(
			&o->widest, 0, "widest", "FORCE", "what the widest line stands for; default: of this frame"),
		QUERN_TEXT(&o->wish.vectors, 0, "vectors", "NAME", "arrows of a field: velocity"),
		QUERN_TEXT(
			&o->longest, 0, "longest", "VALUE", "what a long arrow stands for; default: of this frame"),
		QUERN_FLAG(&o->measure, "measure", "draw nothing, print the view, the range and the scales as JSON"),
		QUERN_FLAG(&o->watch, "watch", "of a run at work, draw each newest frame, until the run ends"),
		QUERN_END_OPTIONS };
	int status = quern_options_read(&quern_command_render, known, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return status;
	o->folder = words.at[0];
	status = check_name(o);
	return status == QUERN_OPTIONS_READ ? check_together(o) : status;
}

/* ---- numbers with units, once the frame has said which ---- */

/* `n` numbers between commas, each with a unit of its own or in SI. */
static bool read_list(const char *name, const char *text, const char *unit, size_t n, double most,
	double *out, quern_text *why) {
	quern_units *units = quern_units_create();
	char *copy = quern_copy(text), *rest = copy, reason[160] = "";
	size_t k = 0;
	for (char *word; !*reason && (word = strsep(&rest, ",")); k++) {
		double value = 0;
		word += strspn(word, " ");
		if (quern_quantity_read(units, word, unit, &value, reason) && !(fabs(value) <= most))
			snprintf(reason, sizeof reason, "%g is beyond %g", value, most);
		if (k < n) out[k] = value;
	}
	if (*reason) quern_text_add(why, "--%s %s: %s", name, text, reason);
	else if (k != n)
		quern_text_add(why, "--%s %s: needs %zu number%s, found %zu", name, text, n,
			n == 1 ? "" : "s between commas", k);
	free(copy);
	quern_units_destroy(units);
	return !*reason && k == n;
}

static bool read_view(options *o, int dimension, quern_text *why) {
	double at[6] = { 0 };
	const size_t d = (size_t)dimension;
	if (!read_list("view", o->view, "m", 2 * d, RENDER_FAR, at, why)) return false;
	for (size_t k = 0; k < d; k++) {
		o->wish.low[k] = at[k], o->wish.high[k] = at[d + k];
		if (at[d + k] - at[k] > fmax(1e-9 * fmax(fabs(at[k]), fabs(at[d + k])), 1e-12)) continue;
		quern_text_add(why, "--view %s: nothing lies between %g m and %g m: give the lower corner first",
			o->view, at[k], at[d + k]);
		return false;
	}
	return o->wish.has_view = true;
}

static bool read_range(options *o, const char *unit, quern_text *why) {
	double *at = o->wish.range;
	if (!read_list("range", o->range, unit, 2, RENDER_MOST_VALUE, at, why)) return false;
	o->wish.has_range = at[1] - at[0] > fmax(1e-9 * fmax(fabs(at[0]), fabs(at[1])), 1 / RENDER_MOST_VALUE);
	if (!o->wish.has_range)
		quern_text_add(why, "--range %s: nothing lies between %g and %g: give the lower end first", o->range,
			at[0], at[1]);
	return o->wish.has_range;
}

static bool read_scale(const char *name, const char *text, const char *unit, double *out, quern_text *why) {
	if (!read_list(name, text, unit, 1, RENDER_MOST_VALUE, out, why)) return false;
	if (*out > 1 / RENDER_MOST_VALUE) return true;
	quern_text_add(why, "--%s %s: it must be above 0", name, text);
	return false;
}

static bool read_numbers(options *o, const render_frame *f, quern_text *why) {
	return (!o->view || read_view(o, f->dimension, why)) && (!o->range || read_range(o, f->unit, why)) &&
		   (!o->widest || read_scale("widest", o->widest, "N", &o->wish.widest, why)) &&
		   (!o->longest || read_scale("longest", o->longest, f->vector_unit, &o->wish.longest, why));
}

/* ---- what comes of it ---- */

typedef struct {
	unsigned char *data;
	size_t n, capacity;
} bytes;

static cairo_status_t keep(void *to, const unsigned char *data, unsigned length) {
	bytes *b = to;
	b->data = quern_grow(b->data, b->n + length, &b->capacity, 1);
	memcpy(b->data + b->n, data, length);
	b->n += length;
	return CAIRO_STATUS_SUCCESS;
}

static int draw(const options *o, const render_frame *frame, const char *path) {
	bytes file = { 0 };
	char why[256] = "the picture cannot be made: out of memory";
	cairo_status_t status = CAIRO_STATUS_SUCCESS;
	cairo_surface_t *page = quern_render_page(frame, &o->wish, (int)o->width, o->form, keep, &file);
	if (o->form == RENDER_PNG) status = cairo_surface_write_to_png_stream(page, keep, &file);
	cairo_surface_finish(page);
	if (status == CAIRO_STATUS_SUCCESS) status = cairo_surface_status(page);
	const bool good =
		status == CAIRO_STATUS_SUCCESS && file.n && quern_save_bytes(path, file.data, file.n, why);
	cairo_surface_destroy(page);
	free(file.data);
	if (good) puts(path);
	else fprintf(stderr, "quern render: %s\n", why);
	fflush(stdout);
	return good ? QUERN_EXIT_DONE : QUERN_EXIT_IO;
}

static void print_numbers(const char *name, const double *at, size_t n) {
	printf("\"%s\": [", name);
	for (size_t k = 0; k < n; k++) printf("%s%.17g", k ? ", " : "", at[k]);
	printf("], ");
}

/* What this frame takes alone, so that somebody can join it with others. */
static int measure(const options *o, const render_frame *f) {
	const render_view view = quern_render_view_of(f, &o->wish);
	const render_range range = quern_render_range_of(f, &o->wish);
	double corners[6];
	const size_t d = (size_t)f->dimension;
	for (size_t k = 0; k < d; k++) corners[k] = view.low[k], corners[d + k] = view.high[k];
	printf("{\"frame\": %lld, \"time\": %.17g, ", (long long)f->number, f->time);
	print_numbers("view", corners, 2 * d);
	if (range.empty) printf("\"range\": null, ");
	else print_numbers("range", (const double[]) { range.low, range.high }, 2);
	printf("\"widest\": %.17g, \"longest\": %.17g}\n", quern_render_widest(f), quern_render_longest(f));
	return QUERN_EXIT_DONE;
}

static int do_frame(void *arg) {
	options *o = arg;
	render_frame frame;
	quern_text why = { 0 };
	int status = quern_render_frame_read(&frame, o->folder, o->frame, &o->wish, &why);
	if (status == QUERN_EXIT_DONE && !read_numbers(o, &frame, &why)) status = QUERN_EXIT_USAGE;
	if (status != QUERN_EXIT_DONE) fprintf(stderr, "quern render: %s\n", quern_text_string(&why));
	else if (o->measure) status = measure(o, &frame);
	else {
		char *path = o->out     ? quern_copy(o->out)
					 : o->watch ? quern_format("%s/newest.png", o->folder)
								: quern_format("%s/frame_%06lld.png", o->folder, (long long)frame.number);
		status = draw(o, &frame, path);
		free(path);
	}
	quern_text_finish(&why);
	quern_render_frame_finish(&frame);
	return status;
}

static int do_render(int argc, char **argv) {
	options o = { .frame = -1, .width = 1600 };
	const int status = read_options(argc, argv, &o);
	if (status != QUERN_OPTIONS_READ) return status;
	return o.watch ? quern_render_watch(o.folder, do_frame, &o) : do_frame(&o);
}

const quern_command quern_command_render = { "render", "DIR [OPTION]...", "a picture of a frame", do_render };
