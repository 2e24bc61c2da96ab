/* SPDX-License-Identifier: MIT */
/* pairs - contacts between grains of one block: the distance test, geometry and motion */
#include "packed.h"

/* ---- rows of grains ---- */

/* n columns of grains from `begin` on, whose rows are made at once. */
typedef struct {
	uint32_t begin, n;
	const quern_real *mass; /* kg, with the sign that rows have */
} packing;

/* Four rows, of four columns from entry i on; NULL: zeros. */
QUERN_INLINE void make_rows(const quern_real *const from[4], uint32_t i, lanes4 row[4]) {
	lanes4 column[4];
	for (int k = 0; k < 4; k++) column[k] = from[k] ? *packed_anywhere(from[k] + i) : (lanes4) { 0 };
	packed_turn(column, row);
}

/* Rows of four columns, `stride` apart. */
QUERN_INLINE void put_rows(lanes4 *to, size_t stride, const quern_real *const from[4], uint32_t n) {
	const uint32_t whole = n & ~3u;
	lanes4 row[4];
	for (uint32_t i = 0; i < whole; i += 4, to += 4 * stride) {
		make_rows(from, i, row);
		for (uint32_t k = 0; k < 4; k++) to[k * stride] = row[k];
	}
	if (whole == n) return;
	make_rows(from, whole, row);
	for (uint32_t k = 0; whole + k < n; k++) to[k * stride] = row[k];
}

/* Of velocities and spins, each from the first of these grains on. */
QUERN_INLINE void put_motions(lanes4 *motion, const quern_real *const v[3], const quern_real *const s[3],
	const packing *p, const int dim, const bool spin) {
	lanes4 *to = motion + packed_motions(dim) * (size_t)p->begin;
	const quern_real *const flat[4] = { v[0], v[1], spin ? s[0] : NULL, NULL },
							*const spatial[4] = { v[0], v[1], v[2], p->mass },
							*const turns[4] = { s[0], s[1], s[2], NULL };
	put_rows(to, packed_motions(dim), dim == 3 ? spatial : flat, p->n);
	if (dim == 3 && spin) put_rows(to + 1, 2, turns, p->n);
}

QUERN_INLINE void columns_from(
	const quern_column *column, uint32_t begin, const int n, const quern_real *out[3]) {
	for (int k = 0; k < 3; k++) out[k] = k < n ? column->real[k] + begin : NULL;
}

/* `to`: rows of motion by the state, which are those that dashpots see unless these are predicted. */
QUERN_INLINE void pack(
	const forces_shared *sh, const packing *p, lanes4 *to, const int dim, const bool spin) {
	const quern_real *x[3], *v[3], *s[3], *radius = sh->use[FORCE_RADIUS].real[0] + p->begin;
	columns_from(&sh->use[FORCE_OLD_POSITION], p->begin, dim, x);
	columns_from(&sh->use[FORCE_OLD_VELOCITY], p->begin, dim, v);
	columns_from(&sh->use[FORCE_OLD_SPIN], p->begin, !spin ? 0 : dim == 3 ? 3 : 1, s);
	const quern_real *const flat[4] = { x[0], x[1], radius, p->mass }, *const spatial[4] = { x[0], x[1], x[2],
		radius };
	put_rows(sh->place + p->begin, 1, dim == 3 ? spatial : flat, p->n);
	if (to) put_motions(to, v, s, p, dim, spin);
}

