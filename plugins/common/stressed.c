/* SPDX-License-Identifier: MIT */
#include "stressed.h"
#include "tools.h"

enum { CHUNK = 64 };

void quern_stressed_assign(
	const stressed_points *p, const quern_bound *material, uint32_t dim, uint32_t begin, uint32_t n) {
	const quern_material_ops *ops = material->ops;
	_Alignas(64) quern_real density[CHUNK], wave[CHUNK], energy[CHUNK];
	for (uint32_t i = begin; i < begin + n; i += CHUNK) {
		const uint32_t m = begin + n - i < CHUNK ? begin + n - i : CHUNK;
		quern_column own[QUERN_MOST_USES];
		quern_material_batch b = {
			.n = m, .cap = CHUNK, .density = density, .wave_speed = wave, .energy = energy, .use = own
		};
		for (uint32_t k = 0; k < quern_shape_size(QUERN_SYMMETRIC, dim); k++)
			b.stress[k] = p->stress.real[k] + i;
		for (uint32_t r = 0; r < material->n_uses; r++)
			own[r] = quern_column_from(material->column[r], material->uses[r].shape, i);
		for (uint32_t k = 0; k < m; k++) density[k] = p->mass.real[0][i + k] / p->volume.real[0][i + k];
		ops->assign[dim - 2](material->self, &b);
		for (uint32_t k = 0; k < m; k++) {
			p->volume.real[0][i + k] = p->mass.real[0][i + k] / density[k];
			if (p->energy.real[0]) p->energy.real[0][i + k] = energy[k];
		}
	}
}
