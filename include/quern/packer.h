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

QUERN_KIND(packer, quern_packer_ops, "Grains placed in a region.", QUERN_EACH(quern_packer_ops, pack));

#ifdef __cplusplus
}
#endif
