/* quern/abi.h - everything a plugin needs, and the only promise Quern makes to it. C17 and C++17.
 *
 * A plugin is one shared object, KIND.NAME.so, that exports one constant table, quern_library_1. Nothing
 * runs when it is loaded: `quern list`, `describe`, `schema`, the scene reader and the tests of
 * `quern check` are all fed by the rows of that table.
 *
 * Threads.  [setup]  main thread, once per instance; may allocate, may fail through host->fail.
 *           [stage]  main thread, between parallel regions; may call every host service.
 *           [batch]  any worker, concurrently, on disjoint batches; `self` is const; no allocation, lock,
 *                    I/O, thread, errno or floating-point flag; exp, log, pow and trigonometry come from
 *                    quern/math.h, since libm's results differ between processors.
 *           [region] one worker per region; like [batch], but may call the services in the job it got.
 * State.    `self` is read-only after init. All that evolves is in fields, so it is checkpointed, sorted,
 *           carried over and written out without the plugin's help.
 * Batches.  n entities, struct of arrays, one column per component, 64-byte aligned and padded to
 *           QUERN_LANES; 0 < n <= cap. Lanes in [n, cap) hold harmless values: a kernel may compute them,
 *           nobody relies on them. A result never depends on how entities are cut into batches.
 * Units.    SI. A 2-D scene is a slab one metre thick: kg, N, Pa and kg/m^3 mean the same in both
 *           dimensions. 2-D vectors have two components, axial ones (spin, torque, slip) one.
 * Growth.   Structs grow at the end only. What a plugin fills carries its size (or a stride in
 *           quern_library); what the host fills needs none, since a host refuses a plugin whose minor
 *           version is newer than its own. A breaking change renames the exported symbol. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define QUERN_ABI_MAJOR 1u
#define QUERN_ABI_MINOR 0u
#define QUERN_ABI (QUERN_ABI_MAJOR << 16 | QUERN_ABI_MINOR)
#define QUERN_LANES 8u

typedef double quern_real;

typedef enum {
	QUERN_OK,
	QUERN_E_PARAM,   /* a scene's value cannot be used */
	QUERN_E_FIELD,   /* a field is missing or of another shape */
	QUERN_E_NUMERIC, /* not a number, unstable, lost mass */
	QUERN_E_MEMORY,
	QUERN_E_IO
} quern_status;

typedef enum {
	QUERN_SOLVER = 1,
	QUERN_CONTACT,
	QUERN_NEIGHBOURS,
	QUERN_INTEGRATOR,
	QUERN_BODY,
	QUERN_MATERIAL,
	QUERN_SHAPE,
	QUERN_TRANSFER,
	QUERN_COUPLING,
	QUERN_ORACLE,
	QUERN_PACKER,
	QUERN_OBSERVER,
	QUERN_KINDS
} quern_kind;

enum { QUERN_2D = 1, QUERN_3D = 2 };

/* ==== parameters ==== */

typedef enum {
	QUERN_T_REAL = 1, /* quern_real */
	QUERN_T_INT,      /* int32_t; with `choices` the scene gives a name and the member gets its index */
	QUERN_T_BOOL,     /* bool */
	QUERN_T_TEXT,     /* const char *, owned by the host for the length of the run */
	QUERN_T_VECTOR,   /* quern_real[3]; the scene gives one number per dimension, the rest are zero */
	QUERN_T_LIST      /* quern_list of structs described by `rows` */
} quern_type;

enum {
	QUERN_REQUIRED = 1,
	QUERN_MIN_OPEN = 2, /* the minimum itself is not allowed */
	QUERN_MAX_OPEN = 4,
	QUERN_MAYBE = 8,     /* may be left out: the member is then NaN (every component), INT32_MIN or NULL */
	QUERN_PLANAR = 16,   /* `planar` is the default in 2-D, `def` in 3-D */
	QUERN_ADVANCED = 32, /* listed apart by `describe` */
	QUERN_FILE = 64      /* T_TEXT: a file that must exist; relative to the scene's folder */
};

