/* SPDX-License-Identifier: MIT */
/* quern render - a picture of a frame, to look at and to print */
#include "command.h"
#include "h5.h"
#include "options.h"
#include "render.h"
#include "text.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef struct {
	const char *folder, *field, *out;
	int64_t frame, width;
} options;

/* A picture under another name would not be what its name says. */
static int check_name(const char *out) {
	const char *slash = out ? strrchr(out, '/') : NULL, *name = slash ? slash + 1 : out;
	const char *dot = name ? strrchr(name, '.') : NULL;
	if (!dot || !strcasecmp(dot, ".png")) return QUERN_OPTIONS_READ;
	return quern_usage(&quern_command_render, "only PNG can be written: let %s end in .png", out);
}

static int read_options(int argc, char **argv, options *o) {
	quern_words words = { .missing = "the folder of a run is missing", .least = 1, .most = 1 };
	const quern_option known[] = { QUERN_NUMBER(&o->frame, "frame", 0, INT64_MAX,
									   "which one, from 0; default: the last"),
		QUERN_TEXT(&o->field, 0, "field", "NAME", "what to colour by: grain.velocity"),
		QUERN_TEXT(&o->out, 'o', "output", "FILE.png", "where to write it"),
		QUERN_NUMBER(&o->width, "width", 600, 8000, "in pixels; default: 1600"), QUERN_END_OPTIONS };
	const int status = quern_options_read(&quern_command_render, known, &words, argc, argv);
	if (status != QUERN_OPTIONS_READ) return status;
	o->folder = words.at[0];
	return check_name(o->out);
}

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

static int save(cairo_surface_t *surface, const char *path) {
	bytes png = { 0 };
	char why[256] = "the picture cannot be made: out of memory";
	const bool good = cairo_surface_write_to_png_stream(surface, keep, &png) == CAIRO_STATUS_SUCCESS &&
					  quern_save_bytes(path, png.data, png.n, why);
	free(png.data);
	if (good) puts(path);
	else fprintf(stderr, "quern render: %s\n", why);
	return good ? QUERN_EXIT_DONE : QUERN_EXIT_IO;
}

static int draw_frame(int argc, char **argv) {
	options o = { .frame = -1, .width = 1600 };
	render_frame frame;
	quern_text why = { 0 };
	int status = read_options(argc, argv, &o);
	if (status != QUERN_OPTIONS_READ) return status;
	status = quern_render_frame_read(&frame, o.folder, o.frame, o.field, &why);
	if (status == QUERN_EXIT_DONE) {
		char *path = o.out ? quern_copy(o.out)
						   : quern_format("%s/frame_%06lld.png", o.folder, (long long)frame.number);
		cairo_surface_t *surface = quern_render_page(&frame, (int)o.width);
		status = save(surface, path);
		cairo_surface_destroy(surface);
		free(path);
	} else fprintf(stderr, "quern render: %s\n", quern_text_string(&why));
	quern_text_finish(&why);
	quern_render_frame_finish(&frame);
	return status;
}

const quern_command quern_command_render = { "render", "DIR [OPTION]...", "a picture of a frame",
	draw_frame };
