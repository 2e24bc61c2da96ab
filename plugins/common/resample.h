/* SPDX-License-Identifier: MIT */
/* resample - the points of a cell that are few are parted, those that are many are joined. Mass, momentum and volume stay, and with them the
 * density: an open point stays open. Stress is the mean by volume, so that the sum of V sigma stays. Whatever else a point remembers
 * follows the rules of its fields; of joined points the heavier one stays. docs/theory/mpm.md, section 9 */
#pragma once
#include <quern/grid.h>
#include <quern/solver.h>

typedef struct new_point {
	quern_real position[3], velocity[3], stress[6], mass, weight, volume;
	int32_t cell;
	int32_t parent; /* old entry that it is a part of, -1: none */
} new_point;

/* Points by cell, and what shall become of them. Whoever asks fills the first part; what points have is written at once, but for those
 * that are new, which quern_resample_apply() makes. */
typedef struct resample {
	const quern_step *s;
	const quern_grid_view *g;
	const quern_column *position, *velocity, *mass, *volume, *stress; /* of the set "point" */
	const quern_column *weight;                                       /* real[0] NULL: there are none */
	const uint32_t *begin; /* by cell: those of c are point[begin[c]] and on */
	const int32_t *point;
	quern_real nominal; /* kg: of one point in a full cell */
	bool *drop;         /* by point: it goes */
	new_point *made;    /* to be freed by whoever asked */
	uint32_t n_made, cap;
	bool failed;    /* memory ran out */
	uint32_t first; /* out: the first of the new ones */
} resample;

QUERN_INLINE uint32_t resample_parts(const resample *r) { return r->s->dim == 2 ? 4 : 8; }
/* Quadrant or octant of a cell that a position lies in, and the middle of one. */
uint32_t quern_resample_part(const resample *, const int32_t cell[3], quern_real *const x[3], int32_t i);
void quern_resample_middle(const resample *, const int32_t cell[3], uint32_t part, quern_real x[3]);

/* Notes a new point. */
void quern_resample_add(resample *, const new_point *);

/* What splitting has to heed. */
typedef struct resample_split {
	bool closed[8];     /* by part: nothing may be put there */
	quern_real held[8]; /* of parts that are as far from all points the one with most of it is taken */
	quern_real weight;  /* of what is new */
} resample_split;

/* An empty part of a cell that holds at least one point, the one farthest from all, gets a point that takes an equal share from each of the
 * others; false where there is none, or the share would be less than a quarter of `nominal`. */
bool quern_resample_split(resample *, uint32_t c, const resample_split *);
/* The same, and the centre of mass stays: those that give move away, though not out of their cell, and the new one is nearer to them as far as they
 * cannot. `into`: an empty cell beside c that gets the point, in its middle; -1: it goes to a part of c itself. False also where the
 * new point would be of no use so near to the old ones. */
bool quern_resample_fill(resample *, uint32_t c, int32_t into);
/* The lightest point of the cell, which has two at least, joins its nearest neighbour, if there is one then of those that are open or closed
 * like it. */
void quern_resample_join(resample *, uint32_t c);
/* [stage] The set without those that have gone, and with those that are new. One without a parent has but what new_point says: the rest
 * of its state is the caller's. */
quern_status quern_resample_apply(resample *);