/* What dashpots see, as the integrator says. A fixed grain has no acceleration, whatever its forces are. */
QUERN_INLINE void pack_predicted(const forces_shared *sh, const packing *p, const int dim, const bool spin) {
	const quern_bound *bound = dem_integrator(sh->s);
	const int32_t *fixed = sh->use[FORCE_FIXED].index;
	const int turns = !spin ? 0 : dim == 3 ? 3 : 1;
	_Alignas(64) quern_real then[6][GRAINS];
	const quern_real *const v[3] = { then[0], then[1], then[2] }, *const s[3] = { then[3], then[4], then[5] };
	quern_column own[QUERN_MOST_USES];
	quern_integrator_batch batch = { .n = p->n, .cap = GRAINS, .dt = sh->s->dt, .use = own };
	for (uint32_t r = 0; r < bound->n_uses; r++)
		own[r] = quern_column_from(bound->column[r], bound->uses[r].shape, p->begin);
	for (int k = 0; k < dim; k++) batch.gravity[k] = sh->s->gravity[k], batch.new_velocity[k] = then[k];
	for (int k = 0; k < turns; k++) batch.new_spin[k] = then[3 + k];
	columns_from(&sh->use[FORCE_OLD_POSITION], p->begin, dim, batch.position);
	columns_from(&sh->use[FORCE_OLD_VELOCITY], p->begin, dim, batch.velocity);
	columns_from(&sh->use[FORCE_OLD_SPIN], p->begin, turns, batch.spin);
	((const quern_integrator_ops *)bound->ops)->predict[dim - 2](bound->self, &batch);
	for (uint32_t i = 0; i < p->n && fixed; i++) {
		if (!fixed[p->begin + i]) continue;
		for (int k = 0; k < dim; k++) then[k][i] = batch.velocity[k][i];
		for (int k = 0; k < turns; k++) then[3 + k][i] = batch.spin[k][i];
	}
	put_motions(sh->motion, v, s, p, dim, spin);
}

/* The mass of a fixed grain has a minus sign. */
static const quern_real *signed_masses(
	const forces_shared *sh, uint32_t begin, uint32_t n, quern_real to[GRAINS]) {
	const quern_real *mass = sh->use[FORCE_MASS].real[0] + begin;
	const int32_t *fixed = sh->use[FORCE_FIXED].index;
	if (!fixed) return mass;
	QUERN_SIMD
	for (uint32_t i = 0; i < n; i++) to[i] = fixed[begin + i] ? -mass[i] : mass[i];
	return to;
}

QUERN_INLINE void pack_all(
	const forces_shared *sh, uint32_t begin, uint32_t end, const int dim, const bool spin) {
	_Alignas(64) quern_real mass[GRAINS];
	for (uint32_t i = begin; i < end; i += GRAINS) {
		const uint32_t n = end - i < GRAINS ? end - i : GRAINS;
		const packing p = { i, n, signed_masses(sh, i, n, mass) };
		pack(sh, &p, sh->predicts ? sh->mean : sh->motion, dim, spin);
		if (sh->predicts) pack_predicted(sh, &p, dim, spin);
	}
}

void quern_dem_pack(const forces_shared *sh, uint32_t b) {
	const uint32_t begin = sh->grain[b], end = sh->grain[b + 1];
	if (sh->s->dim == 2) {
		if (sh->spin) pack_all(sh, begin, end, 2, true);
		else pack_all(sh, begin, end, 2, false);
	} else if (sh->spin) pack_all(sh, begin, end, 3, true);
	else pack_all(sh, begin, end, 3, false);
}

/* ---- who is near ---- */

/* Distances of four pairs to `normal`, the sums of their radii to `overlap`. */
QUERN_INLINE void put_distances(const forces_shared *sh, const forces_work *w, uint32_t to,
	const int32_t *first, const int32_t *second, const int dim) {
	static const lanes4 spatial = { -1, -1, -1, 1 }, planar = { -1, -1, 1, 0 };
	lanes4 i[4], j[4], d[4];
	packed_rows(sh->place, 1, first, i);
	packed_rows(sh->place, 1, second, j);
	for (int k = 0; k < 4; k++) i[k] += (dim == 3 ? spatial : planar) * j[k];
	packed_turn(i, d);
	for (int k = 0; k < dim; k++) packed_put(w->normal[k] + to, &d[k]);
	packed_put(w->overlap + to, &d[dim]);
}

/* Those that are near among n slots, where `slot` says who is; the numbers of the slots take its place. */
QUERN_INLINE uint32_t keep_near(forces_work *w, const int32_t *first, const int32_t *second, uint32_t n) {
	int32_t *slot = w->slot;
	uint32_t kept = 0;
#ifdef __AVX512VL__
	kept = quern_compress_numbers(n, slot, slot, w->near);
	for (uint32_t q = 0; q < kept; q++) w->first[q] = first[slot[q]], w->second[q] = second[slot[q]];
#else
	for (uint32_t k = 0; k < n; k++) {
		const int32_t is = slot[k];
		w->first[kept] = first[k];
		w->second[kept] = second[k];
		slot[kept] = (int32_t)k;
		kept += (uint32_t)is;
	}
#endif
	return kept;
}

/* Slots whose grains are within the laws' reach, in list order; and, where losses are booked, those of which a law still
 * remembers something, so that it can say what a spring gives up. */
