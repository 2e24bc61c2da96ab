/* SPDX-License-Identifier: MIT */
/* harness - scenes in a test's own process */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static quern_run *make_ready(quern_scene *scene, uint32_t workers) {
	quern_run *run = quern_report_errors(scene->report) ? NULL : quern_run_create(scene, workers);
	if (!run || quern_report_errors(scene->report)) {
		quern_report_print(scene->report, stderr);
		fail_msg("the scene cannot be used");
		return NULL;
	}
	if (quern_run_setup(run) != QUERN_OK) fail_msg("%s", run->message);
	return run;
}

static void find_plugins(void) {
	const char *folder = getenv("QUERN_PLUGINS_DIR");
	if (folder) setenv("QUERN_PLUGIN_PATH", folder, 1);
}

quern_run *harness_open(uint32_t workers, const char *fmt, ...) {
	va_list list;
	char *text = NULL;
	find_plugins();
	va_start(list, fmt);
	const int length = vasprintf(&text, fmt, list);
	va_end(list);
	assert_true(length >= 0);
	quern_scene *scene = quern_scene_parse("test.yaml", text, (size_t)length, &quern_host_table);
	free(text);
	return make_ready(scene, workers);
}

quern_run *harness_open_file(uint32_t workers, const char *path, const char *const *sets) {
	find_plugins();
	return make_ready(quern_scene_read(path, sets, &quern_host_table), workers);
}

FILE *harness_file(char path[HARNESS_PATH]) {
	snprintf(path, HARNESS_PATH, "/tmp/quern-%ld.txt", (long)getpid());
	FILE *file = fopen(path, "wx");
	if (!file) fail_msg("%s cannot be made", path);
	return file;
}

void harness_close(quern_run *run) { quern_run_destroy(run); }

void harness_settle(quern_run *run) {
	while (!run->clock.settled && quern_run_next(run) == QUERN_SETTLING) {}
	if (run->status != QUERN_OK) fail_msg("%s", run->message);
}

quern_status harness_try(quern_run *run, int64_t n) {
	harness_settle(run);
	for (int64_t i = 0; (i < n || quern_run_awaits_frame(run)) && run->status == QUERN_OK;) {
		const quern_event event = quern_run_next(run);
		if (event == QUERN_FRAME_IS_DUE) quern_run_frame(run);
		if (event == QUERN_STEPPED) i++;
		if (event == QUERN_OVER) fail_msg("the scene is over after %lld steps", (long long)run->clock.step);
	}
	quern_plan_refresh(run->plan);
	return run->status;
}

void harness_look(quern_run *run) {
	if (quern_run_look(run) != QUERN_OK) fail_msg("%s", run->message);
	quern_plan_refresh(run->plan);
}

void harness_steps(quern_run *run, int64_t n) {
	if (harness_try(run, n) != QUERN_OK) fail_msg("%s", run->message);
}

void harness_until(quern_run *run, double time) {
	do harness_steps(run, 1);
	while (quern_run_time(run) < time);
}

uint32_t harness_count(quern_run *run, const char *set) {
	const int i = quern_store_set(&run->plan->store, set);
	return i < 0 ? 0 : run->plan->store.sets[i].n;
}

bool harness_has(quern_run *run, const char *field) {
	return quern_store_field(&run->plan->store, field) >= 0;
}

quern_column harness_field(quern_run *run, const char *name) {
	const int i = quern_store_field(&run->plan->store, name);
	if (i < 0) fail_msg("there is no field %s", name);
	const quern_field *field = &run->plan->store.fields[i];
	return quern_field_column(&run->plan->store, field, field->now);
}

double *harness_param(quern_run *run, const char *id, const char *name) {
	for (size_t i = 0; i < run->scene->n_instances; i++) {
		const quern_instance *one = run->scene->instances[i];
		if (strcmp(one->file->plugin.id, id) != 0) continue;
		const quern_param *row = quern_param_find(one->file->plugin.params, name);
		assert_non_null(row);
		return (double *)(void *)((char *)one->self + row->offset);
	}
	fail_msg("there is no %s", id);
	return NULL;
}
