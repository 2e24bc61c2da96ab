/* SPDX-License-Identifier: MIT */
/* quern/solver.h - the kind `solver`: sets of entities, slots for plugins of other kinds, and stages.
 *
 * The program knows no physics: which sections a scene may have, what its sets are called, what is counted and summed up
 * stands in the tables of solvers, and what happens in a step is what their stages do. Stages of one solver keep the order
 * of its table inside a phase; between solvers the declared uses decide. */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A step runs through the phases in this order. They mean no more than what stands here; what a solver does in one is its
 * own affair. Several solvers meet at the nodes of the shared grid between DEPOSIT and ADVANCE. */
typedef enum {
	QUERN_SETUP,    /* once, before the first step */
	QUERN_BEGIN,    /* entries that appear, go, or change hands */
	QUERN_SUBSTEP,  /* `substeps` times a step, with as many parts of its dt */
	QUERN_DEPOSIT,  /* what entries bring to the grid */
	QUERN_EXCHANGE, /* what solvers do to each other there */
	QUERN_ADVANCE,  /* what entries take from the grid */
	QUERN_END,      /* what is true once a step is over */
	QUERN_OUTPUT, /* when the state is about to be observed and written: changes no state; dt 0 before the first step */
	QUERN_PHASES
} quern_phase;

/* rows: 0 for struct of arrays; 8 for one 64-byte row per grid node, whose lanes are the components of the set's
 * fields in the order in which the owner's stages first name them; column.real[0] of such a field is where its first lane
 * of entry 0 lies, and the next entry's is 8 numbers on. A set may hang on a slot: then it exists only
 * while that slot is filled. Sets "total" (one entry) and, on the grid, "cell" belong to the host. */
typedef struct quern_set {
	const char *name, *doc, *slot;
	const char *
		plural; /* its group in frames, its column and its keys where it is counted: "grains"; NULL: the name */
	uint32_t rows;
	uint32_t
		counted; /* 1: series.csv and summary.json say how many there are, and how many steps they took */
	quern_real
		cost[2]; /* s that a step of one entry takes on one core in 2-D and 3-D, about: for estimates */
	/* since 2.1: parameter of this solver: the set is there only if that is not zero; NULL: always */
	const char *when;
} quern_set;

struct quern_bound;

typedef struct quern_slot {
	const char *name,
		*doc; /* scene key; "fill.packer": one in every item of the list "fill"; "": the section is the list */
	const quern_kind *kind;
	const char
		*def; /* what stands there if the scene says nothing, as in a scene; NULL: required unless `list` */
	const char *stage[3]; /* the stage that calls hook 0, 1, 2; the plugin's uses count as that stage's */
	const char *same_as;  /* "continuum.material": that slot, called from here too */
	const char *repeat;   /* rows of the plugin's uses that are of this set ... */
	const char *again;    /* ... are made once more for this one: "contact", "touch" */
	const char *particle; /* what "particle.*" in the plugin's uses stands for here: "point", "grain" */
	const char *
		override; /* "grains.contact": the key of that slot's name in an entry here overrides its parameters */
	const quern_param *rows; /* keys that every entry takes besides the plugin's own */
	uint32_t item_size;      /* bytes that `rows` fill */
	uint32_t list, required; /* required: a list that must be given, be it empty */
	uint32_t once;           /* since 2.1: stages of a scene cannot change parameters of plugins here */
	/* since 2.1: "cases", a list among the solver's parameters whose items take, beside their own rows, keys of the plugins here: what
	 * they are in that case. A key that several of them have is given under a plugin's name: {linear: {friction: 0.1}} */
	const char *refine;
	/* since 2.1: [setup] called when the slot has been filled, before those that come after it in the table: what their plugins take
	 * as a default may be published here. Not called where the section has a fault. May be NULL */
	quern_status (*filled)(
		void *self, const struct quern_setup *, const struct quern_bound *, uint32_t n, quern_err *);
} quern_slot;

