/* SPDX-License-Identifier: MIT */
/* material_kit - materials without a scene: points in columns, tensors in long double to check them with, and random
 * states that are the same everywhere */
#pragma once
#include "plugin_alone.h"
#include "table.h"
#include <quern/material.h>

enum { POINTS = 100000, COLUMNS = 19, FIELDS = 4 };
enum { MU_I, DRUCKER_PRAGER, ELASTIC, MATERIALS };
extern const char *const ids[MATERIALS];

typedef struct law {
	const quern_plugin *plugin;
	const quern_material_ops *ops;
	quern_real *self;
	uint32_t dim;
	quern_real bulk, shear, density;
} law;

/* Defaults, then what is given; `values` ends with a NULL name. */
law try_law(const char *id, uint32_t dim, const alone_value *values, quern_status *status);
law make_law(const char *id, uint32_t dim, const alone_value *values);
/* The constants of most tests: bulk modulus 1e8 Pa, 1500 kg/m^3, grains of 5 mm and 2450 kg/m^3. */
law usual_law(const char *id, uint32_t dim);
double param(const law *, const char *name);
void free_law(law *);

typedef struct cloud {
	uint32_t n, cap, n_fields, n_columns;
	quern_real *memory, *gradient[9], *grid_density, *density, *stress[6], *wave_speed, *energy;
	const quern_real *mean_pressure; /* NULL: none, and a test's own */
	const char *field[FIELDS];       /* of history and output, by name */
	quern_column history[FIELDS], use[2 * FIELDS];
} cloud;

cloud make_cloud(const law *m, uint32_t n);
void free_cloud(cloud *c);
quern_column *history(cloud *c, const char *field);
/* Calls the material on points [first, first + n), which begin at a multiple of the lanes. */
void call(const law *m, cloud *c, int hook, double dt, uint32_t first, uint32_t n);
void update(const law *m, cloud *c, double dt);
void assign(const law *m, cloud *c);

typedef long double wide;
typedef struct matrix {
	wide x[3][3];
} matrix;
extern const matrix none, unit;

matrix times(matrix a, matrix b);
matrix transposed(matrix a);
/* a + f b, on the first `dim` axes */
matrix plus(uint32_t dim, matrix a, wide f, matrix b);
matrix scaled(uint32_t dim, wide f, matrix a);
wide trace(uint32_t dim, matrix a);
matrix deviator(uint32_t dim, matrix a);
wide product(matrix a, matrix b);
wide norm(matrix a);
wide shear_of(uint32_t dim, matrix a);
wide minor2(matrix a);
wide determinant(uint32_t dim, matrix a);
/* Sylvester's criterion */
bool positive(uint32_t dim, matrix a);
matrix inverse(uint32_t dim, matrix a);
/* t - 1, for the largest t of det(a + t I) = 1 with a symmetric deviator */
wide isochoric(uint32_t dim, matrix a);
/* (J^2 - 1)/2 - ln J at J = 1 + e */
wide volume_energy(wide e);
wide largest(wide a, wide b);

/* Entry i of SYMMETRIC columns, and of the velocity gradient. */
matrix get(uint32_t dim, quern_real *const *columns, uint32_t i);
void put(uint32_t dim, quern_real *const *columns, uint32_t i, matrix a);
matrix get_gradient(uint32_t dim, const cloud *c, uint32_t i);
void put_gradient(uint32_t dim, const cloud *c, uint32_t i, matrix a);

extern uint64_t state; /* of the random numbers; not zero */
double uniform(void);
double between(double a, double b);
/* spread evenly over the powers of two from 2^low to 2^high */
double sized(int low, int high);
matrix random_matrix(uint32_t dim, double size);
/* a symmetric deviator with sqrt(s:s/2) = size */
matrix random_deviator(uint32_t dim, double size);
matrix random_rotation(uint32_t dim);
/* Any state the material may be in, and a step of any size up to a strain of `most`; dt = 1e-4. */
void randomise(int which, const law *m, cloud *c, double most);
