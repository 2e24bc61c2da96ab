/* forces - what the parts of the force stage share: pairs of grains, grains on bodies, integration */
#pragma once
#include "dem.h"
#include <quern/vec.h>

enum { GRAINS = 128 }; /* integrated at once */
enum { E_KINETIC, E_POTENTIAL, E_STORED, E_SHEARED, E_DAMPED, E_RUBBED, N_ENERGIES };

/* What all blocks share. */
typedef struct forces_shared {
	const dem *d;
	const quern_step *s;
	const quern_column *use;
	uint32_t cap, most_grains, n_bodies, n_laws;
	bool spin, energy, couple;
	quern_real half[3],
		length[3]; /* periodic: half the domain's length and the length; infinite and 0 otherwise */
	const uint32_t *grain, *contact, *touch; /* partitions */
	quern_real *impulse;  /* [block][body + 1][dim]: on the material, by bodies and by fixed grains */
	quern_real *sums;     /* [block][N_ENERGIES] */
	quern_real *farthest; /* [block] square of the way since the last list */
	quern_real *turned;   /* [block][2] sums of m v.v', of old and new velocity, and of m */
	int32_t *bad;         /* [block] first grain that is lost, or -1 */
} forces_shared;

/* A law's own columns of a batch: of the contacts, or of the first and of the second grains. */
typedef struct law_row {
	void *mine[9], *other[9];
} law_row;

/* A worker's columns: `cap` pairs, then a block's sums. */
typedef struct forces_work {
	quern_real *overlap, *normal[3], *velocity[3], *spin[3], *turn[3], *radius, *mass, *weight, *arm[2];
	quern_real *force[3], *couple[3], *dashpot[3], *drag_couple[3], *stored, *sheared, *rubbed, *torque[3],
		*drag_torque[3];
	law_row *rows; /* of all laws, one after the other */
	int32_t *first, *second, *slot, *feature;
	quern_real (*row)[8], (*drag_row)[8]; /* per grain of the block, one more for partners outside */
	quern_real *grains[34];
} forces_work;

/* Adds what the contacts of block b do to its rows, and to its energies. */
void quern_dem_pairs(const forces_shared *, forces_work *, uint32_t b, quern_real *sums);
void quern_dem_touches(const forces_shared *, forces_work *, uint32_t b, quern_real *sums);
/* Moves the grains of block b. */
void quern_dem_integrate(const forces_shared *, forces_work *, uint32_t b, quern_real *sums);

/* ---- laws.c: shared by pairs and touches ---- */
bool quern_dem_is_history(const quern_use *);
/* Calls all laws for n contacts, whose slots are places from `begin` on in the list; `body`: the one touched, or -1. What
 * was left out of the n_slots forgets, what was kept remembers. */
void quern_dem_call_laws(
	const forces_shared *, forces_work *, int32_t body, uint32_t begin, uint32_t n_slots, uint32_t n);
/* Adds couples to the rows of the grains first .. last; a partner outside goes to the spare row. */
void quern_dem_add_couples(const forces_shared *, const forces_work *, quern_real (*row)[8],
	quern_real *const couple[3], int32_t body, uint32_t first, uint32_t last, uint32_t n);
/* Stores what the pairs kept were given, such as their force; the others get zero. */
void quern_dem_keep(const forces_work *, quern_real *const given[3], quern_column out, uint32_t components,
	uint32_t begin, uint32_t n_slots, uint32_t n);
/* Books energies of the pairs whose first grain is in [first, last), and what springs that opened still held. */
void quern_dem_book(const forces_shared *, const forces_work *, quern_column held, uint32_t begin,
	uint32_t n_slots, uint32_t n, uint32_t first, uint32_t last, const int32_t *first_of, quern_real *sums);

/* Torque over lever: -(n x f), for the first and the second alike. */
QUERN_INLINE void dem_torques(
	const forces_work *w, quern_real *const force[3], quern_real *const out[3], uint32_t n, const int dim) {
	const quern_real *restrict nx = w->normal[0], *restrict ny = w->normal[1], *restrict nz = w->normal[2];
	const quern_real *restrict fx = force[0], *restrict fy = force[1], *restrict fz = force[2];
	quern_real *restrict tx = out[0], *restrict ty = out[1], *restrict tz = out[2];
	if (dim == 2) {
		QUERN_SIMD
		for (uint32_t q = 0; q < n; q++) tx[q] = ny[q] * fx[q] - nx[q] * fy[q];
	} else {
		QUERN_SIMD
		for (uint32_t q = 0; q < n; q++) {
			tx[q] = nz[q] * fy[q] - ny[q] * fz[q];
			ty[q] = nx[q] * fz[q] - nz[q] * fx[q];
			tz[q] = ny[q] * fx[q] - nx[q] * fy[q];
		}
	}
}