/* What a solver holds of a plugin in one of its slots. */
typedef struct quern_bound {
	const void *self,
		*ops;         /* `ops` is as long as the solver's header says: what an older plugin lacks is zero */
	const void *item; /* the slot's own rows for this entry, or NULL */
	const void *const *variant; /* by entry of the slot that overrides this one: the instance to use there */
	const quern_use *uses;
	const quern_column
		*column; /* by row of `uses`: columns of the whole set, NULL where the row does not count */
	const quern_column *again; /* the same for the slot's `again` */
	uint32_t n_uses, n_variant;
	const char *id, *path; /* "contact.linear"; "grains.contact", for messages */
	/* since 2.1: by item of the list that refines this slot, 1 + n_variant instances each: the one to use in that case, then those
	 * with what entry 0, 1, ... of the overriding slot says on top. All are there; NULL without such a list */
	const void *const *refined;
	uint32_t n_refined, pad;
} quern_bound;

typedef struct quern_step {
	int64_t step, substep; /* settling counts in substep alone */
	uint32_t dim, n_substeps;
	bool settling;
	uint32_t batch;      /* entities per batch that the scene wishes for */
	quern_real time, dt; /* dt of this phase: the short step in QUERN_SUBSTEP, the long one elsewhere */
	quern_real gravity[3], lower[3], upper[3];
	bool periodic[3];
	const quern_column *use;        /* by row of this stage's uses: whole sets */
	const quern_bound *const *slot; /* slot[k]: the plugins of slot k */
	const uint32_t *n_slot;
	const quern_host *host;
	quern_run *run;
	/* since 2.1: this step's number if one of the scene's `stages` begins with it, so that keys may have other values than in
	 * the last step; else -1 */
	int64_t stage_step;
	uint32_t within; /* since 2.1: which of n_substeps this is, from 0; 0 in other phases */
	bool open[2][3]; /* since 2.1: faces of the domain that let material out: lower, upper; by axis */
} quern_step;

enum {
	QUERN_SOMETIMES = 1, /* the stage may do nothing this step: its WRITEs keep old values */
	QUERN_SETTLES = 2    /* in QUERN_SUBSTEP: runs while solvers settle too, alone and before time starts */
};

typedef struct quern_stage {
	const char *name, *doc;
	uint32_t phase, flags;
	const quern_use *uses;
	quern_status (*run)(const void *self, const quern_step *); /* [stage] */
	/* since 2.1: parameter of this solver: the stage is there only if that is not zero; NULL: always. The first
	 * stage of a solver always is */
	const char *when;
} quern_stage;

