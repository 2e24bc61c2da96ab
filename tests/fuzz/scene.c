/* SPDX-License-Identifier: MIT */
/* fuzz scene - any bytes as a scene, with every plugin that they may name, up to where the first step could begin */
#include <run.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
	quern_scene *scene = quern_scene_parse("scene.yaml", (const char *)data, size, &quern_host_table);
	if (quern_report_errors(scene->report)) {
		quern_scene_destroy(scene);
		return 0;
	}
	free(quern_scene_resolved(scene, NULL));
	quern_run *run = quern_run_create(scene, 1);
	if (run) quern_run_destroy(run);
	return 0;
}