QUERN_INLINE uint32_t compact(
	const forces_shared *sh, forces_work *w, uint32_t begin, uint32_t n, const int dim) {
	const int32_t *restrict first = sh->use[FORCE_FIRST].index + begin, *restrict second =
																			sh->use[FORCE_SECOND].index +
																			begin;
	const quern_real *restrict dx = w->normal[0], *restrict dy = w->normal[1], *restrict dz = w->normal[2],
							   *restrict both = w->overlap;
	const quern_real reach = sh->d->reach;
	const quern_images p = sh->images;
	int32_t *restrict near = w->slot;
	for (uint32_t k = 0; k + 4 <= n; k += 4) put_distances(sh, w, k, first + k, second + k, dim);
	for (uint32_t k = n & ~3u; k < n; k += 4) { /* what is left of four, filled up with the last one */
		const int32_t last[2][4] = { { first[k], first[k + 1 < n ? k + 1 : n - 1], first[n - 1] },
			{ second[k], second[k + 1 < n ? k + 1 : n - 1], second[n - 1] } };
		put_distances(sh, w, k, last[0], last[1], dim);
	}
	if (sh->boxed) quern_dem_box_bring(sh, w, n, NULL);
	QUERN_SIMD
	for (uint32_t k = 0; k < n; k++) {
		const quern_vec d = quern_vec_image((quern_vec) { dx[k], dy[k], dim == 3 ? dz[k] : 0 }, p, dim);
		const quern_real most = both[k] + reach;
		near[k] = (quern_vec_dot(d, d, dim) < most * most);
	}
	for (uint32_t h = 0; h < sh->n_history && sh->books; h++) {
		const quern_real *restrict was = sh->history[h].column + begin, initial = sh->history[h].initial;
		QUERN_SIMD
		for (uint32_t k = 0; k < n; k++)
			near[k] |= (was[k] != initial) & ((was[k] == was[k]) | (initial == initial));
	}
	const uint32_t kept = keep_near(w, first, second, n);
	for (uint32_t q = kept; q < kept + 3; q++) w->first[q] = w->second[q] = (int32_t)sh->grain[0];
	return kept;
}

/* ---- geometry and motion ---- */

/* Leaves the distances in `normal`, the radii in `arm`, in 2-D the masses in `mass` and `force`. */
QUERN_INLINE void load_places(const forces_shared *sh, const forces_work *w, uint32_t n, const int dim) {
	for (uint32_t q = 0; q < n; q += 4) {
		lanes4 i[4], j[4], d[4], mine[4], other[4];
		packed_rows(sh->place, 1, w->first + q, i);
		packed_rows(sh->place, 1, w->second + q, j);
		for (int k = 0; k < 4; k++) { /* its motion is asked for next */
			__builtin_prefetch(&sh->motion[packed_motions(dim) * (size_t)w->first[q + (uint32_t)k]]);
			__builtin_prefetch(&sh->motion[packed_motions(dim) * (size_t)w->second[q + (uint32_t)k]]);
		}
		for (int k = 0; k < 4; k++) d[k] = i[k] - j[k];
		packed_turn(d, d);
		packed_turn(i, mine);
		packed_turn(j, other);
		for (int k = 0; k < dim; k++) packed_put(w->normal[k] + q, &d[k]);
		packed_put(w->arm[0] + q, &mine[dim]);
		packed_put(w->arm[1] + q, &other[dim]);
		if (dim == 3) continue;
		packed_put(w->mass + q, &mine[3]);
		packed_put(w->force[0] + q, &other[3]);
	}
}

QUERN_INLINE void geometry(const forces_shared *sh, const forces_work *w, uint32_t n, const int dim) {
	const quern_images p = sh->images;
	quern_real *restrict overlap = w->overlap, *restrict effective = w->radius;
	quern_real *restrict nx = w->normal[0], *restrict ny = w->normal[1], *restrict nz = w->normal[2];
	quern_real *restrict arm_i = w->arm[0], *restrict arm_j = w->arm[1];
	load_places(sh, w, n, dim);
	if (sh->boxed) quern_dem_box_bring(sh, w, n, w->crossed);
	QUERN_SIMD
	for (uint32_t q = 0; q < n; q++) {
		const quern_vec d = quern_vec_image((quern_vec) { nx[q], ny[q], dim == 3 ? nz[q] : 0 }, p, dim);
		const quern_real ri = arm_i[q], rj = arm_j[q];
		const quern_real length = __builtin_sqrt(quern_vec_dot(d, d, dim)),
						 one_over = length > 0 ? 1 / length : 0;
		nx[q] = d.x * one_over;
		ny[q] = d.y * one_over;
		if (dim == 3) nz[q] = d.z * one_over;
		const quern_real o = ri + rj - length;
		overlap[q] = o;
		arm_i[q] = ri - 0.5 * o;
		arm_j[q] = rj - 0.5 * o;
		effective[q] = ri * rj / (ri + rj);
	}
}

