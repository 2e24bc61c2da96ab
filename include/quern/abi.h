/* SPDX-License-Identifier: MIT */
/* quern/abi.h - what a plugin of any kind needs: parameters, fields, the host's services, its own table. C17 and C++17.
 *
 * A plugin is one shared object, KIND.NAME.so, that exports one constant table, quern_library_2. Nothing
 * runs when it is loaded: `quern list`, `describe`, `schema`, the scene reader and the tests of
 * `quern check` are all fed by the rows of that table.
 *
 * A kind is a name, with a header of its own (quern/contact.h, ...) that belongs to whoever calls plugins of that kind. The
 * program itself calls two kinds, `solver` (quern/solver.h) and `observer` (quern/observer.h); all others are called by
 * solvers, which describe them in their tables, and a solver may bring a kind that nobody has heard of.
 *
 * Threads.  [setup]  main thread, once per instance; may allocate, may fail through host->fail.
 *           [stage]  main thread, between parallel regions; may call every host service.
 *           [batch]  any worker, concurrently, on disjoint batches; `self` is const; no allocation, lock,
 *                    I/O, thread, errno or floating-point flag; exp, log, pow and trigonometry come from
 *                    quern/math.h, since libm's results differ between processors.
 *           [region] one worker per region; like [batch], but may call the services in the job it got.
 * State.    `self` is read-only after init. All that evolves is in fields, so it is checkpointed, sorted,
 *           carried over and written out without the plugin's help.
 * Batches.  n entities, struct of arrays, one column per component; 0 < n <= cap. Lanes from n up to the next multiple of
 *           QUERN_LANES may be read, and none is written: what stands there is harmless, or the next entities of the set. Columns
 *           that are made for a call are 64-byte aligned, those of a set begin anywhere. A result never depends on how entities
 *           are cut into batches.
 * Units.    SI. A 2-D scene is a slab one metre thick: kg, N, Pa and kg/m^3 mean the same in both
 *           dimensions. 2-D vectors have two components, axial ones (spin, torque, slip) one.
 * Growth.   Structs grow at the end only. What a plugin fills carries its size, or its owner carries a stride, and
 *           the host takes an older, shorter one: what it does not know is zero. What the host fills and hands over by
 *           pointer needs none, since a host refuses a plugin whose minor version is newer than its own; what it
 *           returns by value (set views) never grows. With kinds it is the same between a solver and what sits in its
 *           slots: a batch grows only together with the table of the kind, so that a table which is longer than its
 *           caller's tells of a newer header, and is refused. A breaking change renames the exported symbol.
 * Looks.    The host looks at all tables when it loads a plugin, and refuses by one sentence what cannot be
 *           true: rows without an end, members outside the instance, a function missing for a dimension. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define QUERN_ABI_MAJOR 2u
#define QUERN_ABI_MINOR 1u
#define QUERN_ABI (QUERN_ABI_MAJOR << 16 | QUERN_ABI_MINOR)
#define QUERN_LANES 8u

typedef double quern_real;

/* A struct's value in an expression: QUERN_VALUE(quern_vec, 1, 0, 0). Compound literals are no C++. */
#ifdef __cplusplus
#define QUERN_VALUE(type, ...) (type { __VA_ARGS__ })
#else
#define QUERN_VALUE(type, ...) ((type) { __VA_ARGS__ })
#endif

typedef enum {
	QUERN_OK,
	QUERN_E_PARAM,   /* a scene's value cannot be used */
	QUERN_E_FIELD,   /* a field is missing or of another shape */
	QUERN_E_NUMERIC, /* not a number, unstable, lost mass */
	QUERN_E_MEMORY,
	QUERN_E_IO
} quern_status;

enum { QUERN_2D = 1, QUERN_3D = 2 };

/* ==== parameters ==== */

typedef enum {
	QUERN_T_REAL = 1, /* quern_real */
	QUERN_T_INT,      /* int32_t; with `choices` the scene gives a name and the member gets its index */
	QUERN_T_BOOL,     /* bool */
	QUERN_T_TEXT,     /* const char *, owned by the host for the length of the run */
	QUERN_T_VECTOR,   /* quern_real[3]; the scene gives one number per dimension, the rest are zero */
	/* quern_list of structs described by `rows`; where that is one vector, or since 2.1 one value, the scene may give it
	 * bare */
	QUERN_T_LIST
} quern_type;

