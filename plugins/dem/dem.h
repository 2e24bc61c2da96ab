/* SPDX-License-Identifier: MIT */
/* dem - the grain solver's own parameters and its stages, shared by its source files */
#pragma once
#include "../bodies/bodies.h"
#include "../common/account.h"
#include "../common/radius.h"
#include "../common/source.h"
#include "../common/tools.h"
#include "rows.h"
#include <quern/contact.h>
#include <quern/integrator.h>
#include <quern/neighbours.h>
#include <quern/packer.h>

enum { MOST_MATERIALS = 16 };

typedef struct dem_material {
	const char *name; /* NULL: the only one, which needs none */
	quern_real density;
	radius_law radii;
} dem_material;

typedef struct dem {
	quern_real skin, step, rest,
		settle_step; /* from the scene; step: NaN if it leaves that to the integrator */
	dem_material alone;
	quern_list materials, pairs, fill, place, source;
	const char *file, *from;
	quern_real overlap_most, overlap_start; /* over the smaller radius */
	int32_t settle_most;
	bool mixed;    /* there are several materials */
	bool fixed;    /* some grains do not move */
	bool features; /* some bodies have several */
	bool moving;   /* some bodies do */
	bool outlets, sources;
	bool blends; /* some sources pour several materials */
	bool settles;
	bool boxed; /* the domain is strained: box.c */
	quern_real box_shear, box_pressure, box_packing, box_rate, box_inertia,
		box_damping; /* from the scene; NaN: not given */
	int32_t box_along;
	quern_real reach;   /* m, of the laws beyond touching */
	quern_real largest; /* m, radius of the largest grain that the scene itself brings */
	quern_real height;  /* m, of the fill, or of the domain where there is none */
	quern_real sinks,
		stiffness;        /* overlap under the fill's weight over the diameter; N/m, of all laws there */
	const char *stiffest; /* of the laws */
	uint32_t dim;
	/* ---- materials.c ---- */
	uint64_t stream;
	const dem_material *material; /* the first stands for all where one number must do */
	uint32_t n_materials;
	int32_t pair[MOST_MATERIALS][MOST_MATERIALS]; /* item of `pairs` for grains of both, or -1 */
	int32_t *on_body;                             /* the same by body and by material of the grain */
} dem;

typedef struct dem_word {
	const char *name;
} dem_word;

/* Two materials whose contacts have parameters of their own. */
typedef struct dem_pair {
	quern_list between; /* of dem_word */
} dem_pair;

typedef struct dem_share {
	const char *name;
	quern_real share; /* of the mass */
} dem_share;

/* Of what grains are: of one material, or of several. */
typedef struct dem_blend {
	const char *material;
	quern_list mix;                   /* of dem_share */
	quern_real share[MOST_MATERIALS]; /* of the mass, by material; they add up to 1 */
} dem_blend;

typedef struct dem_fill {
	quern_real lower[3], upper[3]; /* m, of the box around its region */
	quern_real velocity[3];
	quern_list above;
	bool settle, fixed;
	dem_blend of;
} dem_fill;

typedef struct dem_source {
	source base;
	dem_blend of;
} dem_source;

typedef struct dem_place {
	quern_real position[3], velocity[3], spin[3], radius;
	bool fixed;
	const char *material;
	int32_t kind; /* number of the material */
} dem_place;

/* slots, in the order of the solver's table */
enum {
	SLOT_REGION,
	SLOT_SOURCE_REGION,
	SLOT_CONTACT,
	SLOT_NEIGHBOURS,
	SLOT_INTEGRATOR,
	SLOT_BODIES,
	SLOT_PACKER,
	SLOT_SETTLING,
	SLOT_SOURCE_PACKER
};

/* The integrator of this step. */
QUERN_INLINE const quern_bound *dem_integrator(const quern_step *s) {
	return &s->slot[s->settling ? SLOT_SETTLING : SLOT_INTEGRATOR][0];
}

/* The grains with rows of dem.fill; `weight` NULL: all of what each is. */
QUERN_INLINE cloud dem_cloud(const quern_step *s, const quern_real *weight) {
	return (cloud) { s->use[FILL_MASS].real[0], weight, s->use[FILL_FIXED].index,
		s->host->set(s->run, "grain").n, "grain" };
}

/* What law to take for item `item` of the pairs (-1: none) and a body (-1: between grains): the contact's own instance. */
QUERN_INLINE const void *dem_law(const quern_bound *law, int32_t item, int32_t body) {
	const bool on_body = body >= 0 && law->n_variant;
	if (item >= 0)
		return law->refined[(uint32_t)item * (1 + law->n_variant) + (on_body ? 1 + (uint32_t)body : 0)];
	return on_body ? law->variant[body] : law->self;
}

/* The pairs' item for two grains, or for a grain on a body; `material` is NULL where there is one alone. */
QUERN_INLINE int32_t dem_item(const dem *d, const int32_t *material, int32_t first, int32_t second) {
	return material ? d->pair[material[first]][material[second]] : d->pair[0][0];
}
QUERN_INLINE int32_t dem_item_on(const dem *d, const int32_t *material, int32_t grain, int32_t body) {
	return d->on_body[(uint32_t)body * d->n_materials + (material ? (uint32_t)material[grain] : 0)];
}