/* Of rows of motion: leaves v_i - v_j in `velocity`, w_i in `spin`; w_j in `turn`, in 2-D in `planar`; in 3-D the masses in `mass`
 * and `force`. */
QUERN_INLINE void load_motion(const lanes4 *rows, const forces_work *w, quern_real *const velocity[3],
	quern_real *const turning[3], uint32_t n, const int dim, const bool spin) {
	for (uint32_t q = 0; q < n; q += 4) {
		lanes4 i[4], j[4], d[4], mine[4], other[4];
		packed_rows(rows, packed_motions(dim), w->first + q, i);
		packed_rows(rows, packed_motions(dim), w->second + q, j);
		for (int k = 0; k < 4; k++) d[k] = i[k] - j[k];
		packed_turn(d, d);
		packed_turn(i, mine);
		packed_turn(j, other);
		for (int k = 0; k < dim; k++) packed_put(velocity[k] + q, &d[k]);
		if (dim == 2 && spin) {
			packed_put(turning[0] + q, &mine[2]);
			packed_put(w->planar + q, &other[2]);
		}
		if (dim == 2) continue;
		packed_put(w->mass + q, &mine[3]);
		packed_put(w->force[0] + q, &other[3]);
		if (!spin) continue;
		packed_columns(rows + 1, 2, w->first + q, mine);
		packed_columns(rows + 1, 2, w->second + q, other);
		for (int k = 0; k < 3; k++) {
			packed_put(turning[k] + q, &mine[k]);
			packed_put(w->turn[k] + q, &other[k]);
		}
	}
}

/* v_c = v_i - v_j + w_i x b_i - w_j x b_j with b_i = -arm_i n, b_j = arm_j n */
QUERN_INLINE void motion(const lanes4 *rows, const forces_work *w, quern_real *const velocity[3],
	quern_real *const turning[3], uint32_t n, const int dim, const bool spin) {
	const quern_real *restrict nx = w->normal[0], *restrict ny = w->normal[1], *restrict nz = w->normal[2];
	const quern_real *restrict arm_i = w->arm[0], *restrict arm_j = w->arm[1];
	quern_real *restrict vx = velocity[0], *restrict vy = velocity[1], *restrict vz = velocity[2];
	quern_real *restrict sx = turning[0], *restrict sy = turning[1], *restrict sz = turning[2];
	quern_real *restrict tx = w->turn[0], *restrict ty = w->turn[1], *restrict tz = w->turn[2];
	const quern_real *restrict planar = w->planar;
	load_motion(rows, w, velocity, turning, n, dim, spin);
	if (spin && dim == 2) {
		QUERN_SIMD
		for (uint32_t q = 0; q < n; q++) {
			const quern_real wi = sx[q], wj = planar[q], sum = arm_i[q] * wi + arm_j[q] * wj;
			vx[q] += sum * ny[q];
			vy[q] -= sum * nx[q];
			sx[q] = wi - wj;
		}
	}
	if (spin && dim == 3) {
		QUERN_SIMD
		for (uint32_t q = 0; q < n; q++) {
			const quern_vec wi = { sx[q], sy[q], sz[q] }, wj = { tx[q], ty[q], tz[q] };
			const quern_vec sum = { arm_i[q] * wi.x + arm_j[q] * wj.x, arm_i[q] * wi.y + arm_j[q] * wj.y,
				arm_i[q] * wi.z + arm_j[q] * wj.z };
			vx[q] -= sum.y * nz[q] - sum.z * ny[q];
			vy[q] -= sum.z * nx[q] - sum.x * nz[q];
			vz[q] -= sum.x * ny[q] - sum.y * nx[q];
			sx[q] = wi.x - wj.x, sy[q] = wi.y - wj.y, sz[q] = wi.z - wj.z;
			tx[q] = 0.5 * (wi.x + wj.x), ty[q] = 0.5 * (wi.y + wj.y), tz[q] = 0.5 * (wi.z + wj.z);
		}
	}
}

