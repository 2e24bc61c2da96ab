/* SPDX-License-Identifier: MIT */
/* drive_point - what a solver keeps of one point, and the calls by which a solver asks the material */
#include "drive.h"
#include "watch.h"
#include <math.h>
#include <quern/columns.h>
#include <stdlib.h>
#include <string.h>

/* What the material may not find before its beginning is otherwise than what it asks for. */
static const double begins_at = 1e-6;

static void fill(quern_real *column, double value) {
	for (uint32_t i = 0; column && i < QUERN_LANES; i++) column[i] = value;
}

/* ---- columns ---- */

/* A row that is of no kind of number, or hangs on what is not here, has no column. */
static bool counts(const drive_material *m, const quern_use *row) {
	const quern_param *when = row->when ? quern_param_find(m->file->params, row->when) : NULL;
	if (row->when && !(when && quern_param_number(when, m->self) != 0)) return false;
	return !row->with && !(row->flags & QUERN_EXISTS) && row->shape != QUERN_INDEX && row->shape != QUERN_ID;
}

static drive_field *field_of(drive_point *p, const char *name) {
	for (uint32_t f = 0; f < p->n_fields; f++)
		if (!strcmp(p->field[f].name, name)) return &p->field[f];
	return NULL;
}

static bool is_diagonal(uint8_t shape, uint32_t dim, uint32_t c) {
	if (shape == QUERN_SYMMETRIC) return c < dim;
	return shape != QUERN_TENSOR || c % (dim + 1) == 0;
}

/* Two rows of one field, as of update and assign, are one column. */
static quern_real *put_fields(drive_point *p, quern_real *next) {
	const quern_use *rows = p->material->file->uses;
	const uint32_t dim = p->material->dim;
	for (uint32_t r = 0; rows[r].field; r++) {
		if (!counts(p->material, &rows[r]) || rows[r].hook > QUERN_MATERIAL_ASSIGN) continue;
		drive_field *f = field_of(p, rows[r].field);
		if (!f) {
			f = &p->field[p->n_fields++];
			*f = (drive_field) {
				.name = rows[r].field, .unit = rows[r].unit ? rows[r].unit : "1", .shape = rows[r].shape
			};
			for (uint32_t c = 0; c < quern_shape_size(f->shape, dim); c++, next += QUERN_LANES) {
				f->column.real[c] = next;
				fill(next, is_diagonal(f->shape, dim, c) ? rows[r].initial : 0);
			}
		}
		p->use[rows[r].hook][r] = f->column;
	}
	return next;
}

static void put_columns(drive_point *p) {
	const uint32_t dim = p->material->dim;
	const size_t most = 9 + DRIVE_MOST_COMPONENTS + 4 + 9 * (size_t)QUERN_MOST_USES;
	p->size = most * QUERN_LANES;
	p->memory = aligned_alloc(64, p->size * sizeof *p->memory);
	p->kept = quern_take(p->size, sizeof *p->kept);
	if (!p->memory) abort();
	memset(p->memory, 0, p->size * sizeof *p->memory);
	quern_real *next = p->memory;
	for (uint32_t c = 0; c < dim * dim; c++, next += QUERN_LANES) p->gradient[c] = next;
	for (uint32_t c = 0; c < quern_drive_components(dim); c++, next += QUERN_LANES) p->stress[c] = next;
	quern_real **const one[] = { &p->density, &p->grid_density, &p->wave_speed, &p->energy };
	for (size_t k = 0; k < sizeof one / sizeof *one; k++, next += QUERN_LANES) *one[k] = next;
	next = put_fields(p, next);
	p->size = (size_t)(next - p->memory);
}

/* ---- calls ---- */

static void call(drive_point *p, uint32_t hook, double dt) {
	const drive_material *m = p->material;
	const bool update = hook == QUERN_MATERIAL_UPDATE;
	quern_material_batch b = { .n = 1,
		.cap = QUERN_LANES,
		.dt = update ? dt : 0,
		.grid_density = update ? p->grid_density : NULL,
		.density = p->density,
		.wave_speed = p->wave_speed,
		.energy = p->energy,
		.use = p->use[hook] };
	for (uint32_t c = 0; c < 9 && update; c++) b.gradient[c] = p->gradient[c];
	for (uint32_t c = 0; c < DRIVE_MOST_COMPONENTS; c++) b.stress[c] = p->stress[c];
	quern_watch_enter(m->file->plugin.id, update ? "update" : "assign");
	(update ? m->ops->update : m->ops->assign)[m->dim - 2](m->self, &b);
	quern_watch_leave();
}