/* m, of the material that stands for all */
QUERN_INLINE quern_real dem_diameter(const dem *d) { return 2 * d->material[0].radii.mean; }

quern_status quern_dem_fill(const void *self, const quern_step *);
/* Grains of another run's state, which are there before the fill: checks and adopts them. */
quern_status quern_dem_begin(const dem *, const quern_step *);
quern_status quern_dem_pour(const void *self, const quern_step *);
quern_status quern_dem_outlets(const void *self, const quern_step *);
quern_status quern_dem_open(const void *self, const quern_step *);
quern_status quern_dem_neighbours(const void *self, const quern_step *);
quern_status quern_dem_forces(const void *self, const quern_step *);
/* Ends the run for a grain that is out of the domain along an axis. */
quern_status quern_dem_left(const quern_step *, int64_t id, uint32_t axis, quern_real x);
quern_status quern_dem_list(const void *self, const quern_step *);
quern_status quern_dem_observe(const void *self, const quern_step *);
/* What is worth a look while a run goes: look.c. */
extern const quern_output quern_dem_looks[];
void quern_dem_look_at_run(const void *self, const quern_step *, quern_real *out);
bool quern_dem_settled(const void *self, const quern_step *);
quern_real quern_dem_settling(const void *self, const quern_step *);
quern_real quern_dem_limit(const void *self, const quern_step *, quern_real *hard, char reason[160]);
/* s, the recommended step before there are grains, from parameters alone: of the lightest grains that the materials in the bits of
 * `expected` may bring. The step's slots, gravity and domain are looked at, and no set. INFINITY: no law limits it. */
quern_real quern_dem_expected_step(const dem *, const quern_step *, uint64_t expected);

/* ---- box.c ---- */
/* Whether the scene may strain the domain; says in `boxed` whether it does. */
quern_status quern_dem_box_check(dem *, const quern_setup *, quern_err *);
quern_status quern_dem_box_bodies(const dem *, const quern_setup *, uint32_t n_bodies, quern_err *);
/* The box is the domain once all grains are there. */
quern_status quern_dem_box_begin(const dem *, const quern_step *);
/* Whether a box read from a file, with rows of dem.fill, is one to go on with. */
bool quern_dem_box_holds(const quern_step *);
quern_status quern_dem_box_strain(const void *self, const quern_step *);
/* With rows of dem.neighbours, like all that follow: brings grains back into the box, with the velocities of the images that they are then. */
void quern_dem_box_bring_back(const quern_step *);
/* Makes of a job one whose images lie along the axes, in which all pairs that are near are near too; false if memory is gone. */
bool quern_dem_box_straighten(const quern_step *, quern_neighbour_job *);
/* Keeps of n pairs those whose nearest images are closer than the sum of their radii and `reach`; returns how many. */
uint32_t quern_dem_box_keep_near(const quern_step *, quern_real reach, uint32_t n, quern_pair *);
/* Notes the box for which a list was made, and the largest distance (m) at which two grains act on each other. */
void quern_dem_box_list(const quern_step *, quern_real widest);
/* m, such as `way`, the farthest way of a grain beside the box's own strain, with what that strain does to pairs. */
quern_real quern_dem_box_moved(const quern_step *, quern_real way);

/* ---- grain_file.c ---- */
typedef struct grain_table {
	dem_place *grain;
	uint32_t n, cap;
} grain_table;
/* Reads "x y [z] radius ..." columns; on a fault returns false with one sentence in `why`. Velocities, spins and
 * `fixed` may be left out; a missing radius is NaN. */
bool quern_grain_table_read(const char *data, size_t length, const dem *, grain_table *, char why[200]);
bool quern_grain_table_load(const char *path, const dem *, grain_table *, char why[200]);
void quern_grain_table_finish(grain_table *);

/* ---- materials.c ---- */
/* The number of a material by its name (NULL: the first), or -1. */
int32_t quern_dem_material(const dem *, const char *name);
/* Materials, and who is of which: names become numbers. */
quern_status quern_dem_name_materials(dem *, const quern_setup *, quern_err *);
/* Which pair of materials, or of a material and a body's, has what item of `pairs`; takes memory, which `part` frees. */
quern_status quern_dem_pair_up(
	dem *, const quern_setup *, const quern_bound *body, uint32_t n_bodies, quern_err *);
void quern_dem_part(dem *);
/* Whether a source brings a material. */
bool quern_dem_pours(const dem *, uint32_t material);
/* m, the widest mean of these shares; the widest grain that they may bring, or (NULL) that any material may */
quern_real quern_dem_widest(const dem *, const quern_real share[MOST_MATERIALS]);
quern_real quern_dem_most(const dem *, const quern_real *share);
/* Streams of random numbers for the radii of fills and of sources; behind each comes that of its packers. */
enum { STREAM_FILLS, STREAM_SOURCES = 2, STREAM_MIX = 4 };
/* The radius of draw k if it is of material m. */
quern_real quern_dem_radius(const dem *, uint32_t m, const quern_host *, uint32_t stream, uint64_t k);
/* The material of the next grain, draw k, where `placed` kg of each are there already: no share is missed by more than a grain. */
int32_t quern_dem_mix(const dem *, const quern_real share[MOST_MATERIALS],
	const quern_real placed[MOST_MATERIALS], const quern_host *, uint32_t stream, uint64_t k);
