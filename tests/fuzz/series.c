/* SPDX-License-Identifier: MIT */
/* fuzz series - what a run reads back of its own when it goes on. An even first byte: the rest is series.csv, behind its
 * heading or, if the second byte is odd, whole; it is taken up to the rows that are asked for and cut there, or refused.
 * An odd first byte: the rest edits a frame, which run.xdmf and the lists in views/ name or leave out. */
#include "edits.h"
#include "kit.h"
#include <frame.h>
#include <observe.h>
#include <sidecar.h>
#include <stdlib.h>
#include <string.h>
#include <text.h>

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static quern_run *run;
static char *csv, *frame, *heading;
static size_t heading_size;

static char *read_all(const char *path, size_t *size) {
	enum { MOST = 1 << 20 };
	FILE *f = fopen(path, "rb");
	char *text = quern_take(MOST, 1);
	*size = f ? fread(text, 1, MOST - 1, f) : 0;
	if (f) fclose(f);
	return text;
}

int LLVMFuzzerInitialize(int *argc, char ***argv) {
	(void)argc, (void)argv;
	quern_series series;
	run = kit_run("series", 20);
	if (quern_run_look(run) != QUERN_OK || quern_frame_write(run, 0) != QUERN_OK) abort();
	if (quern_series_init(&series, run, 0) != QUERN_OK) abort();
	quern_series_finish(&series);
	csv = quern_format("%s/series.csv", run->folder);
	frame = quern_format("%s/frames/000000.h5", run->folder);
	heading = read_all(csv, &heading_size);
	edits_begin(frame, false);
	return 0;
}

static void try_series(const uint8_t *data, size_t size) {
	quern_series series;
	char why[256];
	const bool headed = !(size && data[0] & 1);
	const int64_t rows = size ? 1 + data[0] / 2 % 4 : 1;
	char *whole = quern_take(heading_size + size + 1, 1);
	const size_t before = headed ? heading_size : 0, after = size ? size - 1 : 0;
	memcpy(whole, heading, before);
	if (after) memcpy(whole + before, data + 1, after);
	if (!quern_save_bytes(csv, whole, before + after, why)) abort();
	const bool good = quern_series_init(&series, run, rows) == QUERN_OK;
	if (good ? series.rows != rows || series.column[0].n != rows : !run->message) abort();
	size_t length;
	char *left = read_all(csv, &length);
	if (good && (length < heading_size || left[length - 1] != '\n')) abort();
	free(left);
	free(whole);
	free(run->message);
	run->message = NULL;
	run->status = QUERN_OK;
	quern_series_finish(&series);
}

static void try_sidecars(const uint8_t *data, size_t size) {
	char why[256] = "";
	edits_make(frame, data, size);
	/* only the whole one as it is read on resume, where a child goes first: that is slow, and reads no other way */
	quern_sidecars *q = quern_sidecars_create(run->folder, size ? 0 : 1, why);
	if (!q || *why) abort();
	if (!quern_sidecars_add(q, 0, why) && !*why) abort();
	quern_sidecars_destroy(q);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
	if (!size) return 0;
	if (data[0] & 1) try_sidecars(data + 1, size - 1);
	else try_series(data + 1, size - 1);
	return 0;
}