enum {
	QUERN_REQUIRED = 1,
	QUERN_MIN_OPEN = 2, /* the minimum itself is not allowed */
	QUERN_MAX_OPEN = 4,
	QUERN_MAYBE = 8,     /* may be left out: the member is then NaN (every component), INT32_MIN or NULL */
	QUERN_PLANAR = 16,   /* `planar` is the default in 2-D, `def` in 3-D */
	QUERN_ADVANCED = 32, /* listed apart by `describe` */
	QUERN_FILE = 64,     /* T_TEXT: a file that must exist; relative to the scene's folder */
	QUERN_ONCE =
		128 /* since 2.1: it counts before the first step alone: stages of a scene cannot change it */
};

/* One row feeds the scene reader, `describe`, the JSON Schema, the resolved scene and the fuzzer. */
typedef struct quern_param {
	const char *name;           /* scene key; a dot opens a map: "radius.mean" */
	const char *unit, *doc;     /* SI: "Pa", "kg/m^3", "1" */
	const char *const *choices; /* NULL-terminated, or NULL */
	const char
		*text; /* default of a T_TEXT; of a T_INT, a word: "body" lets the scene say a name instead of the
	                     number, where somebody has published that number as "body.NAME"; since 2.1, of a T_LIST, the
	                     T_TEXT row of its items that takes the keys where the scene gives a map instead:
	                     "name" takes {sand: {...}, steel: {...}} for [{name: sand, ...}, {name: steel, ...}] */
	const char *from; /* default taken from this published quantity, see publish(); where nobody publishes it,
	                     `def` if that is not 0, else the scene must give the value, or may leave out a MAYBE */
	const struct quern_param *rows; /* T_LIST: the rows of one item */
	quern_real def, planar;
	quern_real min, max;        /* inclusive unless *_OPEN; min == max: unbounded. T_LIST: how many items */
	uint32_t offset, item_size; /* into the instance; T_LIST: bytes of one item */
	uint8_t type, flags;
	uint16_t pad;
	const char *
		unless; /* since 2.1: another key beside which this one must not stand, and which makes REQUIRED ask for nothing */
} quern_param;

typedef struct quern_list {
	void *items;
	uint32_t n, item_size;
} quern_list;

#ifndef __cplusplus
#define QUERN_TYPE_OF(T, m)                                                                                  \
	_Generic(((T *)0)->m,                                                                          \
	    quern_real: QUERN_T_REAL,                                                                  \
	    int32_t: QUERN_T_INT,                                                                      \
	    bool: QUERN_T_BOOL,                                                                        \
	    const char *: QUERN_T_TEXT,                                                                \
	    quern_real *: QUERN_T_VECTOR,                                                              \
	    quern_list: QUERN_T_LIST)
/* A row for the member of the same name; the variadic part starts with the doc text and goes on with
 * designated members, .min = 0 and so on. */
#define QUERN_PARAM(T, m, unit_, ...)                                                                        \
	{                                                                                                        \
		.name = #m, .unit = unit_, .offset = (uint32_t)offsetof(T, m), .type = QUERN_TYPE_OF(T, m),          \
		.doc = __VA_ARGS__                                                                                   \
	}
/* The same under another scene key: QUERN_PARAM_AS(grains, mean, "radius.mean", "m", "Mean radius."). */
#define QUERN_PARAM_AS(T, m, name_, unit_, ...)                                                              \
	{                                                                                                        \
		.name = name_, .unit = unit_, .offset = (uint32_t)offsetof(T, m), .type = QUERN_TYPE_OF(T, m),       \
		.doc = __VA_ARGS__                                                                                   \
	}
#define QUERN_END_PARAMS                                                                                     \
	{ .name = NULL }
#define QUERN_END_USES                                                                                       \
	{ .field = NULL }
/* A table of uses and the numbers of its rows, from one list: LIST(X) is a macro of lines
 *   X(NAME, field, unit, access, shape, and designated members as wanted)
 * QUERN_USE_ENUM(LIST); makes NAME the number of its row, and LIST_ROWS how many there are; QUERN_USE_ENUM_FROM counts
 * on from the rows of another list. QUERN_USE_ROWS(LIST) is what the table consists of. */
#define QUERN_USE_ENUM(LIST) enum { LIST(QUERN_USE_NAME) LIST##_ROWS }
#define QUERN_USE_ENUM_FROM(FIRST, LIST) enum { LIST##_BEFORE = (FIRST)-1, LIST(QUERN_USE_NAME) LIST##_ROWS }
#define QUERN_USE_ROWS(LIST)                                                                                 \
	{ LIST(QUERN_USE_ROW) QUERN_END_USES }
