/* SPDX-License-Identifier: MIT */
/* check - the program's part of conformance tests: instances, kernels called in batches, tallies, and what holds for
 * all kinds. What a test of one kind sees of it is quern/check.h */
#pragma once
#include "environment.h"
#include "loader.h"
#include "param.h"
#include "pool.h"
#include <quern/check.h>

/* The state of a run, part by part: what two runs are compared by. */
typedef struct check_state {
	struct {
		char name[64];
		uint64_t hash;
	} part[512];
	uint32_t n; /* 0: there is none */
} check_state;

/* What a child process tells its parent, in memory that both see. */
typedef struct check_shared {
	char place[160]; /* what is being called, for the message about a crash */
	char left[240];  /* what a call has left behind in the environment; "": nothing */
	uint32_t properties, failed;
	char id[96];                /* of the plugin; "": it cannot be loaded */
	bool solver, tested, makes; /* whether there is a test of its kind, which makes kernels */
	check_state state;          /* of a scene's short run, as it ends */
} check_shared;

/* What the command line asks for. */
typedef struct check_task {
	const char *path;        /* of the object, in full */
	const quern_node *given; /* its parameters */
	uint32_t dimension;      /* 0: all that the plugin has */
	unsigned seconds;        /* for a group of tests */
	const char *scene;       /* a scene with this solver; NULL: none */
	const char *const *sets; /* for the scene, NULL-terminated */
	int64_t steps;           /* of the scene */
	const char *folder;      /* where its checkpoints lie for a while */
} check_task;

typedef struct check {
	quern_check open; /* first, so that one leads to the other */
	quern_loader *loader;
	const check_task *task;
	const quern_plugin_file *file;
	const quern_check_ops *test; /* of its kind; NULL: there is none */
	quern_units *units;
	quern_pool *pool;
	check_shared *shared;
	quern_environment *home; /* what every call is to leave as it is */
} check;

/* ---- services, for what is tried here as for tests; see quern_check_host ---- */
extern const quern_check_host quern_check_services;

__attribute__((format(printf, 2, 3))) void quern_check_place(const quern_check *, const char *fmt, ...);
/* Looks at all of the environment, puts it back, and notes what had changed: after calls that may do more than
 * compute. */
void quern_check_environment(const check *);
__attribute__((format(printf, 3, 4))) void quern_check_expect(
	quern_check_tally *, bool good, const char *fmt, ...);
__attribute__((format(printf, 4, 5))) void quern_check_measure(
	quern_check_tally *, double value, double allowed, const char *fmt, ...);
__attribute__((format(printf, 3, 4))) void quern_check_tell(
	const quern_check *, const quern_check_tally *, const char *note, ...);
/* A line that states no property. */
void quern_check_note(const char *text);
double quern_check_uniform(uint64_t key, uint64_t counter, double low, double high);
void quern_check_direction(uint32_t dim, uint64_t key, uint64_t counter, double out[3]);
double quern_check_ordinary(const quern_check *, const char *unit);
bool quern_check_is_unit(const quern_check *, const char *unit);
int quern_check_mass_power(const quern_check *, const char *unit);

/* ---- instances ---- */
typedef enum { CHECK_READY, CHECK_REFUSED, CHECK_RUDE } check_outcome;

typedef struct check_instance {
	quern_check_instance open;
	const check *check;
	quern_tree *tree; /* keeps texts; its root is what was set */
	quern_report *report;
	check_outcome outcome; /* RUDE: init fails without a word, or complains and goes on */
	bool ready;
	char why[240]; /* why there is none */
} check_instance;

bool quern_check_has_dim(const check *, uint32_t dim);
/* Never NULL: whether the plugin takes these parameters is its outcome. */
check_instance *quern_check_try(const check *, uint32_t dim, uint64_t setting);
quern_check_instance *quern_check_instance_create(const quern_check *, uint32_t dim, uint64_t setting);
quern_check_instance *quern_check_instance_scaled(
	const quern_check *, const quern_check_instance *, double factor);
void quern_check_instance_destroy(quern_check_instance *);
uint64_t quern_check_settings(const quern_check *);
bool quern_check_counts(const quern_check *, const quern_check_instance *, const quern_use *);
/* What an init gets. */
extern const quern_host quern_check_init_services;

/* ---- kernels ---- */
/* All uses on both sides as tensors, and what a test knows by a name. */
enum { CHECK_ROWS = QUERN_MOST_USES, CHECK_COLUMNS = 2 * 9 * CHECK_ROWS + 64 };

typedef struct check_kernel {
	quern_check_kernel open;
	quern_check_column column[CHECK_COLUMNS];
	int32_t at[QUERN_CHECK_NAMES], use[CHECK_ROWS], use_second[CHECK_ROWS];
	uint32_t overrun, changed, environment, altered; /* faults so far, and the column of the last one */
	const char *culprit;
} check_kernel;

size_t quern_check_entry_bytes(const quern_check_column *);
void quern_check_kernel_destroy(quern_check_kernel *);
void quern_check_run(quern_check_kernel *, uint32_t cut, bool threads);
bool quern_check_finite(const quern_check_kernel *, const char **column);

/* ---- groups of tests ---- */
void quern_check_table(const check *);
void quern_check_solver(const check *);
void quern_check_parameters(const check *);
void quern_check_batches(const check *);
/* A solver in a short run of a scene: the run itself, the same with other threads and batches, and from its
 * checkpoints. */
void quern_check_scene(const check *);
void quern_check_scene_threads(const check *);
void quern_check_scene_batches(const check *);
void quern_check_scene_resume(const check *);

/* All of them that the plugin's kind has, each in a child; the plugin is loaded nowhere else. Returns an exit status. */
int quern_check_plugin(const check_task *);
