/* SPDX-License-Identifier: MIT */
/* quern/check.h - the kind `check`: a conformance test of one kind of plugins, which `quern check` finds and calls.
 *
 * A conformance test of the kind KIND is a plugin check.KIND.so (id "check.contact"): it lies where plugins of that
 * kind do, and whoever brings a kind brings it along. `quern check FILE.so` looks for the one of the plugin's kind and
 * calls it in child processes, a group of tests each. What all kinds have in common, tables, parameters, batches,
 * threads, guards, is the program's part; what must hold for this kind alone is `law`.
 *
 * A test works with instances of the plugin, whose parameters the program makes up from its rows, and with kernels: a
 * function of the plugin that is called with batches, together with the columns that it gets. Every call of a kernel
 * gets copies of its columns: cut as wished, padded with harmless lanes, with guards on both ends. What was tried is
 * summed up in tallies, a line of output each.
 *
 * Growth.  What is marked "the host's" comes from it by pointer and may be longer than a test knows. A tally stands in
 *          the test's own memory and never grows. */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Most names by which a test knows its columns; numbers below this. */
enum { QUERN_CHECK_NAMES = 32 };

struct quern_check_host;

/* The plugin that is checked. The host's. */
typedef struct quern_check {
	const struct quern_check_host *host;
	const char *id;         /* "contact.linear" */
	const void *ops;        /* its functions, as the test's own header of the kind has them */
	const quern_use *uses;  /* QUERN_END_USES-terminated, as the test's own abi.h has them */
	const quern_host *init; /* what its init gets: fail, publish, random, extension */
	uint32_t dims, instance_size;
} quern_check;

/* The plugin with parameters. The host's. */
typedef struct quern_check_instance {
	void *self;
	uint32_t dim, pad;
	uint64_t setting;
} quern_check_instance;

/* One line of output. { "action and reaction" } begins one; what follows is for the host. */
typedef struct quern_check_tally {
	const char *name;
	uint32_t tried, failed;
	double worst, allowed; /* of what was measured: the case that comes closest to its tolerance */
	char first[240];       /* what failed first */
	uint64_t later[4];
} quern_check_tally;

/* ---- kernels ---- */

typedef enum {
	QUERN_CHECK_IN,      /* must be left alone */
	QUERN_CHECK_CHANGED, /* changed in place */
	QUERN_CHECK_OUT      /* written, in all entries; holds NaN before */
} quern_check_role;

/* n entries, of quern_real or of int32_t. The host's. */
typedef struct quern_check_column {
	const char *name;
	void *given; /* what every call begins with; the test's to fill */
	void *found; /* what the last run has left; NULL of QUERN_CHECK_IN */
	uint32_t role;
	bool integer;
} quern_check_column;

/* What one call gets: copies of n entries, by number of the column. The host's. */
typedef struct quern_check_batch {
	uint32_t n, cap;
	void *const *at;
} quern_check_batch;

/* The host's; the second part is the test's to set. */
typedef struct quern_check_kernel {
	const quern_check *check;
	const struct quern_check_host *host;
	const quern_check_instance *instance;
	const void *self, *ops; /* the instance's; the plugin's functions */
	const char *name;       /* of the function */
	uint32_t dim, n, n_columns, hook;
	const int32_t *at; /* by name: number of its first column; -1: there is none */
	int32_t *use,
		*use_second; /* by row of `uses`: number of its first column; -1: the row does not count here */

	void (*call)(const struct quern_check_kernel *, const quern_check_batch *); /* calls the function */
	const void *more;                                                           /* anything, for `call` */
	quern_real dt;                                                              /* s; 1e-5 to begin with */
	uint32_t pass, pad;                                                         /* any number, for `call` */
} quern_check_kernel;

/* ==== services; the table grows at the end ==== */