#define QUERN_USE_NAME(name, ...) name,
#define QUERN_USE_ROW(name, ...) { QUERN_USE_MEMBERS(__VA_ARGS__) },
#define QUERN_USE_MEMBERS(field_, unit_, access_, ...)                                                       \
	.field = field_, .unit = unit_, .access = access_, .shape = __VA_ARGS__
#endif

/* ==== fields ==== */

typedef enum { QUERN_READ = 1, QUERN_WRITE, QUERN_UPDATE, QUERN_ADD } quern_access;

typedef enum {
	QUERN_SCALAR = 1, /* 1 component in 2-D, 1 in 3-D */
	QUERN_VECTOR,     /* 2, 3 */
	QUERN_AXIAL,      /* 1, 3 */
	QUERN_SYMMETRIC,  /* 3, 6: xx yy xy | xx yy zz xy yz xz */
	QUERN_TENSOR,     /* 4, 9: row-major */
	QUERN_INDEX,      /* 1 int32_t */
	QUERN_ID          /* 1 int64_t, unique for ever within its set; the host numbers new entries */
} quern_shape;

#define QUERN_NO_TARGET (-1) /* an INDEX that points at nothing */

enum {
	QUERN_OPTIONAL = 1,  /* attaches to the field if somebody else needs it; its column is NULL otherwise */
	QUERN_OTHERS = 2,    /* this READ looks at other entities: if its stage changes the field too, the
	                       field is kept twice and the stage writes every entry of the new copy */
	QUERN_BEFORE = 4,    /* this READ wants the value from before this phase's changes */
	QUERN_SHOWN = 8,     /* in every frame, asked for or not */
	QUERN_WANTED = 16,   /* makes the field exist if anybody in the scene can write it; NULL otherwise */
	QUERN_RELEASED = 32, /* nothing is changed through this use while settling */
	QUERN_EXISTS =
		64 /* since 2.1: this READ only makes the field exist; its column is NULL, and nothing is gathered */
};

/* Since 2.1: what becomes of a field where an entry is parted into two, or two are joined to one, by quern_host.remap and give. An entry
 * that is new has `initial`, and what an entry that goes has not given away goes with it. Where nobody states a rule, entries keep. */
typedef enum {
	QUERN_KEEPS =
		1,      /* a part has what the whole had; of joined ones that stays which the one that stays had */
	QUERN_SUMS, /* an amount, such as a heat in J: parts share it out, joined ones add up */
	QUERN_MEANS, /* per mass, such as a strain or a temperature: a part has what the whole had, joined ones the mean by mass */
	QUERN_OWN /* of the entry itself, such as its age: a part begins with `initial`, and of joined ones the one that stays keeps its own */
} quern_rule;

/* One use of one field by one plugin. A field exists if and only if a counting, non-optional use names
 * it or the scene writes it out. From the uses follow the order of stages, what is allocated, what is
 * checkpointed (a field that is read or updated before it is written in a step), and what conflicts. */
typedef struct quern_use {
	const char *field; /* "SET.NAME"; set "particle" is resolved by the slot the plugin sits in */
	const char *unit, *doc;
	const char *when;   /* parameter of this plugin: the row counts only if that is not zero */
	const char *with;   /* another field: the row counts only if that one exists */
	const char *target; /* INDEX: the set it points into; rewritten when that set is reordered, and
	                           an entry whose target is gone is dropped. A field that may hold
	                           QUERN_NO_TARGET, which is left as it is, has it as `initial` */
	quern_real initial; /* of a new entry; diagonal of SYMMETRIC and TENSOR */
	uint8_t access, shape, flags;
	uint8_t hook; /* which function of the kind touches it (0: the main one) */
	uint8_t rule; /* since 2.1: quern_rule, stated by who changes the field, and by nobody else another one */
} quern_use;

/* Pointers to the components of a field, by component; NULL where the field does not exist. */
typedef union quern_column {
	quern_real *real[9];
	int32_t *index;
	int64_t *id;
} quern_column;

/* ==== host services; the table grows at the end ==== */

typedef struct quern_err quern_err; /* opaque: knows file, line and column of every key */
typedef struct quern_run quern_run; /* opaque: the running scene */
struct quern_setup;

