/* SPDX-License-Identifier: MIT */
/* quern/packer.h - the kind `packer`: one region, a cell to enrich or a box to fill; regions that are packed at once, by
 * several threads, do not see each other's work */
#pragma once
#include <quern/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct quern_spot {
	quern_real x[3], radius;
} quern_spot;

/* Since 2.1: what becomes of a grain that is placed smaller than the one that waits. */
enum {
	QUERN_STAYS_SMALL,   /* it stays so: grains must have the radius of the one that waits */
	QUERN_GROWS_ALONE,   /* it grows to that radius while the run goes on, as far as its neighbours let it */
	QUERN_GROWS_TOGETHER /* `relax` makes all grains of the fill grow to theirs and moves them apart */
};

typedef struct quern_pack_job quern_pack_job;
struct quern_pack_job {
	uint32_t dim, pad;
	uint64_t stream, key; /* for host->random: this packing; this region */
	uint64_t counter;     /* first unused counter of `key` */
	const quern_host *host;
	quern_real lower[3], upper[3]; /* m, bounding box of allowed centres */
	quern_real upstream[3];        /* unit, towards the continuum neighbours; zero if none or all */
	/* grains within reach at the start, as the images nearest to the region; when asked again, also what was placed in it */
	const quern_spot *seed;
	uint32_t n_seed, pad_seed;
	/* [region] */
	quern_real (*radius)(quern_pack_job *); /* m, the grain that waits: the same until it is placed */
	bool (*inside)(const quern_pack_job *, const quern_real x[3]);
	bool (*free)(const quern_pack_job *,
		const quern_spot *); /* no overlap with grains or bodies above 1e-9 of a radius */
	bool (*place)(quern_pack_job *, const quern_spot *); /* takes the waiting grain; false: enough, stop */
	void *scene;
	uint32_t growth, pad_growth; /* since 2.1: QUERN_STAYS_SMALL, ... */
};

/* Since 2.1. All grains of one fill, once its regions are packed, those that stand around them, and bodies. */
typedef struct quern_relax_job quern_relax_job;
struct quern_relax_job {
	uint32_t dim, n, n_around, n_bodies;
	quern_spot *spot; /* n; in: as placed; out: where it stays, its radius `full`, or 0: it is taken away */
	const quern_real *full;        /* m, n: the radius that each shall have */
	const quern_spot *around;      /* n_around; they stay */
	quern_real lower[3], upper[3]; /* m, of the domain */
	bool periodic[3];
	bool (*inside)(const quern_relax_job *, const quern_real x[3]); /* where centres may be */
	/* m between a body and a grain, below 0 if they overlap, and the unit normal from the body to the grain */
	quern_real (*gap)(const quern_relax_job *, uint32_t body, const quern_spot *, quern_real normal[3]);
	void *scene;
};

typedef struct quern_packer_ops {
	/* shrinks, since 2.1: 1 if `pack` places smaller grains by itself where the job lets them grow; else a caller that lets
	 * them asks again with smaller radii */
	uint32_t size, shrinks;
	void (*pack[2])(const void *self, quern_pack_job *); /* [region] */
	/* since 2.1: [stage] brings grains to their full radii; may allocate. Afterwards none overlaps another or a body by more than 1 %
	 * of the smaller radius. Of what was placed before it may move `spot` alone. QUERN_E_MEMORY if memory is gone. NULL: grains have
	 * their full radii from the start */
	quern_status (*relax)(const void *self, quern_relax_job *);
} quern_packer_ops;

QUERN_KIND(packer, quern_packer_ops, "Grains placed in a region.", QUERN_EACH(quern_packer_ops, pack),
	QUERN_OPTIONALLY(quern_packer_ops, relax));

#ifdef __cplusplus
}
#endif