typedef struct quern_check_host {
	uint32_t abi, pad;

	/* Says what is being called, for the sentence about a crash: "index, 2-D, while n = 7". `run` does so by itself. */
	void (*place)(const quern_check *, const char *fmt, ...) __attribute__((format(printf, 2, 3)));
	/* One case: good, or what is wrong. */
	void (*expect)(quern_check_tally *, bool good, const char *fmt, ...)
		__attribute__((format(printf, 3, 4)));
	/* One case: a number that must not exceed what is allowed, or what is wrong. */
	void (*measure)(quern_check_tally *, double value, double allowed, const char *fmt, ...)
		__attribute__((format(printf, 4, 5)));
	/* Prints the line. `note`, printf-like, stands in place of the number of cases; NULL: none. */
	void (*tell)(const quern_check *, const quern_check_tally *, const char *note, ...)
		__attribute__((format(printf, 3, 4)));
	/* Zeroed memory, to be given to free(). A test that there is none for ends here. */
	void *(*memory)(size_t n, size_t size);

	/* Uniform in [low, high), a function of its arguments. */
	double (*uniform)(uint64_t key, uint64_t counter, double low, double high);
	/* A unit vector; in 2-D the third component is zero. */
	void (*direction)(uint32_t dim, uint64_t key, uint64_t counter, double out[3]);
	/* A value of ordinary size in this unit: 1e-3 for m, 1500 for kg/m^3. */
	double (*ordinary)(const quern_check *, const char *unit);
	bool (*is_unit)(const quern_check *, const char *unit);
	/* To which power a unit contains the mass: 1 for N/m, 0 for m/s, -1 for 1/kg. */
	int (*mass_power)(const quern_check *, const char *unit);
	/* Calls body(arg, i, worker) once for every i < n, on four threads at once. */
	void (*parallel)(
		const quern_check *, uint32_t n, void (*body)(void *arg, uint32_t i, uint32_t worker), void *arg);

	/* Setting 0: ordinary parameters; 1 .. 2 n: one of them at its lower or upper bound; above: any mixture. NULL if
	 * the plugin refuses these parameters, or if this dimension is not its own or not to be tried. Destroy takes NULL. */
	quern_check_instance *(*instance_create)(const quern_check *, uint32_t dim, uint64_t setting);
	/* The same setting with every parameter that contains a mass, such as N/m or J/kg, for masses that are `factor`
	 * times as large. */
	quern_check_instance *(*instance_scaled)(
		const quern_check *, const quern_check_instance *, double factor);
	void (*instance_destroy)(quern_check_instance *);
	uint64_t (*settings)(const quern_check *); /* how many single ones there are, setting 0 included */
	/* Whether a row of `uses` counts with these parameters. */
	bool (*counts)(const quern_check *, const quern_check_instance *, const quern_use *);

	/* For n entries, without columns. Destroy takes NULL. */
	quern_check_kernel *(*kernel_create)(
		const quern_check *, const quern_check_instance *, const char *name, uint32_t n);
	void (*kernel_destroy)(quern_check_kernel *);
	/* Adds `count` columns of numbers, zero so far, or one of integers, known by `name`. */
	void (*add)(quern_check_kernel *, int name, const char *text, quern_check_role, uint32_t count);
	void (*add_integers)(quern_check_kernel *, int name, const char *text, quern_check_role);
	/* Adds the rows of `uses` of this hook that count, filled with values of ordinary size, or as new where they are
	 * changed; `optional`: also those that hang on other fields. */
	void (*add_uses)(quern_check_kernel *, uint32_t hook, bool optional);
	/* The same for one row, if it counts. `second`: among `use_second`, for kernels of pairs. */
	void (*add_use)(quern_check_kernel *, uint32_t row, bool second);
	/* Column by its number. */
	const quern_check_column *(*column)(const quern_check_kernel *, int32_t number);
	/* What is given to the columns of this name: uniform in [low, high). */
	void (*fill)(const quern_check_kernel *, int name, uint32_t count, uint64_t key, double low, double high);
	/* Calls it on all entries, `cut` at a time; `threads`: on four at once. */
	void (*run)(quern_check_kernel *, uint32_t cut, bool threads);
	/* What was found becomes what is given, for columns that are changed in place: the next step. */
	void (*advance)(quern_check_kernel *);
	/* The same for fields of the same name of another kernel: from one hook to the next. */
	void (*carry)(const quern_check_kernel *from, quern_check_kernel *to);
	/* Whether all that was found is; else the column that is not. */
	bool (*finite)(const quern_check_kernel *, const char **column);
	/* The rows' columns in a batch, by `use` or `use_second`: out[QUERN_MOST_USES]. */
	void (*columns)(
		const quern_check_kernel *, const quern_check_batch *, const int32_t *use, quern_column *out);
	/* The same of what is given, from entry `begin` on: for calls that need no copies. */
	void (*given_columns)(const quern_check_kernel *, uint32_t begin, const int32_t *use, quern_column *out);
	/* Of a field: of its shape, see quern_shape. */
	uint32_t (*components)(uint32_t shape, uint32_t dim);
} quern_check_host;