/* One row feeds the scene reader, `describe`, the JSON Schema, the resolved scene and the fuzzer. */
typedef struct quern_param {
	const char *name;               /* scene key; a dot opens a map: "radius.mean" */
	const char *unit, *doc;         /* SI: "Pa", "kg/m^3", "1" */
	const char *const *choices;     /* NULL-terminated, or NULL */
	const char *text;               /* default of a T_TEXT */
	const char *from;               /* default taken from this published quantity, see publish() */
	const struct quern_param *rows; /* T_LIST: the rows of one item */
	quern_real def, planar;
	quern_real min, max;        /* inclusive unless *_OPEN; min == max: unbounded */
	uint32_t offset, item_size; /* into the instance; T_LIST: bytes of one item */
	uint8_t type, flags;
	uint16_t pad;
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

enum {
	QUERN_OPTIONAL = 1, /* attaches to the field if somebody else needs it; its column is NULL otherwise */
	QUERN_OTHERS = 2,   /* this READ looks at other entities: if its stage changes the field too, the
	                       field is kept twice and the stage writes every entry of the new copy */
	QUERN_BEFORE = 4,   /* this READ wants the value from before this phase's changes */
	QUERN_SHOWN = 8,    /* in every frame, asked for or not */
	QUERN_WANTED = 16   /* makes the field exist if anybody in the scene can write it; NULL otherwise */
};

/* One use of one field by one plugin. A field exists if and only if a counting, non-optional use names
 * it or the scene writes it out. From the uses follow the order of stages, what is allocated, what is
 * checkpointed (a field that is read or updated before it is written in a step), and what conflicts. */
typedef struct quern_use {
	const char *field; /* "SET.NAME"; set "particle" is resolved by the slot the plugin sits in */
	const char *unit, *doc;
	const char *when;   /* parameter of this plugin: the row counts only if that is not zero */
	const char *with;   /* another field: the row counts only if that one exists */
	const char *target; /* INDEX: the set it points into; rewritten when that set is reordered, and
	                           an entry whose target is gone is dropped */
	quern_real initial; /* of a new entry; diagonal of SYMMETRIC and TENSOR */
	uint8_t access, shape, flags;
	uint8_t hook; /* which function of the kind touches it (0: the main one) */
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

/* The sparse grid: blocks of `edge` cells per axis (8 in 2-D, 4 in 3-D: 64 cells in both), allocated where
 * there is material. Block at[b] holds the cells, and the nodes at their lower corners, from edge * at[b] on.
 * Entry b * 64 + k of the set "cell" and of every row set is cell or node k of block b, x fastest. */
typedef struct quern_grid_view {
	quern_real cell, lower[3]; /* m; lower corner of the domain, a node */
	uint32_t dim, edge, n_blocks;
	uint32_t span;      /* nodes per axis of a tile: edge + 4, from node edge * at[b] - 1 on */
	uint32_t tile_size; /* span^dim */
	int32_t cells[3];   /* of the domain, per axis */
	bool periodic[3];
	const int32_t (*at)[3]; /* sorted */
	const uint8_t *asked;   /* 1: by the last cover(); 0: a neighbour of such a block */
	const int32_t *tile;    /* [n_blocks][tile_size]: entry of each tile node, -1 where there is none */
	uint32_t n_colours;
	const uint32_t *colour; /* colour[c] .. colour[c + 1] into by_colour: no two tiles share a node */
	const uint32_t *by_colour;
} quern_grid_view;

typedef struct quern_host {
	uint32_t abi;
	/* [setup] Reports one fault of parameter `param` (NULL: of the plugin), with its place in the scene;
	 * returns the status it was given, so that `return host->fail(...)` reads well. Never ends the program. */
	quern_status (*fail)(quern_err *, quern_status, const char *param, const char *fmt, ...)
		__attribute__((format(printf, 4, 5)));
	/* [setup] Offers a number that rows with `from` may take as their default: "grain.diameter". */
	void (*publish)(const struct quern_setup *, const char *name, const char *unit, quern_real value);
	/* [any] Philox 4x32-10: two uniforms in [0, 1) from (seed, stream, key, counter), whatever the thread or order. */
	void (*random)(uint64_t stream, uint64_t key, uint64_t counter, quern_real out[2]);
	/* [stage] level 0: log file only, 1: terminal too, 2: a warning */
	void (*log)(quern_run *, int level, const char *fmt, ...) __attribute__((format(printf, 3, 4)));
	/* [stage] Calls body(arg, i, worker) once for every i < n, on all workers; returns when all are done. */
	void (*parallel)(
		quern_run *, uint32_t n, void (*body)(void *arg, uint32_t i, uint32_t worker), void *arg);
	uint32_t (*workers)(quern_run *);
	/* [stage, or this worker's own in a parallel body] 64-byte aligned, kept until asked for more. */
	void *(*scratch)(quern_run *, uint32_t worker, size_t bytes);
	/* [stage] Zeroed memory until the stage returns. NULL if there is none: return QUERN_E_MEMORY. */
	void *(*memory)(quern_run *, size_t bytes);
	/* [stage] Sum in a fixed binary tree over the index: the same for any number of threads. */
	quern_real (*sum)(quern_run *, size_t n, const quern_real *);
	/* [stage] Ends the run with a message that names set and entity (id < 0: none); returns its status. */
	quern_status (*stop)(quern_run *, quern_status, const char *set, int64_t id, const char *fmt, ...)
		__attribute__((format(printf, 5, 6)));
	quern_set_view (*set)(quern_run *, const char *name); /* [stage] n = 0 if there is none */
	/* [stage] The one structural change: new entry i is old entry from[i], or fresh if from[i] < 0. Carries
	 * every field of the set, rewrites every INDEX that points into it, drops entries whose target is gone,
	 * and refreshes every column pointer the host handed out. `block` (n_blocks + 1 entries) is copied. */
	quern_status (*remap)(quern_run *, const char *set, uint32_t n, const int32_t *from, uint32_t n_blocks,
		const uint32_t *block);
	const quern_grid_view *(*grid)(quern_run *); /* [stage] valid until cover() */
	/* [stage] Allocates exactly these blocks of the grid and their neighbours; cells keep their fields. */
	quern_status (*cover)(quern_run *, uint32_t n, const int32_t (*block)[3]);
	const void *(*extension)(const char *id); /* [any] NULL if unknown */
} quern_host;

typedef struct quern_setup {
	uint32_t dim, lanes;
	uint64_t stream;       /* for host->random: this instance's own */
	quern_real gravity[3]; /* m/s^2 */
	quern_real lower[3], upper[3];
	bool periodic[3];
	const quern_host *host;
	void *scene; /* opaque */
} quern_setup;

/* ==== plugin and library ==== */

typedef struct quern_plugin {
	uint32_t size, kind, revision, dims; /* dims: QUERN_2D | QUERN_3D */
	const char *id;                      /* "contact.linear": kind and name; the file is contact.linear.so */
	const char *brief, *doc, *cite;      /* one line; a paragraph; the source of the formulas */
	uint32_t instance_size, pad;
	const quern_param *params; /* QUERN_END_PARAMS-terminated */
	const quern_use *uses;     /* QUERN_END_USES-terminated */
	/* [setup] derived constants and cross-checks; params are filled in already. May be NULL. */
	quern_status (*init)(void *self, const quern_setup *, quern_err *);
	void (*finish)(void *self); /* [setup] frees what init took; may be NULL */
	const void *ops;            /* quern_contact_ops, ... by kind */
} quern_plugin;

typedef struct quern_library {
	uint32_t size, abi, real_size, lanes, param_size, use_size;
	const char *name, *version, *license, *build;
	const quern_plugin *plugin;
} quern_library;

#define QUERN_EXPORT __attribute__((visibility("default")))
#define QUERN_LIBRARY(plugin_, version_, license_)                                                           \
	QUERN_EXPORT extern const quern_library quern_library_1;                                                 \
	const quern_library quern_library_1 = { sizeof(quern_library), QUERN_ABI, sizeof(quern_real),            \
		QUERN_LANES, sizeof(quern_param), sizeof(quern_use), __FILE__, version_, license_, __VERSION__,      \
		&(plugin_) }

/* What a solver holds of a plugin in one of its slots. */
typedef struct quern_bound {
	const void *self, *ops;
	const void *item;           /* the slot's own rows for this entry, or NULL */
	const void *const *variant; /* by entry of the slot that overrides this one: the instance to use there */
	const quern_use *uses;
	const quern_column
		*column; /* by row of `uses`: columns of the whole set, NULL where the row does not count */
	const quern_column *again; /* the same for the slot's `repeat` set */
	uint32_t n_uses, n_variant;
	const char *id, *path; /* "contact.linear"; "grains.contact", for messages */
} quern_bound;

/* ==== kinds ==== */

/* ---- contact: one law, one pair of materials, one dimension per batch ----
 * The first of a pair is the grain of lower id, for ever; against a body it is the grain. Open pairs may be in a
 * batch (overlap <= 0): a law without reach gives them exactly zero force and sets its history to `initial`, by
 * select. Weights, levers and torques b x f are the solver's; hence a law is homogeneous of degree 1 in
 * (stiffness, mass). */
typedef struct quern_contact_batch {
	uint32_t n, cap;
	quern_real dt;
	const quern_real *overlap;      /* m, r1 + r2 - distance */
	const quern_real *normal[3];    /* unit, from second to first */
	const quern_real *velocity[3];  /* m/s, of first relative to second at the contact, spin included */
	const quern_real *spin[3];      /* rad/s, first minus second; NULL unless grain.spin exists */
	const quern_real *turn[3];      /* rad/s, mean of first and second; 3-D with spin, else NULL */
	const quern_real *radius;       /* m, r1 r2/(r1 + r2) */
	const quern_real *mass;         /* kg, m1 m2/(m1 + m2), unweighted */
	const quern_column *use;        /* by row: contact.*: this batch's; grain.* READ: the first's */
	const quern_column *use_second; /* grain.* READ: the second's (against a body: the first's) */
	quern_real *force[3];           /* N on first; laws of a list ADD to it */
	quern_real *couple[3]; /* N m on first, minus that on second; NULL unless a law uses contact.couple */
	/* NULL unless energy is observed: */
	quern_real *dashpot[3]; /* N on first, ADDed: the part of `force` that damps or clamps */
	quern_real *stored;     /* J, ADDed: in the normal spring */
	quern_real *sheared;    /* J, ADDed: in the tangential spring */
	quern_real *rubbed;     /* J, ADDed: lost to sliding in this step */
} quern_contact_batch;

typedef struct quern_contact_ops {
	uint32_t size, pad;
	void (*force[2])(const void *self, const quern_contact_batch *); /* [batch] [0] 2-D, [1] 3-D */
	/* [setup] s, half the shortest undamped period of a contact over all its modes: pi/omega */
	quern_real (*period)(const void *self, uint32_t dim, quern_real mass, quern_real radius);
	/* [setup] N/m, tangent normal stiffness at a normal force of `force` N */
	quern_real (*stiffness)(const void *self, uint32_t dim, quern_real radius, quern_real force);
	quern_real (*reach)(const void *self, quern_real radius); /* [setup] m beyond touching; NULL: 0 */
} quern_contact_ops;

/* ---- neighbours: sort keys, then the candidate pairs of one block ---- */
typedef struct quern_pair {
	int32_t first, second;
} quern_pair;

typedef struct quern_neighbour_job {
	uint32_t n, dim;
	const quern_real *position[3], *radius;
	quern_real largest;            /* m, largest radius */
	quern_real reach;              /* m beyond touching: skin plus the laws' reach */
	quern_real lower[3], upper[3]; /* m, the domain; matters along periodic axes */
	bool periodic[3];
	uint32_t n_blocks; /* after `keys`: the partition of the sorted grains */
	const uint32_t *block;
	void *memory; /* zeroed, as many bytes as `keys` asked for */
} quern_neighbour_job;

typedef struct quern_neighbour_ops {
	uint32_t size, pad;
	/* [stage] A key per grain: the block in the high 32 bits, the place inside it in the low ones. The solver
	 * sorts grains by key, ties in the old order. Returns the bytes of memory wanted by the other two. */
	size_t (*keys)(const void *self, const quern_neighbour_job *, uint64_t *key);
	void (*index)(const void *self, const quern_neighbour_job *); /* [stage] after the sort; may be NULL */
	/* [batch] Every pair of distinct grains closer than r1 + r2 + reach with at least one of them in block b,
	 * each once, `first` in block b, in any order. Returns how many there are; writes at most `cap`. */
	uint32_t (*pairs)(const void *self, const quern_neighbour_job *, uint32_t b, uint32_t cap, quern_pair *);
} quern_neighbour_ops;

/* ---- integrator: grains of one block; `close` runs fused with the sums, `open` (optional) before the forces ---- */
enum { QUERN_INTEGRATOR_CLOSE, QUERN_INTEGRATOR_OPEN };

typedef struct quern_integrator_batch {
	uint32_t n, cap;
	quern_real dt, gravity[3];
	const quern_real *force[3],
		*torque[3];                   /* N, N m, weighted; torque NULL without spin; both NULL in `open` */
	const quern_real *mass, *inertia; /* kg, kg m^2, weighted like the force */
	const quern_real *position[3], *velocity[3], *spin[3];
	quern_real *new_position[3], *new_velocity[3], *new_spin[3];
	quern_real *mean_velocity[3],
		*mean_spin[3]; /* over the kick, so that force . mean * dt is the change of kinetic
	                                                energy; NULL unless energy is observed, and in `open` */
	const quern_column *use;
} quern_integrator_batch;

typedef struct quern_integrator_ops {
	uint32_t size, pad;
	void (*close[2])(const void *self, const quern_integrator_batch *); /* [batch] */
	void (*open[2])(const void *self, const quern_integrator_batch *);  /* [batch] may be NULL */
} quern_integrator_ops;

/* ---- body: geometry only; pose and motion are the host's, so that scripted and free bodies share it ---- */
typedef struct quern_pose {
	quern_real position[3], turn[9], velocity[3], spin[3]; /* turn: row-major, body to scene */
} quern_pose;

typedef struct quern_body_batch {
	uint32_t n, cap, dim, pad;
	const quern_pose *pose;
	const quern_real *position[3], *radius; /* of grains; grid nodes come with radius 0 */
	const int32_t *feature;  /* which face, edge or vertex, from `features`; NULL: the nearest */
	quern_real *gap;         /* m, distance to the surface minus radius; negative: overlap or inside */
	quern_real *normal[3];   /* unit, out of the body */
	quern_real *velocity[3]; /* m/s, of the surface at the nearest place */
} quern_body_batch;

typedef struct quern_body_ops {
	uint32_t size, pad;
	void (*closest)(const void *self, const quern_body_batch *); /* [batch] */
	/* [batch] features of this body within reach of a sphere; returns how many there are. NULL: feature 0 alone */
	uint32_t (*features)(const void *self, const quern_pose *, const quern_real x[3], quern_real reach,
		uint32_t cap, int32_t *feature);
	/* [setup] box around it in its own frame, infinite where unbounded */
	void (*bounds)(const void *self, uint32_t dim, quern_real lower[3], quern_real upper[3]);
} quern_body_ops;

/* ---- material: points in place, once a step, after the grid's velocity; stress is state, also of a
 *      hyperelastic law ---- */
enum { QUERN_MATERIAL_UPDATE, QUERN_MATERIAL_ASSIGN };

typedef struct quern_material_batch {
	uint32_t n, cap;
	quern_real dt;
	const quern_real *gradient[9];  /* 1/s, L row-major dim x dim */
	const quern_real *grid_density; /* kg/m^3, of the mixture at the point, unweighted */
	quern_real *density;    /* kg/m^3, in: true m/V after V *= det(1 + dt L); out: what the point has from now
	                                    on, so that a point that is open can follow grid_density */
	quern_real *stress[6];  /* Pa, Cauchy, tension positive; in and out */
	quern_real *wave_speed; /* m/s, out; NULL if not wanted */
	quern_real *energy;     /* J/kg stored, out; NULL if not wanted */
	const quern_column *use;
} quern_material_batch;

typedef struct quern_material_ops {
	uint32_t size, pad;
	void (*update[2])(const void *self, const quern_material_batch *); /* [batch] hook 0 */
	/* [batch] hook 1: history from stress. Tension is clipped, the stress returned to the yield surface; density comes
	 * out as that of the point under this stress. gradient and grid_density are NULL, dt is 0. */
	void (*assign[2])(const void *self, const quern_material_batch *);
	/* [setup] moduli for step limits (Pa) and the density without stress (kg/m^3) */
	void (*moduli)(const void *self, uint32_t dim, quern_real *bulk, quern_real *shear, quern_real *density);
} quern_material_ops;

/* ---- shape: separable weights of a chunk, three nodes per axis (unused ones zero) ---- */
typedef struct quern_shape_batch {
	uint32_t n, cap, dim, pad;
	quern_real inverse_cell;       /* 1/m */
	const quern_real *position[3]; /* m from the grid's lower corner */
	int32_t wall[3][2]; /* node index of walls on node lines, INT32_MIN and INT32_MAX where there is none */
	int32_t *first[3];  /* lowest node of the support; after folding never beyond a wall's far side */
	quern_real *value[3][3]; /* [axis][node] */
	quern_real *slope[3][3]; /* 1/m */
} quern_shape_batch;

typedef struct quern_shape_ops {
	uint32_t size, pad;
	void (*weights)(
		const void *self, const quern_shape_batch *); /* [batch] completeness up to the walls, 1e-13 */
	/* [setup] the volume of a node on a wall and of the next one, over that of a node inside */
	void (*shares)(const void *self, quern_real *wall, quern_real *next);
	quern_real (*stiffness)(
		const void *self); /* [setup] chi h^2 of the step limit, model of docs/theory/mpm.md */
} quern_shape_ops;

/* ---- transfer: maps what the solver gathered from nodes onto particle velocities; never sees the grid, so that it
 *      serves points and grains alike. A point's position is the solver's: x += dt pic. ---- */
typedef struct quern_transfer_batch {
	uint32_t n, cap, pass, pad; /* pass counts round trips; the last one writes velocity */
	quern_real dt;
	const quern_real *pic[3];    /* m/s, sum S v_i */
	const quern_real *change[3]; /* m/s, sum S (v_i - v_i before forces and coupling) */
	const quern_real *echo[3];   /* m/s, what the last pass sent, gone to the grid and back; NULL in pass 0 */
	quern_real *send[3];         /* m/s, what to send next; NULL in the last pass */
	quern_real *velocity[3];     /* m/s, in: old, out (last pass only): new */
	const quern_column *use;
} quern_transfer_batch;

typedef struct quern_transfer_ops {
	uint32_t size;
	uint32_t passes;                                                   /* extra round trips; 0: none */
	void (*gather[2])(const void *self, const quern_transfer_batch *); /* [batch] */
} quern_transfer_ops;

/* ---- coupling: what continuum and grains bring to the nodes of one grid block ---- */
typedef struct quern_coupling_job {
	uint32_t dim, n; /* nodes */
	const quern_real *mass,
		*other_mass;         /* kg, weighted: continuum, grains; coupled where both are positive */
	quern_real *velocity[3]; /* m/s, of the continuum after forces: in and out */
	quern_real *other[3];    /* m/s, of the grains: in and out */
} quern_coupling_job;

typedef struct quern_coupling_ops {
	uint32_t size, affine; /* affine: 1 lets both clouds send v + L (x_i - x) */
	void (*couple)(
		const void *self, const quern_coupling_job *); /* [batch] conserves mass * velocity, node by node */
} quern_coupling_ops;

/* ---- oracle: local marks; the hybrid solver then builds the distance inwards from the marked surface; then local
 *      decisions ---- */
enum { QUERN_DISCRETE, QUERN_HYBRID, QUERN_CONTINUUM };
enum {
	QUERN_SURFACE_FLOOD = 1, /* outside counts only where it is connected with an open boundary */
	QUERN_SURFACE_WALLS = 2  /* walls and bodies count as surface */
};

typedef struct quern_cell_batch {
	uint32_t n, cap, dim, pad;
	quern_real cell;             /* m */
	const quern_real *centre[3]; /* m */
	const quern_real
		*distance;       /* m inwards from this oracle's surface, to the cell's centre; NULL while marking */
	const int32_t *zone; /* old */
	const quern_column *use; /* cell.* of this batch */
	quern_real *level;       /* marking: > 0 inside, <= 0 outside; its zero contour is the surface */
	int32_t *wish;           /* deciding: zone; the least continuous of all oracles wins */
} quern_cell_batch;

typedef struct quern_oracle_ops {
	uint32_t size, pad;
	void (*mark)(const void *self, const quern_cell_batch *);   /* [batch] */
	void (*decide)(const void *self, const quern_cell_batch *); /* [batch] */
	uint32_t (*surface)(const void *self);                      /* [setup] QUERN_SURFACE_*; NULL: 0 */
} quern_oracle_ops;

/* ---- packer: one region, a cell to enrich or a box to fill; regions are visited in a fixed order, so that none sees
 *      another's work in progress ---- */
typedef struct quern_spot {
	quern_real x[3], radius;
} quern_spot;

typedef struct quern_pack_job quern_pack_job;
struct quern_pack_job {
	uint32_t dim, pad;
	uint64_t stream, key; /* for host->random: this packing; this region */
	uint64_t counter;     /* first unused counter of `key` */
	const quern_host *host;
	quern_real lower[3], upper[3]; /* m, bounding box of allowed centres */
	quern_real upstream[3];        /* unit, towards the continuum neighbours; zero if none or all */
	const quern_spot *seed;        /* grains within reach at the start, this region's own first */
	uint32_t n_seed, n_own;
	/* [region] */
	quern_real (*radius)(quern_pack_job *); /* m, the grain that waits: the same until it is placed */
	bool (*inside)(const quern_pack_job *, const quern_real x[3]);
	bool (*free)(const quern_pack_job *,
		const quern_spot *); /* no overlap with grains or bodies above 1e-9 of a radius */
	bool (*place)(quern_pack_job *, const quern_spot *); /* takes the waiting grain; false: enough, stop */
	void *scene;
};

typedef struct quern_packer_ops {
	uint32_t size, pad;
	void (*pack[2])(const void *self, quern_pack_job *); /* [region] */
} quern_packer_ops;

/* ---- observer: partial results of leaves of 256 entries, combined in a fixed tree; or `whole` for what needs
 *      everything at once ---- */
typedef enum { QUERN_SUM, QUERN_MAX, QUERN_MIN } quern_combine;

typedef struct quern_output {
	const char *name, *unit, *doc;
	uint32_t combine; /* of the partial of the same index, for `map` */
	uint32_t pad;
} quern_output;

typedef struct quern_observer_batch {
	uint32_t n, dim; /* entries of this leaf; `whole`: 0 */
	quern_real time, gravity[3], lower[3], upper[3];
	const quern_column *use;
	const uint32_t *count; /* `whole`: entries by row of `uses`; NULL in `map` */
} quern_observer_batch;

typedef struct quern_observer_ops {
	uint32_t size, pad;
	const char *set;             /* that `map` runs over; NULL: `whole` */
	const quern_output *outputs; /* NULL-name terminated */
	void (*map)(
		const void *self, const quern_observer_batch *, quern_real *partial); /* [batch] one per output */
	quern_status (*whole)(const void *self, const quern_observer_batch *, quern_real *out, const quern_host *,
		quern_run *); /* [stage] */
} quern_observer_ops;

/* ---- solver: sets, slots and stages. Its stages keep the order of its table inside a phase; between solvers the
 *      declared uses decide. ---- */
typedef enum {
	QUERN_SETUP,   /* once, before the first step */
	QUERN_CONVERT, /* every step */
	QUERN_GRAINS,  /* `substeps` times a step; alone while settling */
	QUERN_TO_GRID,
	QUERN_COUPLE,
	QUERN_FROM_GRID,
	QUERN_OBSERVE,
	QUERN_PHASES
} quern_phase;

/* rows: 0 for struct of arrays; 8 for one 64-byte row per grid node, whose lanes are the components of the set's
 * fields in the order in which the owner's stages first name them. A set may hang on a slot: then it exists only
 * while that slot is filled. Sets "total" (one entry) and, on the grid, "cell" belong to the host. */
typedef struct quern_set {
	const char *name, *doc, *slot;
	uint32_t rows, pad;
} quern_set;

typedef struct quern_slot {
	const char *name,
		*doc; /* scene key; "fill.packer": one in every item of the list "fill"; "": the section is the list */
	const char
		*def; /* what stands there if the scene says nothing, as in a scene; NULL: required unless `list` */
	const char *stage[3]; /* the stage that calls hook 0, 1, 2; the plugin's uses count as that stage's */
	const char *same_as;  /* "continuum.material": that slot, called from here too */
	const char *repeat;   /* the law's "contact.*" rows are made again for this set: "touch" */
	const char *particle; /* what "particle.*" in the plugin's uses stands for here: "point", "grain" */
	const char *
		override; /* "grains.contact": the key of that slot's name in an entry here overrides its parameters */
	const quern_param *rows; /* keys that every entry takes besides the plugin's own */
	uint32_t item_size;      /* bytes that `rows` fill */
	uint32_t kind, list, pad;
} quern_slot;

typedef struct quern_step {
	int64_t step, substep; /* settling counts in substep alone */
	uint32_t dim, n_substeps;
	bool settling;
	uint32_t batch;      /* entities per batch that the scene wishes for */
	quern_real time, dt; /* dt of this phase: the short step among the grains, the long one elsewhere */
	quern_real gravity[3], lower[3], upper[3];
	bool periodic[3];
	const quern_column *use;        /* by row of this stage's uses: whole sets */
	const quern_bound *const *slot; /* slot[k]: the plugins of slot k */
	const uint32_t *n_slot;
	const quern_host *host;
	quern_run *run;
} quern_step;

typedef struct quern_stage {
	const char *name, *doc;
	uint32_t phase;
	uint32_t sometimes; /* may do nothing this step: its WRITEs keep old values */
	const quern_use *uses;
	quern_status (*run)(const void *self, const quern_step *); /* [stage] */
} quern_stage;

/* What a solver carries, for the summary, the guard on lost mass and the share of the grains. */
typedef struct quern_account {
	quern_real mass;                        /* kg carried, weighted */
	quern_real discrete;                    /* kg of it carried by grains */
	quern_real momentum[3];                 /* kg m/s */
	quern_real kinetic, potential, elastic; /* J */
	quern_real owed, owed_momentum[3];      /* the ledger's sum: kg, kg m/s */
	quern_real defect;                      /* of the solver's own invariants so far, relative */
} quern_account;

typedef struct quern_solver_ops {
	uint32_t size, pad;
	const quern_set *sets; /* NULL-name terminated, like slots and stages */
	const quern_slot *slots;
	const quern_stage *stages;
	/* [setup] after every plugin of the section is ready; may publish. May be NULL. */
	quern_status (*ready)(
		void *self, const quern_setup *, const quern_bound *const *slot, const uint32_t *n_slot, quern_err *);
	/* [stage] largest stable step of this solver's phase and what limits it; NULL: none. `hard`: beyond it the method
	 * is unstable; the value returned is the recommended one. Uses are those of the first stage. */
	quern_real (*limit)(const void *self, const quern_step *, quern_real *hard, char reason[160]);
	uint32_t (*substeps)(const void *self); /* [setup] grain steps per step; NULL: 1 */
	/* [stage] after every grain step while settling: true when at rest. NULL: nothing to settle */
	bool (*settled)(const void *self, const quern_step *);
	void (*account)(const void *self, const quern_step *, quern_account *); /* [stage] adds; may be NULL */
} quern_solver_ops;

/* ==== kernels ==== */

#define QUERN_SIMD _Pragma("omp simd")
#define QUERN_INLINE static inline __attribute__((always_inline))

#ifdef __cplusplus
}
#endif
