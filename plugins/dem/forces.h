/* SPDX-License-Identifier: MIT */
/* forces - what the parts of the force stage share: pairs of grains, grains on bodies, integration */
#pragma once
#include "../bodies/books.h"
#include "../common/compress.h"
#include "box.h"
#include "dem.h"
#include <quern/space.h>

enum { GRAINS = 128 }; /* integrated at once */
/* what is kept of each: up to three columns from here on */
enum {
	G_FORCE,
	G_TORQUE = 3,
	G_MASS = 6,
	G_INERTIA,
	G_MEAN,
	G_MEAN_SPIN = 11,
	G_WAY = 14,
	G_KEPT,
	G_WHOLE,
	G_LOST,
	G_NEW_POSITION,
	G_NEW_VELOCITY = 21,
	G_NEW_SPIN = 24,
	G_ALONG = 27,
	G_OLD_POSITION = 30,
	G_OLD_VELOCITY = 33,
	G_OLD_SPIN = 36,
	N_GRAIN_COLUMNS = 39
};
/* Lanes of a grain's row: force, torque; then what dashpots give of both. In 2-D what sliding has taken follows; in 3-D two
 * numbers of the dashpots do, and the other four have a row of their own. */
enum { LANE_DRAG = 3, LANE_RUBBED = 6 };
enum { BOX_LOAD, BOX_WORK = 3, N_BOX_SUMS };
enum { E_KINETIC, E_POTENTIAL, E_STORED, E_SHEARED, E_DAMPED, E_RUBBED, N_ENERGIES };

/* Half a row, which most processors hold in one register: the same bits for any instruction set. */
typedef quern_real lanes4 __attribute__((vector_size(32)));

/* m, the least and the largest way of a block's grains since the last list, along each axis. */
typedef struct ways {
	quern_real along[3][2];
} ways;

/* A contact deeper than is allowed. */
typedef struct deep_contact {
	quern_real by, force, period, stiffness; /* over the smaller radius; N; s; N/m; by 0: there is none */
	int64_t first, second;                   /* ids; -1 - k for body k */
	const char *law;
} deep_contact;

/* What a law remembers of contacts, of all entries of the list, and what it is where there is nothing to remember. */
typedef struct history_column {
	const quern_real *column;
	quern_real initial;
} history_column;

/* What all blocks share. */
typedef struct forces_shared {
	const dem *d;
	const quern_step *s;
	const quern_column *use;
	uint32_t cap, most_grains, n_bodies, n_laws;
	size_t bytes; /* of a worker's columns */
	bool spin, couple;
	quern_real waits;   /* 1: as much of the kick again is given in the next step; 0: all of it in this one */
	bool predicts;      /* dashpots act on other velocities than those by which grains have moved */
	bool means;         /* it does, and a law asks for the latter */
	bool works, twists; /* what bodies do, and their torques, are booked */
	const body_pose *pose;         /* by body */
	quern_real dt;                 /* s, by which springs move */
	bool books;                    /* losses of this step are booked */
	bool looks;                    /* nothing moves: forces and energies of the state as it is */
	bool opens;                    /* ways are measured in the integrator's part before the forces */
	const history_column *history; /* what laws remember of contacts */
	uint32_t n_history;
	bool boxed;            /* the domain is strained */
	dem_box box, box_then; /* where forces are looked at, and after the step */
	quern_real *box_sums;  /* [block][N_BOX_SUMS] */
	quern_images images;
	const int32_t *material; /* NULL: no two contacts of a list have parameters of their own */
	const uint32_t *grain, *contact, *touch; /* partitions */
	const uint32_t *by_place;                /* blocks in the order of their places; NULL: in their own */
	body_books books_of_bodies;              /* the last one of a block: by fixed grains */
	quern_real *sums;                        /* [block][N_ENERGIES] */
	quern_real *farthest;                    /* [block] square of the way since the last list */
	ways *ways;                              /* [block] */
	quern_real *turned;     /* [block][2] sums of m v.v', of old and new velocity, and of m */
	int32_t *bad;           /* [block] first grain that is lost, or -1 */
	lanes4 *place, *motion; /* rows by grain: packed.h */
	lanes4 *mean;           /* of the motion since the last forces; NULL: that is `motion`, or no law asks */
	const body_pose *mean_pose;    /* by body, with the velocities of the middle of that time */
	bool checks, deep;             /* grains are checked in this step; contacts are */
	int32_t *outside;              /* [block] first grain out of the domain, or -1 */
	deep_contact *worst, *watched; /* [block] */
} forces_shared;

/* A law's own columns of a batch: of the contacts, or of the first and of the second grains. */
typedef struct law_row {
	void *mine[9], *other[9];
} law_row;