/* m_i m_j/(m_i + m_j), where a fixed grain counts as a wall; weight min(w_i, w_j). */
static void masses(const forces_shared *sh, const forces_work *w, uint32_t n) {
	const quern_real *restrict weight = sh->use[FORCE_WEIGHT].real[0], *restrict other = w->force[0];
	const int32_t *restrict first = w->first, *restrict second = w->second;
	quern_real *restrict mass = w->mass, *restrict share = w->weight;
	QUERN_SIMD
	for (uint32_t q = 0; q < n; q++) {
		const quern_real mine = mass[q], its = other[q], a = mine < 0 ? -mine : mine,
						 b = its < 0 ? -its : its;
		const quern_real pair = a * b / (a + b), on_first = mine < 0 ? b : pair;
		mass[q] = its < 0 ? a : on_first;
	}
	for (uint32_t q = 0; q < n && weight; q++) {
		const quern_real a = weight[first[q]], b = weight[second[q]];
		share[q] = a < b ? a : b;
	}
}

static int32_t item_at(const forces_shared *sh, uint32_t k) {
	return dem_item(sh->d, sh->material, sh->use[FORCE_FIRST].index[k], sh->use[FORCE_SECOND].index[k]);
}

/* How many of n entries of the list have the parameters of the first: they are sorted by that, so that the end is found by
 * halving. */
static uint32_t alike(const forces_shared *sh, uint32_t begin, uint32_t n) {
	uint32_t low = 1, high = n;
	if (!sh->material) return n;
	const int32_t item = item_at(sh, begin);
	while (low < high) {
		const uint32_t middle = low + (high - low + 1) / 2;
		if (item_at(sh, begin + middle - 1) == item) low = middle;
		else high = middle - 1;
	}
	return low;
}

/* Rows of the block's own grains come in a stream, before contacts ask for them in any order. */
static void foresee(const forces_shared *sh, uint32_t b) {
	enum { AT_ONCE = 64 / sizeof(lanes4) };
	for (uint32_t i = sh->grain[b]; i < sh->grain[b + 1]; i += AT_ONCE) __builtin_prefetch(&sh->place[i]);
}

/* What laws remember of n slots is written whole in every step, and is on its way while distances are found. */
static void foresee_history(const forces_shared *sh, uint32_t begin, uint32_t n) {
	enum { AT_ONCE = 64 / sizeof(quern_real) };
	for (uint32_t h = 0; h < sh->n_history; h++)
		for (uint32_t k = 0; k < n; k += AT_ONCE) __builtin_prefetch(&sh->history[h].column[begin + k]);
}

QUERN_INLINE void block(
	const forces_shared *sh, forces_work *w, uint32_t b, quern_real *sums, const int dim, const bool spin) {
	foresee(sh, b);
	for (uint32_t begin = sh->contact[b], end = sh->contact[b + 1], n; begin < end; begin += n) {
		n = alike(sh, begin, end - begin < sh->cap ? end - begin : sh->cap);
		contact_chunk c = {
			.block = b, .body = -1, .item = item_at(sh, begin), .begin = begin, .n_slots = n, .near = w->near
		};
		foresee_history(sh, begin, c.n_slots);
		c.n = compact(sh, w, begin, c.n_slots, dim);
		geometry(sh, w, c.n, dim);
		motion(sh->motion, w, w->velocity, w->spin, c.n, dim, spin);
		if (sh->mean) motion(sh->mean, w, w->mean_velocity, w->mean_spin, c.n, dim, spin);
		if (sh->boxed) quern_dem_box_motion(sh, w, w->velocity, c.n);
		if (sh->boxed && sh->mean) quern_dem_box_motion(sh, w, w->mean_velocity, c.n);
		masses(sh, w, c.n);
		quern_dem_act(sh, w, &c, sums);
	}
}

void quern_dem_pairs(const forces_shared *sh, forces_work *w, uint32_t b, quern_real *sums) {
	if (sh->s->dim == 2) {
		if (sh->spin) block(sh, w, b, sums, 2, true);
		else block(sh, w, b, sums, 2, false);
	} else if (sh->spin) block(sh, w, b, sums, 3, true);
	else block(sh, w, b, sums, 3, false);
}
