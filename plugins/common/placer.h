/* SPDX-License-Identifier: MIT */
/* placer - grains placed so far, found by place; answers whether another fits. One thread may add, several may ask
 * while nobody adds; it allocates. */
#pragma once
#include "../bodies/bodies.h"
#include <quern/packer.h>
#include <quern/space.h>

typedef struct placer {
	uint32_t dim;
	bool periodic[3];
	quern_real lower[3], length[3]; /* of the domain */
	quern_real half[3];             /* of the length along periodic axes, infinite elsewhere */
	quern_real inverse[3];          /* 1/m, of a cell, at least as wide as the largest diameter */
	int32_t wrap[3];                /* cells along a periodic axis */
	quern_spot *spot;
	int32_t *next;
	uint32_t n, cap;
	int32_t *head;
	uint32_t n_heads;        /* a power of two */
	const quern_bound *body; /* bodies that grains must not touch */
	const body_pose *pose;   /* where each of them is; NULL: where the scene put it */
	uint32_t n_bodies;
	bool nodes;  /* bodies are what the continuum's nodes see of them */
	bool failed; /* memory ran out */
} placer;

/* `most`: the largest radius that will ever be added or asked for. */
quern_status quern_placer_init(placer *, uint32_t dim, const quern_real lower[3], const quern_real upper[3],
	const bool periodic[3], quern_real most);
void quern_placer_finish(placer *);
/* Without grains, and with its bodies. */
void quern_placer_empty(placer *);
/* [stage] What must not be touched: bodies of a slot that are there now, where they are now, and of these with `nodes` only those
 * that act on the continuum. Until the stage returns; false if memory is gone. */
bool quern_placer_bodies(placer *, const quern_step *, uint32_t slot, bool nodes);
void quern_placer_add(placer *, const quern_spot *);
/* Whether two spots overlap, as the nearest images, by more than 1e-9 of the first one's radius. */
bool quern_placer_overlaps(const placer *, const quern_spot *, const quern_spot *);
/* No overlap with grains or bodies above 1e-9 of the spot's radius. */
bool quern_placer_free(const placer *, const quern_spot *);
/* The grain that a spot overlaps most, of those that `counts` is true of (NULL: all), by more than `share` of the
 * smaller radius, and by what share; -1: none. Grains are numbered as they were added. */
int32_t quern_placer_worst(const placer *, const quern_spot *, quern_real share,
	bool (*counts)(const void *arg, int32_t), const void *arg, quern_real *by);
/* Appends to `out` (capacity `cap`) the grains whose centre is within `reach` of the box; along periodic axes as the
 * image nearest to it. Returns how many there are. */
uint32_t quern_placer_near(const placer *, const quern_real lower[3], const quern_real upper[3],
	quern_real reach, quern_spot *out, uint32_t cap);
/* All of them, n, to free(); NULL if memory is gone. */
quern_spot *quern_placer_seeds(
	const placer *, const quern_real lower[3], const quern_real upper[3], quern_real reach, uint32_t *n);
/* The same in the order in which they were added: whoever adds them in an order of its own gets the same seeds wherever the places
 * beside a cell's face round to. */
quern_spot *quern_placer_seeds_in_order(
	const placer *, const quern_real lower[3], const quern_real upper[3], quern_real reach, uint32_t *n);
