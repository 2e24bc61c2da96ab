/* SPDX-License-Identifier: MIT */
/* fuzz checkpoint - a good checkpoint with some of its values, sizes and types changed is refused, or taken and looked
 * through; the unchanged one is taken and stepped on. Bytes that begin like a checkpoint are taken for a whole file. */
#include "edits.h"
#include "kit.h"
#include <checkpoint.h>
#include <stdlib.h>
#include <string.h>
#include <text.h>
#include <unistd.h>

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { STEPS = 2 };
static char *path;

int LLVMFuzzerInitialize(int *argc, char ***argv) {
	(void)argc, (void)argv;
	quern_run *run = kit_run("checkpoint", 20);
	if (quern_checkpoint_write(run, run->clock.frame + 1) != QUERN_OK) abort();
	path = quern_format("%s/checkpoint.h5", run->folder);
	kit_close(run);
	edits_begin(path, true);
	return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
	char broken[256];
	int64_t rows = 0;
	quern_text said = { 0 }, why = { 0 };
	if (size < 5 || memcmp(data, "quern", 5) != 0) edits_make(path, data, size);
	else if (!quern_save_bytes(path, data, size, broken)) abort();
	quern_run *run = kit_open();
	const bool good = quern_checkpoint_read(run, path, size % 2, &rows, &said, &why) == QUERN_OK;
	if (!good && !why.length) abort();
	if (!size && !good) {
		fprintf(stderr, "the checkpoint as it was written is refused: %s\n", why.data);
		abort();
	}
	if (good) quern_run_account(run);
	if (!size) kit_steps(run, STEPS);
	quern_text_finish(&said);
	quern_text_finish(&why);
	quern_run_destroy(run);
	unlink(path);
	return 0;
}
