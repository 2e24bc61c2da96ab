/* SPDX-License-Identifier: MIT */
/* fuzz frame - a good frame with some of its values, sizes and types changed is refused with a sentence, or drawn; the
 * unchanged one is drawn. The last byte says which field colours it, and whether
 * there are arrows. */
#include "edits.h"
#include "kit.h"
#include <frame.h>
#include <render.h>
#include <stdlib.h>

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { WIDTH = 120 }; /* pixels: what is slow is drawing */
static const char *const fields[] = { NULL, "velocity.x", "point.stress.xy", "cell.zone", "grain.radius" };
static char *path;

int LLVMFuzzerInitialize(int *argc, char ***argv) {
	(void)argc, (void)argv;
	quern_run *run = kit_run("frame", 20);
	if (quern_run_look(run) != QUERN_OK || quern_frame_write(run, 0) != QUERN_OK) abort();
	path = quern_format("%s/frames/000000.h5", run->folder);
	kit_close(run);
	edits_begin(path, false);
	return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
	const size_t n_fields = sizeof fields / sizeof *fields;
	const render_wish wish = { .field = size ? fields[data[size - 1] % n_fields] : NULL,
		.chains = true,
		.vectors = size && data[size - 1] & 64 ? "velocity" : NULL };
	render_frame frame;
	quern_text why = { 0 };
	edits_make(path, data, size);
	const int status = quern_render_frame_read_file(&frame, path, 0, &wish, &why);
	if (status ? !why.length : why.length > 0) abort();
	if (!size && status) {
		fprintf(stderr, "the frame as it was written is refused: %s\n", why.data);
		abort();
	}
	if (!status) {
		cairo_surface_t *picture = quern_render_page(&frame, &wish, WIDTH, RENDER_PNG, NULL, NULL);
		if (cairo_surface_status(picture) != CAIRO_STATUS_SUCCESS) abort();
		cairo_surface_destroy(picture);
	}
	quern_text_finish(&why);
	quern_render_frame_finish(&frame);
	return 0;
}
