/* SPDX-License-Identifier: MIT */
/* check - what the conformance tests of all kinds share: instances, kernels called in batches, tallies.
 *
 * A kernel is a function of a plugin that is called with batches, together with the columns it gets. Every call gets
 * copies of its own: cut as wished, padded with harmless lanes, with guards on both ends. */
#pragma once
#include "environment.h"
#include "pool.h"
#include "scene.h"

/* What a child process tells its parent, in memory that both see. */
typedef struct check_shared {
	char place[160]; /* what is being called, for the message about a crash */
	char left[240];  /* what a call has left behind in the environment; "": nothing */
	uint32_t properties, failed;
} check_shared;

typedef struct check {
	const quern_plugin_file *file;
	const void *ops;         /* as the kind's header has them */
	const quern_node *given; /* parameters of --set */
	uint32_t dimension;      /* 0: all that the plugin has */
	unsigned seconds;        /* for a group of tests */
	quern_units *units;
	check_shared *shared;
	quern_environment *home; /* what every call is to leave as it is */
} check;

/* Names the next call. If the last one has changed arithmetic, that is noted and put back. */
__attribute__((format(printf, 2, 3))) void quern_check_place(const check *, const char *fmt, ...);
/* The same for all of the environment, after calls that may do more than compute. */
void quern_check_environment(const check *);

/* Uniform in [low, high), a function of its arguments. */
double quern_check_uniform(uint64_t key, uint64_t counter, double low, double high);
/* A unit vector; in 2-D the third component is zero. */
void quern_check_direction(uint32_t dim, uint64_t key, uint64_t counter, double out[3]);

/* ---- tallies: one line of output each ---- */
typedef struct check_tally {
	const char *name;
	uint32_t tried, failed;
	double worst, allowed; /* of what was measured: the case that comes closest to its tolerance */
	char first[240];       /* what failed first */
} check_tally;

__attribute__((format(printf, 3, 4))) void quern_check_expect(check_tally *, bool good, const char *fmt, ...);
__attribute__((format(printf, 4, 5))) void quern_check_measure(
	check_tally *, double value, double allowed, const char *fmt, ...);
/* Prints the line: "ok  name: figure". `note` (printf-like, NULL: none) stands in place of the number of cases. */
__attribute__((format(printf, 3, 4))) void quern_check_tell(
	const check *, const check_tally *, const char *note, ...);

/* ---- instances ---- */
typedef struct check_instance {
	void *self;
	uint32_t dim;
	quern_tree *tree; /* keeps texts */
	quern_report *report;
	uint64_t setting;
	bool ready;
	char why[240]; /* why there is none */
} check_instance;

typedef enum { CHECK_READY, CHECK_REFUSED, CHECK_RUDE } check_outcome;

/* Setting 0: ordinary parameters; 1 .. 2 n: one of them at its lower or upper bound; above: any mixture. RUDE: init
 * fails without a word, or complains and goes on; REFUSED: the reason is in `why`. Finish in any case. */
check_outcome quern_check_instance_create(const check *, uint32_t dim, uint64_t setting, check_instance *);
/* The same setting with every parameter that contains a mass, such as N/m or J/kg, for masses that are `factor` times as
 * large. */
check_outcome quern_check_instance_scaled(
	const check *, const check_instance *, double factor, check_instance *);
void quern_check_instance_finish(const check *, check_instance *);
uint64_t quern_check_settings(const check *); /* how many single ones there are, setting 0 included */
/* A value of ordinary size in this unit: 1e-3 for m, 1500 for kg/m^3. */
double quern_check_ordinary(const check *, const char *unit);
bool quern_check_counts(const check *, const check_instance *, const quern_use *);

/* ---- kernels ---- */
/* Columns: all uses on both sides as tensors, and what a kind knows by a name. */
enum { CHECK_ROWS = QUERN_MOST_USES, CHECK_COLUMNS = 2 * 9 * CHECK_ROWS + 64, CHECK_NAMES = 20 };
typedef enum { CHECK_IN, CHECK_CHANGED, CHECK_OUT } check_role;

typedef struct check_column {
	const char *name;
	check_role role;
	bool integer;
	void *given, *found; /* n entries; IN: found is NULL */
} check_column;