typedef struct quern_solver_ops {
	uint32_t size, set_size, slot_size, stage_size, output_size,
		bound_size; /* of this, and of one entry: QUERN_SOLVER_SIZES */
	/* The section of a scene that this solver reads, unless the scene names another one there: "grains". NULL: it reads
	 * those that name it. Lists of sections end with NULL, or are NULL. */
	const char *section;
	const char *const *needs; /* sections without which this one has nothing to do */
	const char *const *with;  /* sections that `model` keeps beside this one where the scene has them */
	const char *const
		*after; /* sections that are read first, as those of `needs` are: what they publish is there */
	const quern_set *sets; /* NULL-name terminated, like what follows */
	const quern_slot *slots;
	const quern_stage *stages;
	const quern_output *sums; /* what `account` gives; solvers that give the same name mean the same */
	/* [setup] after every plugin of the section is ready; may publish. May be NULL. */
	quern_status (*ready)(
		void *self, const quern_setup *, const quern_bound *const *slot, const uint32_t *n_slot, quern_err *);
	/* [stage] largest stable step of this solver's phase and what limits it; NULL: none. `hard`: beyond it the method
	 * is unstable; the value returned is the recommended one. Uses are those of the first stage. */
	quern_real (*limit)(const void *self, const quern_step *, quern_real *hard, char reason[160]);
	/* [setup, stage] how often QUERN_SUBSTEP runs in a step, which follows from parameters alone; 0 or NULL: no
	 * wish. All wishes must be one; in another stage of the scene it may be another */
	uint32_t (*substeps)(const void *self);
	/* [stage] after every substep while settling: true when at rest. NULL: nothing to settle */
	bool (*settled)(const void *self, const quern_step *);
	/* [stage] one number for each of `sums`, of what the solver carries now. Of the names, the program knows mass
	 * (kg; none may get lost), owed (kg, of mass that is on its way between solvers), left and poured (since 2.1; kg
	 * so far, out through faces of the domain and in by sources), momentum_x, momentum_y, momentum_z (kg m/s),
	 * kinetic, potential, elastic (J), discrete (kg of mass that single bodies carry), and defect (of the solver's
	 * own invariants so far, relative); all others stand in summary.json under `sums`. NULL: nothing */
	void (*account)(const void *self, const quern_step *, quern_real *sum);
	/* [stage] after the set-up: about how many steps of s->dt it takes until settled, within a factor of three or so. For
	 * an estimate alone; may be NULL */
	quern_real (*settling)(const void *self, const quern_step *);
	/* [setup] m, of the shared grid; 0 or NULL: no wish. All wishes must be one, in all stages of the scene */
	quern_real (*cell)(const void *self);
	/* [stage] after all state has been read from a file, where anything may stand: whether the solver can go on from it, or
	 * host->stop. Numbers are finite, and indices lead somewhere. May be NULL */
	quern_status (*accept)(const void *self, const quern_step *);
	/* since 2.1: how a scene starts from another run's state. `from`: a parameter of this solver, a T_TEXT with QUERN_FILE,
	 * in which the scene names a run, RUN or RUN:FRAME; NULL: this solver does not start so. Before the set-up the host
	 * gives the sets of `takes` what the file holds of their fields, with IDs, and of a plugin's own fields what the same
	 * plugin has left; the first set is there, and has the fields of `essential`, or the run is refused. Another set that
	 * cannot be read is empty. They are sets of this solver without rows, the first of
	 * them there in every scene. The stages of QUERN_SETUP go on from there, and answer for what the numbers mean here */
	const char *from;
	const char *const *takes, *const *essential; /* "grain"; "grain.position" */
	/* since 2.1: parameters that must be as they were; of a list "materials.name", which may go on behind what was there */
	const char *const *same;
	const char *const
		*unlike; /* since 2.1: sections that share entries with this one: a run that had one is refused */
	const quern_output
		*looks; /* since 2.1: numbers that are worth a look while the run goes; NULL: there are none */
	/* [stage] since 2.1: one number for each of `looks`, now and then between two steps, for a line on the terminal and
	 * progress.json; a number that means nothing now is NaN. Nothing depends on them. Uses are those of the first stage */
	void (*look)(const void *self, const quern_step *, quern_real *out);
	/* [stage] since 2.1: s that a long step of this solver takes on one core, about, beside what the prices of its sets' entries say: work
	 * on the grid, or on the entries of others. `wider`: as if cells were so many times as wide. For estimates; may be NULL */
	quern_real (*work)(const void *self, const quern_step *, quern_real wider);
} quern_solver_ops;

#define QUERN_SOLVER_SIZES                                                                                   \
	.size = sizeof(quern_solver_ops), .set_size = sizeof(quern_set), .slot_size = sizeof(quern_slot),        \
	.stage_size = sizeof(quern_stage), .output_size = sizeof(quern_output),                                  \
	.bound_size = sizeof(quern_bound)

QUERN_KIND(solver, quern_solver_ops, "Sets of entities, and stages that move them on.",
	QUERN_OPTIONALLY(quern_solver_ops, ready), QUERN_OPTIONALLY(quern_solver_ops, limit),
	QUERN_OPTIONALLY(quern_solver_ops, substeps), QUERN_OPTIONALLY(quern_solver_ops, settled),
	QUERN_OPTIONALLY(quern_solver_ops, account), QUERN_OPTIONALLY(quern_solver_ops, settling),
	QUERN_OPTIONALLY(quern_solver_ops, cell), QUERN_OPTIONALLY(quern_solver_ops, accept),
	QUERN_OPTIONALLY(quern_solver_ops, look), QUERN_OPTIONALLY(quern_solver_ops, work));

#ifdef __cplusplus
}
#endif