typedef struct quern_set_view {
	uint32_t n, cap;       /* entries; entries that fit before columns move */
	uint32_t n_blocks;     /* partition of [0, n): block b is [block[b], block[b + 1]) */
	const uint32_t *block; /* NULL if the set has no partition */
} quern_set_view;

/* Since 2.1: how a set is cut. Its results may depend on the order of the blocks' places and on that of the entries within one,
 * never on the numbers that blocks and entries have: the same scene then has the same bits however its sets are cut, be it among
 * machines. So whoever adds up one entry after the other, or lets the first one win, goes through entries by quern_nth(entry, q) and
 * through blocks by quern_nth(by_place, q). Entries from `owned` on are copies of what another process owns: they are there to be
 * looked at, and count in no sum. Today there is one process, and it owns all. */
typedef struct quern_parts {
	uint32_t size, n, owned, n_blocks;
	const uint32_t *block;    /* as in quern_set_view */
	const uint32_t *by_place; /* blocks in the order of their places; NULL: in their own */
	const uint32_t *entry;    /* entries in the order of their blocks' places; NULL: in their own */
} quern_parts;

/* The q-th of what stands in an order; NULL: in its own. */
#define quern_nth(order, q) ((order) ? (order)[q] : (q))

/* The sparse grid: blocks of `edge` cells per axis (8 in 2-D, 4 in 3-D: 64 cells in both), allocated where
 * there is material. Block at[b] holds the cells, and the nodes at their lower corners, from edge * at[b] on.
 * Entry b * 64 + k of the set "cell" and of every row set is cell or node k of block b, x fastest. */
typedef struct quern_grid_view {
	quern_real cell, lower[3]; /* m; lower corner of the domain, a node */
	uint32_t dim, edge, n_blocks;
	uint32_t span;      /* nodes per axis of a tile: edge + 4, from node edge * at[b] - 1 on */
	uint32_t tile_size; /* span^dim */
	int32_t cells[3];   /* of the domain, per axis: at most 2^22, and fewer than 2^31 in all */
	bool periodic[3];
	const int32_t (*at)[3]; /* in the order of places: by z, then y, then x; unless `by_place` says another */
	const uint8_t *asked;   /* 1: by the last cover(); 0: a neighbour of such a block */
	const int32_t *tile;    /* [n_blocks][tile_size]: entry of each tile node, -1 where there is none */
	uint32_t n_colours;
	const uint32_t *colour; /* colour[c] .. colour[c + 1] into by_colour: no two tiles share a node */
	const uint32_t *by_colour;
	const uint32_t *by_place; /* since 2.1: blocks in the order of their places; NULL: in their own */
} quern_grid_view;