typedef struct check_batch {
	uint32_t n, cap;
	void *at[CHECK_COLUMNS];
} check_batch;

typedef struct check_kernel {
	const check *check;
	const check_instance *instance;
	const char *name; /* of the function */
	const void *ops;
	uint32_t dim, n, hook, pass;
	quern_real dt;
	void (*call)(const struct check_kernel *, const check_batch *);
	check_column column[CHECK_COLUMNS];
	uint32_t n_columns;
	int at[CHECK_NAMES];                         /* first column of what the kind knows by a name; -1: NULL */
	int use[CHECK_ROWS], use_second[CHECK_ROWS]; /* first column of a row; -1: NULL */
	const void *more;                            /* the kind's own */
	uint32_t overrun, changed, environment, altered; /* faults so far, and the column of the last one */
	const char *culprit;
} check_kernel;

void quern_check_kernel_init(
	check_kernel *, const check *, const check_instance *, const char *name, uint32_t n);
void quern_check_kernel_finish(check_kernel *);
/* Adds `count` columns, zero so far; returns the first one, which is also noted as at[name]. */
int quern_check_add(check_kernel *, int name, const char *text, check_role, uint32_t count);
int quern_check_add_integers(check_kernel *, int name, const char *text, check_role);
/* Adds the rows of this hook that count; `optional` also those that are. `second`: contact's other body. */
void quern_check_add_uses(check_kernel *, uint32_t hook, bool optional, bool second);
quern_real *quern_check_given(const check_kernel *, int name, uint32_t component);
quern_real *quern_check_found(const check_kernel *, int name, uint32_t component);
void quern_check_fill(const check_kernel *, int name, uint32_t count, uint64_t key, double low, double high);
/* Row's columns in a batch. */
void quern_check_columns(
	const check_kernel *, const check_batch *, const int *use, quern_column out[CHECK_ROWS]);

static inline void *check_at(const check_kernel *k, const check_batch *b, int name, uint32_t component) {
	return k->at[name] < 0 ? NULL : b->at[k->at[name] + (int)component];
}
/* for (component) batch.member[component] = column */
#define CHECK_VECTOR(member, k, b, name, count)                                                              \
	for (uint32_t c_ = 0; c_ < (count); c_++) (member)[c_] = check_at(k, b, name, c_)

/* Calls it on all entities, `cut` at a time, on several workers where `pool` is given. */
void quern_check_run(check_kernel *, uint32_t cut, quern_pool *pool);
/* What was found becomes what is given, for columns that are changed in place: the next step. */
void quern_check_advance(check_kernel *);
/* The same for fields of the same name of another kernel: from one hook to the next. */
void quern_check_carry(const check_kernel *from, check_kernel *to);
bool quern_check_finite(const check_kernel *, const char **column);

static inline uint32_t check_axial(uint32_t dim) { return dim == 3 ? 3 : 1; }
static inline bool check_has_dim(const check *c, uint32_t dim) {
	return (!c->dimension || c->dimension == dim) && c->file->plugin.dims & (dim == 2 ? QUERN_2D : QUERN_3D);
}
uint32_t quern_check_components(uint8_t shape, uint32_t dim);

/* ---- kinds ---- */
typedef struct check_kind {
	const quern_kind *kind;
	/* A kernel on ordinary input; false if there is no such variant. NULL: the kind has none. */
	bool (*make)(const check *, const check_instance *, uint32_t variant, uint32_t n, check_kernel *);
	/* Whether an instance, whatever its parameters, gives sensible results; for kinds without `make`. */
	bool (*sane)(const check *, const check_instance *, const char **why);
	void (*law)(const check *); /* what must hold for this kind */
} check_kind;

extern const check_kind quern_check_contact, quern_check_material, quern_check_shape, quern_check_transfer,
	quern_check_coupling, quern_check_oracle, quern_check_packer, quern_check_body, quern_check_integrator,
	quern_check_neighbours, quern_check_observer;

void quern_check_table(const check *);
void quern_check_solver(const check *);
void quern_check_parameters(const check *, const check_kind *);
void quern_check_batches(const check *, const check_kind *);
