/* SPDX-License-Identifier: MIT */
#include "kit.h"
#include <h5.h>
#include <sidecar.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <text.h>

static const char scene_text[] =
	"quern: 1\ndimension: 2\ngravity: [0, -9.81]\ndomain: {lower: [0, 0], upper: [0.2, 0.2]}\ntime: {end: "
	"1}\n"
	"output: {every: 0.1, compress: false, fields: [grain.velocity, grain.weight, point.stress, "
	"point.velocity, cell.zone, contact.force, touch.force]}\n"
	"bodies: [{plane: {point: [0, 0], normal: [0, 1]}}]\n"
	"grains: {material: {density: 2500, radius: {mean: 0.002}}, contact: {linear: {stiffness: 1e5}},\n"
	"  fill: {region: {box: {lower: [0.002, 0.002], upper: [0.05, 0.05]}}}}\n"
	"continuum: {cell: 0.008, material: mu_i}\n"
	"hybrid: {oracle: [{packing_fraction: {depth: 0.016, half_width: 0.008}}], update: 10}\n"
	"observe: [mass, energy, ledger]\n";

quern_run *kit_open(void) {
	quern_scene *scene =
		quern_scene_parse("scene.yaml", scene_text, sizeof scene_text - 1, &quern_host_table);
	quern_run *run = quern_report_errors(scene->report) ? NULL : quern_run_create(scene, 1);
	if (run) return run;
	quern_report_print(scene->report, stderr);
	abort();
}

void kit_steps(quern_run *run, int n) {
	run->clock.settled = 1;
	for (int i = 0; i < n || quern_run_awaits_frame(run);) {
		const quern_event event = quern_run_next(run);
		if (event == QUERN_FRAME_IS_DUE) quern_run_frame(run);
		else if (event == QUERN_STEPPED) i++;
		else break;
	}
}

void kit_close(quern_run *run) {
	quern_sidecars_destroy(run->sidecars);
	quern_run_destroy(run);
}

quern_run *kit_run(const char *name, int n) { return kit_run_of(name, kit_open(), n); }

quern_run *kit_run_of(const char *name, quern_run *run, int n) {
	const char *folder = getenv("TMPDIR");
	char why[256] = "";
	quern_h5_begin();
	if (quern_run_setup(run) != QUERN_OK) abort();
	kit_steps(run, n);
	run->folder = quern_format("%s/%s", folder ? folder : "/tmp", name);
	char *frames = quern_format("%s/frames", run->folder);
	if (mkdir(run->folder, 0777) || mkdir(frames, 0777)) perror(run->folder);
	free(frames);
	run->sidecars = quern_sidecars_create(run->folder, 0, why);
	if (!run->sidecars) abort();
	return run;
}