typedef struct quern_host {
	uint32_t abi;
	/* [setup] Reports one fault of parameter `param` (NULL: of the plugin), with its place in the scene;
	 * returns the status it was given, so that `return host->fail(...)` reads well. Never ends the program. */
	quern_status (*fail)(quern_err *, quern_status, const char *param, const char *fmt, ...)
		__attribute__((format(printf, 4, 5)));
	/* [setup] Offers a number in SI under a name, "grain.diameter": what is read later takes it, a row with `from`
	 * as its default, a whole number with a `text` under the word behind the dot. Of several under one name the
	 * first counts. The name is copied. */
	void (*publish)(const struct quern_setup *, const char *name, const char *unit, quern_real value);
	/* [any] Philox 4x32-10: two uniforms in [0, 1) from (seed, stream, key, counter), whatever the thread or order. */
	void (*random)(uint64_t stream, uint64_t key, uint64_t counter, quern_real out[2]);
	/* [stage] level 0: log file only, 1: terminal too, 2: a warning; since 2.1, -1: log file only, and only with
	 * `run --verbose`, for what is said again and again */
	void (*log)(quern_run *, int level, const char *fmt, ...) __attribute__((format(printf, 3, 4)));
	/* [stage] Calls body(arg, i, worker) once for every i < n, on all workers; returns when all are done. A body that
	 * calls it again ends the program. */
	void (*parallel)(
		quern_run *, uint32_t n, void (*body)(void *arg, uint32_t i, uint32_t worker), void *arg);
	uint32_t (*workers)(quern_run *);
	/* [stage, or this worker's own in a parallel body] 64-byte aligned, kept until asked for more. NULL only if memory is gone: a body
	 * returns then, and the run ends after the stage. */
	void *(*scratch)(quern_run *, uint32_t worker, size_t bytes);
	/* [stage] Zeroed, 64-byte aligned memory until the stage returns, also of 0 bytes. NULL only if memory is
	 * gone: return QUERN_E_MEMORY. */
	void *(*memory)(quern_run *, size_t bytes);
	/* [stage] Sum in a fixed binary tree over the index: the same for any number of threads. Of a set, see sum_set. */
	quern_real (*sum)(quern_run *, size_t n, const quern_real *);
	/* [stage] Ends the run with a message that names set and entity (id < 0: none); returns its status. With
	 * QUERN_E_PARAM, the scene is at fault: `set` then names a parameter of the section, as in fail(). */
	quern_status (*stop)(quern_run *, quern_status, const char *set, int64_t id, const char *fmt, ...)
		__attribute__((format(printf, 5, 6)));
	quern_set_view (*set)(quern_run *, const char *name); /* [stage] n = 0 if there is none */
	/* [stage] The one structural change: new entry i is old entry from[i]; fresh if from[i] == -1; and below that a
	 * copy of old entry -2 - from[i], with an ID of its own; of what that has by QUERN_SUMS it gets nothing yet (give), of
	 * QUERN_OWN its initial value. New IDs count on in the order of `from`: list what is new by
	 * when and where it appears. Carries every field of the set, rewrites every INDEX
	 * that points into it, drops entries whose target is gone, and refreshes every column pointer the host handed
	 * out. `block` (n_blocks + 1 entries) is copied. */
	quern_status (*remap)(quern_run *, const char *set, uint32_t n, const int32_t *from, uint32_t n_blocks,
		const uint32_t *block);
	const quern_grid_view *(*grid)(quern_run *); /* [stage] valid until cover() */
	/* [stage] Allocates exactly these blocks of the grid and their neighbours; cells keep their fields. */
	quern_status (*cover)(quern_run *, uint32_t n, const int32_t (*block)[3]);
	const void *(*extension)(const char *id); /* [any] NULL if unknown */
	/* [stage] Whether this section takes part in the run. A field or a set says nothing about that, since a scene may
	 * have it made only to be written out. */
	bool (*has)(quern_run *, const char *section);
	/* [setup] The same while the scene is read: sections that come later count too. */
	bool (*keeps)(const struct quern_setup *, const char *section);
	const quern_parts *(*parts)(quern_run *,
		const char *set); /* since 2.1 [stage] valid until the set changes; NULL if there is none */
	/* since 2.1 [stage] The order of the places of a set's blocks, until it is cut anew: by_place[0] comes first. Nobody has to
	 * say it of blocks that are in order, or of cells. NULL: in their own. */
	quern_status (*arrange)(quern_run *, const char *set, const uint32_t *by_place);
	/* since 2.1 [stage] Sum of a number per entry of a set, of those that are owned: in a fixed tree over each block, and then
	 * over blocks in the order of their places. */
	quern_real (*sum_set)(quern_run *, const char *set, const quern_real *);
	/* since 2.1 [stage] Entry `from` of a set gives to entry `to` what its fields' rules say: of amounts the share `part`, which
	 * it loses; means become those of both, in which it counts for `share`, the mass given over that of both then. To
	 * QUERN_NO_TARGET: what it gives leaves the set; with a `part` below zero it gets as much, as when it takes mass that is
	 * like its own from elsewhere. What a solver itself sees to, such as mass and velocity, it states to be kept. */
	void (*give)(quern_run *, const char *set, uint32_t from, int32_t to, quern_real part, quern_real share);
	/* since 2.1 [stage] In the set-up: whether a field holds what another run's state had of it, or whether that run had
	 * a plugin of this ID with the same parameters; false where nobody can tell, as of a frame's plugins. See quern_solver_ops.from. */
	bool (*taken)(quern_run *, const char *name);
} quern_host;

typedef struct quern_setup {
	uint32_t dim, lanes;
	uint64_t stream;       /* for host->random: this instance's own */
	quern_real gravity[3]; /* m/s^2 */
	quern_real lower[3], upper[3];
	bool periodic[3];
	const quern_host *host;
	void *scene;     /* opaque */
	bool later;      /* since 2.1: the values of one of the scene's `stages`, which come after the release */
	bool open[2][3]; /* since 2.1: faces of the domain that let material out: lower, upper; by axis */
} quern_setup;

/* ==== plugin and library ==== */