/* ==== the kind ==== */

typedef struct quern_check_ops {
	uint32_t size, pad;
	const quern_kind *kind; /* that is checked: &quern_contact_kind of quern/contact.h, or one's own */
	/* A kernel on ordinary input, which the host runs with many cuts and settings; NULL if there is no such variant:
	 * they are counted from 0. May be NULL. */
	quern_check_kernel *(*make)(
		const quern_check *, const quern_check_instance *, uint32_t variant, uint32_t n);
	/* Whether an instance, whatever its parameters, gives sensible results, or what does not; for kinds without
	 * `make`. May be NULL. */
	bool (*sane)(const quern_check *, const quern_check_instance *, const char **why);
	/* What must hold for this kind: tallies, each told once. */
	void (*law)(const quern_check *);
} quern_check_ops;

QUERN_KIND(check, quern_check_ops, "A conformance test of one kind.", QUERN_OPTIONALLY(quern_check_ops, make),
	QUERN_OPTIONALLY(quern_check_ops, sane), QUERN_ONE(quern_check_ops, law));

#ifdef __cplusplus
}
#endif

/* ==== what tests write often ==== */

QUERN_INLINE bool quern_check_has(const quern_check_kernel *k, int name) { return k->at[name] >= 0; }

/* Component of the columns of a name; NULL where there are none. */
QUERN_INLINE quern_real *quern_check_given(const quern_check_kernel *k, int name, uint32_t component) {
	if (k->at[name] < 0) return NULL;
	return (quern_real *)k->host->column(k, k->at[name] + (int32_t)component)->given;
}

QUERN_INLINE quern_real *quern_check_found(const quern_check_kernel *k, int name, uint32_t component) {
	if (k->at[name] < 0) return NULL;
	return (quern_real *)k->host->column(k, k->at[name] + (int32_t)component)->found;
}

/* The same in a batch. */
QUERN_INLINE quern_real *quern_check_at(
	const quern_check_kernel *k, const quern_check_batch *b, int name, uint32_t component) {
	return k->at[name] < 0 ? NULL : (quern_real *)b->at[k->at[name] + (int32_t)component];
}

QUERN_INLINE int32_t *quern_check_integers_at(
	const quern_check_kernel *k, const quern_check_batch *b, int name) {
	return k->at[name] < 0 ? NULL : (int32_t *)b->at[k->at[name]];
}

/* for (component) batch.member[component] = column */
#define QUERN_CHECK_VECTOR(member, k, b, name, count)                                                        \
	for (uint32_t c_ = 0; c_ < (count); c_++) (member)[c_] = quern_check_at(k, b, name, c_)

/* Components of an axial vector. */
QUERN_INLINE uint32_t quern_check_axial(uint32_t dim) { return dim == 3 ? 3 : 1; }
