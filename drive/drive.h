/* SPDX-License-Identifier: MIT */
/* drive - one material point along a path of strain or stress, without a grid or a solver. docs/drive.md
 *
 * Signs and components are those of fields: tension and stretch are positive; xx, yy, zz, xy, yz, xz in 3-D, xx, yy, xy in 2-D. */
#pragma once
#include "command.h"
#include "loader.h"
#include "options.h"
#include "param.h"
#include "scene.h"
#include "text.h"
#include <quern/material.h>

extern const quern_command quern_command_drive;

enum { DRIVE_MOST_COMPONENTS = 6, DRIVE_MOST_LEGS = 10000, DRIVE_MOST_STEPS = 1000000 };

/* "xx" of component c, and its two axes. */
const char *quern_drive_component(uint32_t dim, uint32_t c);
void quern_drive_axes(uint32_t dim, uint32_t c, uint32_t axis[2]);
uint32_t quern_drive_components(uint32_t dim);

/* ==== paths ==== */

/* What is given of one component; the rest of it is what the material makes of that. */
typedef enum {
	DRIVE_STRAIN, /* its strain; 0 where nobody names it */
	DRIVE_STRESS, /* its stress: the strain is sought */
	DRIVE_ALIKE /* one strain for all normal components that are so, sought such that the mean pressure is what is given */
} drive_control;

/* Where a straight piece of the path ends. A target is a strain or a stress, as the component's control says. */
typedef struct drive_leg {
	double time; /* s, since the beginning */
	double target[DRIVE_MOST_COMPONENTS], pressure;
} drive_leg;

typedef struct drive_path {
	uint32_t dim;
	drive_control control[DRIVE_MOST_COMPONENTS];
	/* A sliding of layers, L_xy alone: strain and rotation; strains of such a component are the slide, twice the tensor's. */
	bool slide[DRIVE_MOST_COMPONENTS];
	bool pressed;      /* the mean pressure is given: some components are DRIVE_ALIKE */
	drive_leg start;   /* stresses of the beginning, isotropic unless a table says otherwise; strains 0 */
	drive_leg *leg;    /* free() */
	uint32_t n, steps; /* legs; steps of each */
	int follow;        /* the component whose strain is `way`; -1: there is no such number */
	double sign;       /* of it, so that compressing is positive where it is what the path is about */
} drive_path;

/* What the command line says of a path by name. NAN, NULL: nothing. */
typedef struct drive_wish {
	const char *name;   /* of a path */
	const char *strain; /* ways, with commas between: 5%,-5%,0 */
	const char *stress;
	const char *hold; /* "volume", "pressure" */
	double pressure, rate, time;
	double bulk; /* Pa, of the material: by it the pressure is chosen where nobody gives one */
	int64_t steps;
} drive_wish;

extern const char *const quern_drive_paths[]; /* NULL-terminated */
/* False, with one sentence, where wishes do not go together or cannot be read. */
bool quern_drive_path_make(drive_path *, const drive_wish *, uint32_t dim, quern_units *, quern_text *why);
/* A table of way points: a line of column names, then a line for each; commas between, # begins a comment. `text` need not end
 * with a zero. False with one sentence that names the line. Its start is isotropic at `pressure`, Pa, unless a row of time 0 says
 * other stresses. */
bool quern_drive_table_read(
	const char *text, size_t length, uint32_t dim, double pressure, drive_path *, quern_text *why);
void quern_drive_path_finish(drive_path *);

/* ==== the material ==== */

typedef struct drive_material {
	quern_loader *loader; /* NULL where the scene has it */
	quern_scene *scene;   /* NULL where the command line names the plugin */
	quern_units *units;
	quern_tree *tree;
	quern_report *report; /* where its faults are, unless they are the scene's */
	const quern_plugin_file *file;
	const quern_material_ops *ops;
	void *self;
	uint32_t dim;
	bool ready;
	double bulk, shear, density; /* Pa, Pa, kg/m^3 without stress */
} drive_material;

/* material.NAME, NAME or a path, with parameters KEY=VALUE; false once the faults were printed. Finish it in any case. */
bool quern_drive_material_open(drive_material *, const char *name, uint32_t dim, const quern_texts *sets);
/* That of a scene's continuum. */
bool quern_drive_material_of(drive_material *, const char *scene, const quern_texts *sets);
void quern_drive_material_finish(drive_material *);

/* ==== the point ==== */

/* A column of state that the material keeps, or of what it says for others. */
typedef struct drive_field {
	const char *name, *unit; /* "point.volume_strain" */
	uint8_t shape;
	quern_column column;
} drive_field;

typedef struct drive_point {
	const drive_material *material;
	quern_real *memory, *kept; /* all columns, padded to QUERN_LANES; and a copy to go back to */
	size_t size;               /* numbers in it */
	quern_real *gradient[9], *stress[6], *density, *grid_density, *wave_speed, *energy;
	drive_field field[QUERN_MOST_USES];
	uint32_t n_fields;
	quern_column use[2][QUERN_MOST_USES]; /* by hook */
	double mass;                          /* kg/m^3 of the volume at the beginning */
	double volume, kept_volume;           /* over that at the beginning, by the deformation alone */
} drive_point;

/* In the state of `path->start`; false with one sentence if the material cannot be in it. Finish it in any case. */
bool quern_drive_point_begin(drive_point *, const drive_material *, const drive_path *, quern_text *why);
void quern_drive_point_finish(drive_point *);
void quern_drive_point_keep(drive_point *);
/* To the state that was kept last. */
void quern_drive_point_back(drive_point *);
/* From what was kept, one step with these increments of strain. */
void quern_drive_point_step(drive_point *, const drive_path *, const double *strain, double dt);
double quern_drive_point_pressure(const drive_point *);
/* sqrt(s:s/2) of the deviator of symmetric components */
double quern_drive_shear_of(uint32_t dim, const double *symmetric);

/* ==== along the path ==== */

/* What was met, step by step: rows of `n_columns` numbers. */
typedef struct drive_record {
	quern_text head; /* names with units, commas between */
	double *data;
	size_t n_rows, n_columns, capacity;
	uint32_t most_tries; /* evaluations in one step, at most */
} drive_record;

/* A residual counts as zero at this share of the largest stress so far, or at this share of the bulk modulus. */
static const double drive_tolerance = 1e-10, drive_floor = 1e-14;

/* False with one sentence where no strain gives the stress that is asked for, or a number is not finite; what came before is
 * in the record. Finish it in any case. */
bool quern_drive_walk(drive_point *, const drive_path *, drive_record *, quern_text *why);
void quern_drive_record_finish(drive_record *);