typedef struct quern_plugin {
	uint32_t size, revision;        /* revision: the author's count of changes to results; named on resume */
	uint32_t dims, instance_size;   /* QUERN_2D | QUERN_3D; bytes */
	const char *id;                 /* "contact.linear": kind and name; the file is contact.linear.so */
	const char *brief, *doc, *cite; /* one line; a paragraph; the source of the formulas */
	const quern_param *params;      /* QUERN_END_PARAMS-terminated */
	const quern_use *uses;          /* QUERN_END_USES-terminated */
	/* [setup] derived constants and cross-checks; params are filled in already. May be NULL. */
	quern_status (*init)(void *self, const quern_setup *, quern_err *);
	void (*finish)(void *self); /* [setup] frees what init took; may be NULL */
	const void *ops;            /* quern_contact_ops, ... by kind: begins with its size in bytes */
} quern_plugin;

typedef struct quern_library {
	uint32_t size, abi, real_size, lanes, param_size, use_size;
	const char *name, *version, *license, *build;
	const quern_plugin *plugin;
} quern_library;

#define QUERN_LIBRARY_SYMBOL "quern_library_2"
#define QUERN_EXPORT __attribute__((visibility("default")))
#define QUERN_LIBRARY(plugin_, version_, license_)                                                           \
	QUERN_EXPORT extern const quern_library quern_library_2;                                                 \
	const quern_library quern_library_2 = { sizeof(quern_library), QUERN_ABI, sizeof(quern_real),            \
		QUERN_LANES, sizeof(quern_param), sizeof(quern_use), __FILE__, version_, license_, __VERSION__,      \
		&(plugin_) }

/* Most rows that the uses of one plugin in a slot may have, whatever its kind; a plugin with more is refused when it is
 * loaded. Whoever calls plugins sizes its arrays of columns by it. The rows of a solver's stages are the solver's own. */
enum { QUERN_MOST_USES = 32 };

/* A number that comes out: of an observer in series.csv, of a solver's account in summary.json. */
typedef enum { QUERN_SUM, QUERN_MAX, QUERN_MIN } quern_combine;
typedef struct quern_output {
	const char *name, *unit, *doc; /* the name is a word */
	uint32_t combine, pad;         /* how parts of it make a whole: quern_combine */
} quern_output;

/* ==== kinds ==== */

/* A function of a kind's table: by its place, and whether a plugin must have it. */
typedef struct quern_function {
	const char *name;
	uint32_t offset;
	uint8_t dim, required; /* dim 2, 3: for plugins that have this dimension; 0: for all */
	uint16_t pad;
} quern_function;

typedef struct quern_kind {
	uint32_t size, function_size;    /* of this struct and of one of `functions` */
	const char *name, *doc;          /* "contact": a word */
	uint32_t ops_size, pad;          /* of the kind's table as its header, and so the caller, knows it */
	const quern_function *functions; /* QUERN_END_FUNCTIONS-terminated */
} quern_kind;

/* Rows of functions for the member m of the table T: a pair by dimension that must be there, or need not; one for both. */
#define QUERN_FUNCTION_(T, m, at, dim, required)                                                             \
	{ #m, (uint32_t)(offsetof(T, m) + (at) * sizeof(void (*)(void))), dim, required, 0 }
#define QUERN_EACH(T, m) QUERN_FUNCTION_(T, m, 0, 2, 1), QUERN_FUNCTION_(T, m, 1, 3, 1)
#define QUERN_EITHER(T, m) QUERN_FUNCTION_(T, m, 0, 2, 0), QUERN_FUNCTION_(T, m, 1, 3, 0)
#define QUERN_ONE(T, m) QUERN_FUNCTION_(T, m, 0, 0, 1)
#define QUERN_OPTIONALLY(T, m) QUERN_FUNCTION_(T, m, 0, 0, 0)
#define QUERN_END_FUNCTIONS                                                                                  \
	{ NULL, 0, 0, 0, 0 }
/* A kind NAME whose table is the struct T, and its rows of functions. */
#define QUERN_KIND(NAME, T, doc_, ...)                                                                       \
	static const quern_function quern_##NAME##_functions[] = { __VA_ARGS__, QUERN_END_FUNCTIONS };           \
	static const quern_kind quern_##NAME##_kind = { sizeof(quern_kind), sizeof(quern_function), #NAME, doc_, \
		sizeof(T), 0, quern_##NAME##_functions }

/* ==== kernels ==== */

#define QUERN_SIMD _Pragma("omp simd")
#define QUERN_INLINE static inline __attribute__((always_inline))

#ifdef __cplusplus
}
#endif
