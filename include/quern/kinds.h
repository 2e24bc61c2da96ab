/* SPDX-License-Identifier: MIT */
/* quern/kinds.h - what the host and a plugin of each kind tell each other: batches, jobs and tables of functions. The second
 * half of quern/abi.h, which includes it; the rules at the head of that file hold for every function here. */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Most rows that the uses of one plugin in a slot may have, whatever its kind; a plugin with more is refused when it is
 * loaded. Whoever calls plugins sizes its arrays of columns by it. The rows of a solver's stages are the solver's own. */
enum { QUERN_MOST_USES = 32 };

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
	/* N m on first, minus that on second; laws ADD to it. NULL unless a law of the list has a use of "contact.couple"
	 * (N m, QUERN_ADD, QUERN_AXIAL), which says that there are couples and no more. */
	quern_real *couple[3];
	/* NULL unless energy is observed: */
	quern_real *dashpot[3]; /* N on first, ADDed: the part of `force` that damps or clamps */
	quern_real *stored;     /* J, ADDed: in the normal spring */
	quern_real *sheared;    /* J, ADDed: in the tangential spring */
	quern_real *rubbed;     /* J, ADDed: lost to sliding in this step */
	quern_real
		*drag_couple[3]; /* N m on first, ADDed: the part of `couple` that damps; NULL without couples too */
} quern_contact_batch;

typedef struct quern_contact_ops {
	uint32_t size, pad;
	void (*force[2])(const void *self, const quern_contact_batch *); /* [batch] [0] 2-D, [1] 3-D */
	/* [setup] s, half the shortest undamped period of a contact over all its modes: pi/omega */
	quern_real (*period)(const void *self, uint32_t dim, quern_real mass, quern_real radius);
	/* [setup] N/m, tangent normal stiffness at a normal force of `force` N */
	quern_real (*stiffness)(const void *self, uint32_t dim, quern_real radius, quern_real force);
	quern_real (*reach)(const void *self, quern_real radius); /* [setup] m beyond touching; NULL: 0 */
	/* [setup] damping ratio gamma/(2 sqrt(k m)) of the mode that is damped most, at the stiffness that `period` is of: an
	 * explicit dashpot has a limit of its own; NULL: 0 */
	quern_real (*damping)(const void *self, uint32_t dim);
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
	uint32_t size;
	uint32_t damps; /* 1: takes energy away on purpose, for settling; what it takes stands in no budget */
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
	/* [batch] features of this body, numbers from 0 on, whose surface may lie within `reach` of x; returns how many
	 * there are, and writes at most `cap`. A grain touches each of them that closest() finds near, with a history for
	 * each. NULL: the body is one feature, its nearest place */
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
	const quern_spot *seed;        /* grains within reach at the start, as the images nearest to the region */
	uint32_t n_seed, pad_seed;
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
	/* by row of `uses`; in `map` the columns of `set` begin at the leaf's first entry, others are whole */
	const quern_column *use;
	const uint32_t *count; /* `whole`: entries by row of `uses`; NULL in `map` */
} quern_observer_batch;

typedef struct quern_observer_ops {
	uint32_t size, pad;
	const char *set;             /* that `map` runs over; NULL: `whole` */
	const quern_output *outputs; /* NULL-name terminated; what comes out must be finite */
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
	QUERN_OUTPUT, /* when the state is about to be observed and written: changes no state; dt 0 before the first step */
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
	const quern_param *rows;       /* keys that every entry takes besides the plugin's own */
	uint32_t item_size;            /* bytes that `rows` fill */
	uint32_t kind, list, required; /* required: a list that must be given, be it empty */
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
	/* [stage] after the set-up: about how many steps of s->dt it takes until settled, within a factor of three or so. For
	 * an estimate alone; may be NULL */
	quern_real (*settling)(const void *self, const quern_step *);
} quern_solver_ops;

#ifdef __cplusplus
}
#endif