/* L dt, row-major */
static void put_gradient(drive_point *p, const drive_path *path, const double *strain, double f[3][3]) {
	const uint32_t dim = p->material->dim;
	memset(f, 0, 9 * sizeof(double));
	for (uint32_t c = 0; c < quern_drive_components(dim); c++) {
		uint32_t at[2];
		quern_drive_axes(dim, c, at);
		f[at[0]][at[1]] = strain[c];
		if (!path->slide[c]) f[at[1]][at[0]] = strain[c];
	}
}

static double determinant(double f[3][3]) {
	double det = 0;
	for (int a = 0; a < 3; a++) {
		const int b = (a + 1) % 3, c = (a + 2) % 3;
		det += f[0][a] * (f[1][b] * f[2][c] - f[1][c] * f[2][b]);
	}
	return det;
}

void quern_drive_point_keep(drive_point *p) {
	memcpy(p->kept, p->memory, p->size * sizeof *p->memory);
	p->kept_volume = p->volume;
}

void quern_drive_point_back(drive_point *p) {
	memcpy(p->memory, p->kept, p->size * sizeof *p->memory);
	p->volume = p->kept_volume;
}

/* As a solver does it: V *= det(1 + dt L), and then the material is asked. Around a point alone the grid is as dense as its
 * deformation says, whatever the material makes of that. */
void quern_drive_point_step(drive_point *p, const drive_path *path, const double *strain, double dt) {
	const uint32_t dim = p->material->dim;
	double f[3][3];
	memcpy(p->memory, p->kept, p->size * sizeof *p->memory);
	put_gradient(p, path, strain, f);
	for (uint32_t a = 0; a < dim; a++)
		for (uint32_t b = 0; b < dim; b++) fill(p->gradient[a * dim + b], f[a][b] / dt);
	for (int a = 0; a < 3; a++) f[a][a] += 1;
	const double grown = determinant(f);
	p->volume = p->kept_volume * grown;
	fill(p->density, p->density[0] / grown);
	fill(p->grid_density, p->mass / p->volume);
	call(p, QUERN_MATERIAL_UPDATE, dt);
}

double quern_drive_point_pressure(const drive_point *p) {
	double sum = 0;
	for (uint32_t c = 0; c < p->material->dim; c++) sum += p->stress[c][0];
	return sum < 0 || sum > 0 ? -sum / p->material->dim : sum;
}

double quern_drive_shear_of(uint32_t dim, const double *s) {
	double mean = 0, sum = 0;
	for (uint32_t c = 0; c < dim; c++) mean += s[c] / dim;
	for (uint32_t c = 0; c < quern_drive_components(dim); c++)
		sum += c < dim ? 0.5 * (s[c] - mean) * (s[c] - mean) : s[c] * s[c];
	return sqrt(sum);
}

/* ---- the beginning ---- */

static bool is_what_was_asked(const drive_point *p, const drive_path *path, quern_text *why) {
	const uint32_t dim = p->material->dim;
	double most = 0;
	for (uint32_t c = 0; c < quern_drive_components(dim); c++) most = fmax(most, fabs(path->start.target[c]));
	for (uint32_t c = 0; c < quern_drive_components(dim); c++) {
		if (fabs(p->stress[c][0] - path->start.target[c]) <= begins_at * most) continue;
		quern_text_add(why,
			"%s cannot begin with stress_%s = %g Pa: of all that is asked it leaves %g Pa there, for the rest is tension or beyond yield",
			p->material->file->plugin.id, quern_drive_component(dim, c), path->start.target[c],
			p->stress[c][0]);
		return false;
	}
	return true;
}

bool quern_drive_point_begin(
	drive_point *p, const drive_material *material, const drive_path *path, quern_text *why) {
	*p = (drive_point) { .material = material, .volume = 1 };
	put_columns(p);
	fill(p->density, material->density);
	for (uint32_t c = 0; c < quern_drive_components(material->dim); c++)
		fill(p->stress[c], path->start.target[c]);
	call(p, QUERN_MATERIAL_ASSIGN, 0);
	p->mass = p->density[0];
	quern_drive_point_keep(p);
	return is_what_was_asked(p, path, why);
}

void quern_drive_point_finish(drive_point *p) {
	free(p->memory);
	free(p->kept);
}
