/* quern render - a picture of a frame, to look at and to print */
#include "command.h"
#include "h5.h"
#include "render.h"
#include "text.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_WIDTH = 600, MOST_WIDTH = 8000 };

typedef struct {
	const char *folder, *field, *out;
	long long frame;
	long width;
} options;

static int read_options(int argc, char **argv, options *o) {
	for (int i = 1; i < argc; i++) {
		char *end = NULL;
		const char *value = i + 1 < argc ? argv[i + 1] : NULL;
		if (argv[i][0] != '-') {
			if (o->folder) return quern_usage("render", "one folder at a time, not also '%s'", argv[i]);
			o->folder = argv[i];
			continue;
		}
		const bool frame = !strcmp(argv[i], "--frame"), width = !strcmp(argv[i], "--width");
		const bool field = !strcmp(argv[i], "--field"), out = !strcmp(argv[i], "-o");
		if (!frame && !width && !field && !out)
			return quern_usage("render", "unknown argument '%s'", argv[i]);
		if (!value) return quern_usage("render", "%s needs a value", argv[i]);
		if (frame) o->frame = strtoll(value, &end, 10);
		if (width) o->width = strtol(value, &end, 10);
		if (field) o->field = value;
		if (out) o->out = value;
		if (end && (end == value || *end))
			return quern_usage("render", "%s: '%s' is no number", argv[i], value);
		if (frame && o->frame < 0) return quern_usage("render", "--frame counts from 0");
		i++;
	}
	if (!o->folder) return quern_usage("render", "the folder of a run is missing");
	if (o->width < LEAST_WIDTH || o->width > MOST_WIDTH)
		return quern_usage("render", "--width must be between %d and %d pixels", LEAST_WIDTH, MOST_WIDTH);
	return QUERN_EXIT_DONE;
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

int quern_command_render(int argc, char **argv) {
	options o = { .frame = -1, .width = 1600 };
	render_frame frame;
	quern_text why = { 0 };
	int status = read_options(argc, argv, &o);
	if (status != QUERN_EXIT_DONE) return status;
	status = render_frame_read(&frame, o.folder, o.frame, o.field, &why);
	if (status == QUERN_EXIT_DONE) {
		char *path = o.out ? quern_copy(o.out)
						   : quern_format("%s/frame_%06lld.png", o.folder, (long long)frame.number);
		cairo_surface_t *surface = render_page(&frame, (int)o.width);
		status = save(surface, path);
		cairo_surface_destroy(surface);
		free(path);
	} else fprintf(stderr, "quern render: %s\n", quern_text_string(&why));
	quern_text_finish(&why);
	render_frame_finish(&frame);
	return status;
}
