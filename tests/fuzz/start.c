/* SPDX-License-Identifier: MIT */
/* fuzz start - a good frame, or a good checkpoint, with some of its values, sizes and types changed is where a scene starts from:
 * refused with a sentence, or taken and stepped on; the unchanged one is taken. QUERN_FUZZ_CHECKPOINT takes the checkpoint. */
#include "edits.h"
#include "kit.h"
#include <checkpoint.h>
#include <frame.h>
#include <stdlib.h>
#include <string.h>
#include <text.h>

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { STEPS = 2 };
static char *path;

static const char scene_text[] =
	"quern: 1\ndimension: 2\ngravity: [1, -9.81]\ndomain: {lower: [0, 0], upper: [0.2, 0.2]}\ntime: {end: 1}\n"
	"bodies: [{plane: {point: [0, 0], normal: [0, 1]}}]\n"
	"grains: {material: {density: 2500, radius: {mean: 0.002}}, contact: {linear: {stiffness: 1e5}},\n"
	"  overlap: {most: 0}, from: ";

static quern_scene *scene_of(const char *text, size_t length) {
	return quern_scene_parse("scene.yaml", text, length, &quern_host_table);
}

/* Grains alone, since those of a hybrid are refused. */
static quern_run *open_first(void) {
	char *text = quern_format("%.*s%s", (int)(sizeof scene_text - 1 - strlen("from: ")), scene_text,
		"fill: {region: {box: {lower: [0.002, 0.002], upper: [0.05, 0.05]}}}}\n"
		"output: {every: 0.1, compress: false, fields: [grain.velocity, grain.spin, contact.slip]}\n");
	quern_scene *scene = scene_of(text, strlen(text));
	quern_run *run = quern_report_errors(scene->report) ? NULL : quern_run_create(scene, 1);
	if (!run) quern_report_print(scene->report, stderr), abort();
	free(text);
	return run;
}

int LLVMFuzzerInitialize(int *argc, char ***argv) {
	(void)argc, (void)argv;
	quern_run *run = kit_run_of("start", open_first(), 20);
	path = getenv("QUERN_FUZZ_CHECKPOINT") ? quern_format("%s/checkpoint.h5", run->folder)
										   : quern_format("%s/frames/000000.h5", run->folder);
	const bool sealed = getenv("QUERN_FUZZ_CHECKPOINT") != NULL;
	if (sealed ? quern_checkpoint_write(run, run->clock.frame + 1) != QUERN_OK
			   : quern_run_look(run) != QUERN_OK || quern_frame_write(run, 0) != QUERN_OK)
		abort();
	kit_close(run);
	edits_begin(path, sealed);
	return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
	edits_make(path, data, size);
	char *text = quern_format("%s%s}\n", scene_text, path);
	quern_scene *scene = scene_of(text, strlen(text));
	quern_run *run = quern_report_errors(scene->report) ? NULL : quern_run_create(scene, 1);
	if (!run) abort();
	const bool good = quern_run_setup(run) == QUERN_OK;
	if (!good && !run->message) abort();
	if (!size && !good) {
		fprintf(stderr, "the state as it was written is refused: %s\n", run->message);
		abort();
	}
	if (good) kit_steps(run, STEPS);
	quern_run_destroy(run);
	free(text);
	return 0;
}
