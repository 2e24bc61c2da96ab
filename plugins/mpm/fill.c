/* fill - the first points: a lattice in each region, with the stress of the overburden if wished */
#include "mpm.h"
#include <math.h>
#include <string.h>

typedef struct {
	uint32_t count[3], n;
	quern_real spacing[3];
} lattice;

static lattice lattice_of(const mpm *p, const mpm_fill *item) {
	lattice l = { .count = { 1, 1, 1 }, .n = 1 };
	for (uint32_t k = 0; k < p->dim; k++) {
		const quern_real extent = item->upper[k] - item->lower[k], wanted = extent / p->cell * p->points;
		l.count[k] = wanted > 1 ? (uint32_t)(wanted + 0.5) : 1;
		l.spacing[k] = extent / l.count[k];
		l.n *= l.count[k];
	}
	return l;
}

/* The axis along which gravity acts, and its sign; -1 if it is askew. */
static int gravity_axis(const quern_step *s, quern_real *g) {
	int axis = -1;
	for (uint32_t k = 0; k < s->dim; k++)
		if (s->gravity[k] != 0) {
			if (axis >= 0) return -1;
			axis = (int)k;
			*g = s->gravity[k];
		}
	return axis;
}

static void place(const mpm *p, const quern_step *s, const mpm_fill *item, const lattice *l, uint32_t first) {
	const quern_column *u = s->use;
	quern_real volume = 1, g = 0;
	const int axis = gravity_axis(s, &g);
	for (uint32_t k = 0; k < p->dim; k++) volume *= l->spacing[k];
	for (uint32_t i = 0; i < l->n; i++) {
		const uint32_t at[3] = { i % l->count[0], i / l->count[0] % l->count[1],
			i / (l->count[0] * l->count[1]) };
		for (uint32_t k = 0; k < p->dim; k++) {
			u[FILL_POSITION].real[k][first + i] = item->lower[k] + (at[k] + 0.5) * l->spacing[k];
			u[FILL_VELOCITY].real[k][first + i] = item->velocity[k];
		}
		u[FILL_MASS].real[0][first + i] = p->density * volume;
		u[FILL_VOLUME].real[0][first + i] = volume;
		if (item->stress != STRESS_AT_REST || axis < 0) continue;
		const quern_real x = u[FILL_POSITION].real[axis][first + i];
		const quern_real depth = g < 0 ? item->upper[axis] - x : x - item->lower[axis];
		const quern_real pressure = p->density * fabs(g) * depth;
		for (uint32_t k = 0; k < p->dim; k++)
			u[FILL_STRESS].real[k][first + i] = -pressure * ((int)k == axis ? 1 : item->lateral);
	}
}

/* History and volume that go with the stress. */
static quern_status assign(const quern_step *s, uint32_t n) {
	enum { CHUNK = 64, MOST_ROWS = 8 };
	const quern_bound *material = &s->slot[SLOT_MATERIAL][0];
	const quern_material_ops *ops = material->ops;
	const quern_column *u = s->use;
	_Alignas(64) quern_real density[CHUNK], wave[CHUNK], energy[CHUNK];
	for (uint32_t i = 0; i < n; i += CHUNK) {
		quern_column own[MOST_ROWS];
		const uint32_t m = n - i < CHUNK ? n - i : CHUNK;
		quern_material_batch b = {
			.n = m, .cap = CHUNK, .density = density, .wave_speed = wave, .energy = energy, .use = own
		};
		for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, s->dim); k++)
			b.stress[k] = u[FILL_STRESS].real[k] + i;
		for (uint32_t r = 0; r < material->n_uses && r < MOST_ROWS; r++)
			own[r] = quern_column_from(material->column[r], material->uses[r].shape, i);
		for (uint32_t k = 0; k < m; k++)
			density[k] = u[FILL_MASS].real[0][i + k] / u[FILL_VOLUME].real[0][i + k];
		ops->assign[s->dim - 2](material->self, &b);
		for (uint32_t k = 0; k < m; k++) {
			u[FILL_VOLUME].real[0][i + k] = u[FILL_MASS].real[0][i + k] / density[k];
			if (u[FILL_ENERGY].real[0]) u[FILL_ENERGY].real[0][i + k] = energy[k];
		}
	}
	return QUERN_OK;
}

/* A hybrid starts from all grains: its oracle decides where points go. */
quern_status quern_mpm_fill(const void *self, const quern_step *s) {
	const mpm *p = self;
	const mpm_fill *item = p->fill.items;
	uint64_t total = 0;
	s->use[FILL_UNSORTED].index[0] = 1;
	if (s->use[FILL_WEIGHT].real[0]) return QUERN_OK;
	for (uint32_t f = 0; f < p->fill.n; f++) {
		quern_real g = 0;
		total += lattice_of(p, &item[f]).n;
		if (item[f].stress == STRESS_AT_REST && gravity_axis(s, &g) < 0 && g != 0)
			return s->host->stop(s->run, QUERN_E_PARAM, NULL, -1,
				"continuum.fill: stress at_rest needs gravity along an axis");
	}
	if (!total) return s->host->stop(s->run, QUERN_E_PARAM, NULL, -1, "continuum: no points: give fill");
	if (total > 1u << 30)
		return s->host->stop(s->run, QUERN_E_PARAM, NULL, -1,
			"continuum.fill asks for %llu points: make cells larger", (unsigned long long)total);
	int32_t *from = s->host->memory(s->run, (total + 1) * sizeof(int32_t));
	if (!from) return QUERN_E_MEMORY;
	for (uint64_t i = 0; i < total; i++) from[i] = -1;
	const quern_status status = s->host->remap(s->run, "point", (uint32_t)total, from, 0, NULL);
	if (status != QUERN_OK) return status;
	for (uint32_t f = 0, first = 0; f < p->fill.n; f++) {
		const lattice l = lattice_of(p, &item[f]);
		place(p, s, &item[f], &l, first);
		first += l.n;
	}
	s->host->log(s->run, 0, "%llu points placed", (unsigned long long)total);
	return assign(s, (uint32_t)total);
}