/* A worker's columns: `cap` pairs, then a block's sums. */
typedef struct forces_work {
	quern_real *overlap, *normal[3], *velocity[3], *spin[3], *turn[3], *radius, *mass, *weight, *arm[2];
	quern_real *mean_velocity[3], *mean_spin[3]; /* those of `velocity` and `spin` where they are the same */
	quern_real *wall[3];                         /* velocity of a body that moves, where it is touched */
	quern_real *crossed[3]; /* of a box that is strained: how many of its lengths lie between both */
	quern_real *force[3], *couple[3], *dashpot[3], *drag_couple[3], *stored, *sheared, *rubbed,
		*planar;   /* spin of the second grain, in 2-D */
	law_row *rows; /* of all laws, one after the other */
	int32_t *first, *second, *slot, *feature;
	compress_bits *near; /* who of a chunk's slots is looked at */
	/* per grain of the block, one more for partners outside, and three that are read with the last; couples, and from lane 3 on what of them damps */
	quern_real (*row)[8], (*drag_row)[4], (*couple_row)[8];
	quern_real *grains[N_GRAIN_COLUMNS];
	quern_real *own[QUERN_MOST_USES][9]; /* of the integrator, while nothing moves */
} forces_work;

/* A chunk of the list of contacts, or of that of touches on one body. */
typedef struct contact_chunk {
	uint32_t block;
	int32_t body;               /* the one touched, or -1 */
	int32_t item;               /* of the pairs of materials that have parameters of their own, or -1 */
	uint32_t begin, n_slots, n; /* entries begin .. begin + n_slots of the list, of which n are looked at */
	const compress_bits *near;  /* who of the entries is looked at; NULL: all are */
} contact_chunk;

/* Makes the rows of grains of block b that contacts read, of its own and of its neighbours. */
void quern_dem_pack(const forces_shared *, uint32_t b);
/* Adds what the contacts of block b do to its rows, and to its energies. */
void quern_dem_pairs(const forces_shared *, forces_work *, uint32_t b, quern_real *sums);
void quern_dem_touches(const forces_shared *, forces_work *, uint32_t b, quern_real *sums);
/* Moves the grains of block b. */
void quern_dem_integrate(const forces_shared *, forces_work *, uint32_t b, quern_real *sums);

/* ---- contacts.c ---- */
/* Of a chunk whose geometry and motion are known. */
void quern_dem_act(const forces_shared *, forces_work *, const contact_chunk *, quern_real *sums);
/* Couples of n grains join the torques in their rows. */
void quern_dem_fold_couples(const forces_shared *, const forces_work *, uint32_t n);
/* ---- laws.c ---- */
bool quern_dem_is_history(const quern_use *);
/* Sets `history`: numbers, not indices. */
bool quern_dem_find_history(forces_shared *);
/* Calls all laws; contacts that were left out forget, those that were kept remember. */
void quern_dem_call_laws(const forces_shared *, forces_work *, const contact_chunk *);
/* ---- checks.c ---- */
void quern_dem_decide_checks(forces_shared *);
void quern_dem_check_contacts(const forces_shared *, const forces_work *, const contact_chunk *);
void quern_dem_check_grains(const forces_shared *, uint32_t b);
quern_status quern_dem_judge_contacts(const forces_shared *, uint32_t n_blocks);
quern_status quern_dem_judge_grains(const forces_shared *, uint32_t n_blocks);

/* ---- skin.c ---- */

/* The least and the largest of n numbers of any order; the column is filled up to a multiple of 32. */
void quern_dem_range(quern_real *column, uint32_t n, quern_real *least, quern_real *most);
/* A list holds while neither two grains, nor a grain and a body, have used up the skin: this is half of what they have used, by the ways
 * of n parts of the grains, the longest of all ways, and how far bodies have come. Where grains are not `alone`, since a coupling lends
 * them motion as well, or ways are those beside a box's own flow, only the longest counts. While grains settle none does: a hybrid and its twin of
 * grains make their lists at the same steps then, and settle to the same bits. */
quern_real quern_dem_used_of_skin(
	const quern_step *, const ways *, uint32_t n, quern_real farthest, quern_real swept, bool alone);

/* ---- box.c ---- */
/* Differences in `normal` become those of nearest images; notes in `crossed`, which may be NULL, which those are. */
void quern_dem_box_bring(
	const forces_shared *, const forces_work *, uint32_t n, quern_real *const crossed[3]);
/* Takes the velocities of images from `velocity`, that of the first less that of the second. */
void quern_dem_box_motion(
	const forces_shared *, const forces_work *, quern_real *const velocity[3], uint32_t n);
/* What contacts bear, and what they do on images; of a pair across blocks the first grain's block keeps the books. */
void quern_dem_box_book(const forces_shared *, const forces_work *, const contact_chunk *, quern_real *sums);
void quern_dem_box_collect(const forces_shared *, uint32_t n_blocks);
/* Squares of ways beside the box's own strain since the list, of which `listed` holds lengths and offset; `anchor` from `begin` on. */
void quern_dem_box_ways(const dem_box *, const quern_column *listed, uint32_t begin, uint32_t n,
	quern_real *const x[3], quern_real *const anchor[3], quern_real *way);

/* ---- energy.c ---- */
/* What contacts hold; of a pair across blocks the first grain's block keeps the books. */
void quern_dem_look(const forces_shared *, const forces_work *, const contact_chunk *, quern_real *sums);
/* What dashpots and sliding have taken from n grains. */
void quern_dem_lose(
	const forces_shared *, const forces_work *, uint32_t begin, uint32_t row, uint32_t n, quern_real *sums);
/* What n grains have. */
void quern_dem_have(const forces_shared *, const forces_work *, uint32_t begin, uint32_t n, quern_real *sums);
