/* SPDX-License-Identifier: MIT */
/* harness - scenes in a test's own process: read from text, run step by step, and looked into */
#pragma once
#include <run.h>
#include <stdio.h>

enum { HARNESS_PATH = 40 };

/* Reads the text (printf-like, in YAML) and makes it ready to run, set-up phase included. A fault fails the test with
 * the program's own message. `workers` 0: all. Plugins come from QUERN_PLUGINS_DIR. */
quern_run *harness_open(uint32_t workers, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
/* A scene file with NULL-terminated --set options. */
quern_run *harness_open_file(uint32_t workers, const char *path, const char *const *sets);
void harness_close(quern_run *);
/* A file of this process's own for a scene to read, such as a table of grains; its name comes back in `path`. Whoever
 * asks closes it, and removes it once the scene is open. */
FILE *harness_file(char path[HARNESS_PATH]);

/* Settles to the end, if there is anything to settle. */
void harness_settle(quern_run *);
/* Long steps of the current interval's length, choosing a new interval when one ends; fails the test if the run does. */
void harness_steps(quern_run *, int64_t n);
/* What is made only when somebody looks, such as total.kinetic, from the state as it is. */
void harness_look(quern_run *);
/* The same, but gives the status back. */
quern_status harness_try(quern_run *, int64_t n);
/* Steps until at least this time in seconds has passed since the release. */
void harness_until(quern_run *, double time);

/* Entries of a set, and a field's columns: fails the test if the field does not exist. Valid until a step. */
uint32_t harness_count(quern_run *, const char *set);
quern_column harness_field(quern_run *, const char *field);
bool harness_has(quern_run *, const char *field);
/* A number of a plugin's in the running scene, to be changed on the way: of the first instance of the plugin. */
double *harness_param(quern_run *, const char *id, const char *name);
