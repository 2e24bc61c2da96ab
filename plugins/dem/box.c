/* SPDX-License-Identifier: MIT */
/* box - the periodic box that is strained: how fast, what that gives to grains, and what is booked of it. docs/theory/grains.md,
 * section 8 */
#include "box.h"
#include "forces.h"
#include <math.h>

/* ---- the scene ---- */

static const char *key_of(const dem *d) {
	if (!isnan(d->box_shear)) return "box.shear";
	if (!isnan(d->box_pressure)) return "box.pressure";
	return isnan(d->box_packing) ? NULL : "box.packing";
}

/* What stands beside a box in the scene, or does not. */
static const char *unfit(const dem *d, const quern_setup *setup) {
	const dem_place *place = d->place.items;
	const dem_fill *fill = d->fill.items;
	for (uint32_t k = 0; k < setup->dim; k++)
		if (!setup->periodic[k])
			return "strains the domain with its images: it must be periodic along every axis (domain.periodic)";
	if (setup->host->keeps(setup, "continuum") || setup->host->keeps(setup, "hybrid"))
		return "is for grains alone: a grid, and so a continuum and a hybrid, keeps its shape";
	if (quern_gravity_size(setup->dim, setup->gravity) > 0)
		return "knows no up and down: gravity must be 0 where the domain is strained";
	if (d->source.n) return "keeps its grains: there is no source where the domain is strained";
	for (uint32_t i = 0; i < d->fill.n; i++)
		if (fill[i].fixed) return "carries all grains along: none may be fixed (grains.fill)";
	for (uint32_t i = 0; i < d->place.n; i++)
		if (place[i].fixed) return "carries all grains along: none may be fixed (grains.place)";
	return NULL;
}

quern_status quern_dem_box_check(dem *d, const quern_setup *setup, quern_err *err) {
	const char *key = key_of(d), *why = NULL;
	if (!isnan(d->box_rate) && isnan(d->box_packing))
		return setup->host->fail(err, QUERN_E_PARAM, "box.rate",
			"is how fast the box goes to a packing fraction: give box.packing too");
	if (!isnan(d->box_packing) && isnan(d->box_rate))
		return setup->host->fail(err, QUERN_E_PARAM, "box.packing",
			"does not say how fast the box goes there: give box.rate, in 1/s");
	d->boxed = d->boxed || key;
	if (d->boxed) why = unfit(d, setup);
	return why ? setup->host->fail(err, QUERN_E_PARAM, key ? key : "boxed", "%s", why) : QUERN_OK;
}

quern_status quern_dem_box_bodies(const dem *d, const quern_setup *setup, uint32_t n_bodies, quern_err *err) {
	const char *key = key_of(d);
	if (!d->boxed || !n_bodies) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, key ? key : "boxed",
		"strains the domain, and bodies keep their shape: take them out, or drive grains by bodies that move");
}

/* ---- the beginning ---- */

static void put(const quern_column *row, const dem_box *b) {
	for (uint32_t k = 0; k < b->dim; k++) row[0].real[k][0] = b->length[k], row[1].real[k][0] = b->speed[k];
	row[2].real[0][0] = b->offset;
	row[3].real[0][0] = b->slide;
}

quern_status quern_dem_box_begin(const dem *d, const quern_step *s) {
	const quern_column *u = s->use;
	const uint32_t n = s->host->set(s->run, "grain").n;
	dem_box b = { .dim = s->dim };
	if (!d->boxed) return QUERN_OK;
	for (uint32_t k = 0; k < s->dim; k++) {
		b.length[k] = s->upper[k] - s->lower[k];
		u[FILL_BOX_LISTED].real[k][0] = b.length[k];
	}
	put(&u[FILL_BOX_LENGTH], &b);
	quern_real *solid = s->host->memory(s->run, (n + (size_t)1) * sizeof *solid);
	if (!solid) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) {
		if (u[FILL_FIXED].index && u[FILL_FIXED].index[i])
			return s->host->stop(s->run, QUERN_E_PARAM, d->from ? "from" : "file", -1,
				"grain %lld is fixed: a box that is strained carries all grains along",
				(long long)u[FILL_ID].id[i]);
		solid[i] = quern_radius_mass(u[FILL_RADIUS].real[0][i], 1, s->dim);
	}
	u[FILL_BOX_SOLID].real[0][0] = s->host->sum_set(s->run, "grain", solid);
	u[FILL_BOX_MASS].real[0][0] = s->host->sum_set(s->run, "grain", u[FILL_MASS].real[0]);
	return QUERN_OK;
}

bool quern_dem_box_holds(const quern_step *s) {
	const dem_box b = dem_box_at(s, &s->use[FILL_BOX_LENGTH]);
	for (uint32_t k = 0; k < s->dim; k++) {
		const quern_real width = s->upper[k] - s->lower[k], listed = s->use[FILL_BOX_LISTED].real[k][0];
		if (!(b.length[k] > 1e-3 * width && b.length[k] < 1e3 * width) || quern_too_fast(b.speed, 1))
			return false;
		if (!(listed > 1e-3 * width && listed < 1e3 * width)) return false;
	}
	return fabs(b.offset) <= 1e6 * b.length[0] &&
		   fabs(s->use[FILL_BOX_LISTED_OFFSET].real[0][0]) <= 1e6 * b.length[0] &&
		   !quern_too_fast((const quern_real[3]) { b.slide, 0, 0 }, 1);
}

/* ---- how fast ---- */

/* sum m (c - <c>)^2 along an axis, of velocities less the box's own flow. */
static bool thermal(const quern_step *s, const dem_box *b, uint32_t k, quern_real *sum) {
	const quern_column *u = s->use;
	const uint32_t n = s->host->set(s->run, "grain").n;
	const box_matrix flow = dem_box_over(b->speed, b->slide, b);
	const quern_real *m = u[STRAIN_MASS].real[0], *v = u[STRAIN_VELOCITY].real[k],
					 *x = u[STRAIN_POSITION].real[k], *y = u[STRAIN_POSITION].real[1],
					 *whole = u[STRAIN_BOX_MASS].real[0];
	quern_real *first = s->host->memory(s->run, (n + (size_t)1) * sizeof *first),
			   *second = s->host->memory(s->run, (n + (size_t)1) * sizeof *second);
	if (!first || !second) return false;
	for (uint32_t i = 0; i < n; i++) {
		const quern_real along = flow.on[k] * (x[i] - b->lower[k]),
						 across = k == 0 ? flow.xy * (y[i] - b->lower[1]) : 0, c = v[i] - along - across;
		first[i] = m[i] * c;
		second[i] = m[i] * c * c;
	}
	const quern_real drift = s->host->sum_set(s->run, "grain", first);
	*sum += s->host->sum_set(s->run, "grain", second) - drift * drift / *whole;
	return true;
}

/* Rate of strain, 1/s, of a box on a piston: M L'' = (V/L)(p - P) - b M L', where p is the mean of the normal stress along the axes that
 * change; Andersen 1980, with a dashpot. b is given over sqrt(P V/M)/L, the piston's frequency were the grains a gas at that pressure. */
static bool piston(const dem *d, const quern_step *s, const dem_box *b, quern_real *rate) {
	const uint32_t first = d->box_along == BOX_Y ? 1 : 0, end = d->box_along == BOX_Y ? 2 : s->dim;
	const quern_real volume = dem_box_volume(b), length = b->length[first];
	const quern_real mass = d->box_inertia * s->use[STRAIN_BOX_MASS].real[0][0];
	quern_real sum = 0;
	for (uint32_t k = first; k < end; k++) {
		sum += s->use[STRAIN_BOX_LOAD].real[k][0];
		if (!thermal(s, b, k, &sum)) return false;
	}
	const quern_real pressure = sum / (volume * (end - first)), wanted = d->box_pressure;
	const quern_real damping = d->box_damping * sqrt(wanted * volume / mass) / length;
	const quern_real pushed = b->speed[first] + s->dt * volume / (length * mass) * (pressure - wanted);
	*rate = pushed / (1 + damping * s->dt) / length;
	return true;
}

/* At the rate that is asked for, until the packing fraction is, to the last bits. */
static quern_real towards(const dem *d, const quern_step *s, const dem_box *b) {
	const quern_real ratio = s->use[STRAIN_BOX_SOLID].real[0][0] / (d->box_packing * dem_box_volume(b));
	const quern_real scale = d->box_along == BOX_Y ? ratio : s->dim == 2 ? sqrt(ratio) : quern_cbrt(ratio);
	const quern_real wanted = (scale - 1) / s->dt;
	return fabs(scale - 1) < 1e-12 ? 0 : quern_clamp(wanted, -d->box_rate, d->box_rate);
}

/* Speeds of lengths and offset that go with the rates of strain. */
static dem_box at_rate(const dem *d, const dem_box *was, quern_real rate) {
	const quern_real shear = isnan(d->box_shear) ? 0 : d->box_shear;
	const bool all = d->box_along == BOX_ALL;
	dem_box b = *was;
	for (uint32_t k = 0; k < b.dim; k++) b.speed[k] = all || k == 1 ? rate * b.length[k] : 0;
	b.slide = shear * b.length[1] + (all ? rate * b.offset : 0);
	return b;
}

/* ---- what it gives ---- */

/* Where the rates of the images' vectors change, all grains get the change of the box's own flow: no place in the box is other than the
 * rest, whatever face is near. Shear is about the middle, so that grains as a whole do not go along x. */
static bool kick(const quern_step *s, const dem_box *was, const dem_box *now) {
	const quern_column *u = s->use;
	const uint32_t n = s->host->set(s->run, "grain").n, dim = s->dim;
	quern_real change[3] = { 0 };
	bool any = now->slide - was->slide != 0;
	for (uint32_t k = 0; k < dim; k++) {
		change[k] = now->speed[k] - was->speed[k];
		any = any || change[k] != 0;
	}
	if (!any) return true;
	const box_matrix more = dem_box_over(change, now->slide - was->slide, was);
	const quern_real *m = u[STRAIN_MASS].real[0], *y = u[STRAIN_POSITION].real[1],
					 middle = was->lower[1] + 0.5 * was->length[1];
	quern_real *work = s->host->memory(s->run, (n + (size_t)1) * sizeof *work),
			   *impulse = s->host->memory(s->run, (n + (size_t)1) * sizeof *impulse);
	if (!work || !impulse) return false;
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real *x = u[STRAIN_POSITION].real[k];
		quern_real *v = u[STRAIN_VELOCITY].real[k];
		for (uint32_t i = 0; i < n; i++) {
			const quern_real given =
				more.on[k] * (x[i] - was->lower[k]) + (k == 0 ? more.xy * (y[i] - middle) : 0);
			work[i] += m[i] * given * (v[i] + 0.5 * given);
			impulse[i] = m[i] * given;
			v[i] += given;
		}
		u[STRAIN_BOX_IMPULSE].real[k][0] += s->host->sum_set(s->run, "grain", impulse);
	}
	u[STRAIN_BOX_WORK].real[0][0] += s->host->sum_set(s->run, "grain", work);
	return true;
}

quern_status quern_dem_box_strain(const void *self, const quern_step *s) {
	const dem *d = self;
	const quern_column *u = s->use;
	const dem_box was = dem_box_at(s, &u[STRAIN_BOX_LENGTH]);
	quern_real rate = 0;
	if (!s->host->set(s->run, "grain").n) return QUERN_OK;
	if (!isnan(d->box_pressure) && !piston(d, s, &was, &rate)) return QUERN_E_MEMORY;
	if (!isnan(d->box_packing)) rate = towards(d, s, &was);
	if (!(fabs(rate) * s->dt < 0.01))
		return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
			"the box is strained by %.2g in one step of %.3g s: give grains.box.inertia or box.damping more, or "
			"box.rate less",
			rate * s->dt, s->dt);
	const dem_box now = at_rate(d, &was, rate);
	if (!kick(s, &was, &now)) return QUERN_E_MEMORY;
	/* images go on when grains do: as much of the way as the integrator moves them before the forces */
	const dem_box after = dem_box_after(&now, quern_integrator_ahead(dem_integrator(s)->ops, s->dim) * s->dt);
	put(&u[STRAIN_BOX_LENGTH], &after);
	if (!isnan(d->box_shear)) u[STRAIN_BOX_STRAIN].real[0][0] += d->box_shear * s->dt;
	return QUERN_OK;
}

/* ---- lists ---- */

/* Of many lengths beside each other the offset may be taken by any of them: by less than half a length. */
static void reduce(const quern_column *row, dem_box *b) {
	const quern_real whole = quern_floor(b->offset / b->length[0] + 0.5);
	b->offset -= whole * b->length[0];
	b->slide -= whole * b->speed[0];
	put(row, b);
}

/* Takes v of grain i down by `less`; returns the work. */
static quern_real take(const quern_step *s, uint32_t k, uint32_t i, quern_real less) {
	const quern_column *u = s->use;
	const quern_real m = u[NEAR_MASS].real[0][i], v = u[NEAR_VELOCITY].real[k][i];
	u[NEAR_VELOCITY].real[k][i] = v - less;
	u[NEAR_BOX_IMPULSE].real[k][0] -= m * less;
	return -m * less * (v - 0.5 * less);
}

void quern_dem_box_bring_back(const quern_step *s) {
	const quern_column *u = s->use;
	const uint32_t n = s->host->set(s->run, "grain").n, *order = s->host->parts(s->run, "grain")->entry;
	dem_box b = dem_box_at(s, &u[NEAR_BOX_LENGTH]);
	reduce(&u[NEAR_BOX_LENGTH], &b);
	for (uint32_t q = 0; q < n; q++) {
		const uint32_t i = quern_nth(order, q);
		for (uint32_t turn = 0; turn < s->dim; turn++) {
			const uint32_t k = turn == 0 ? 1 : turn == 1 ? 0 : 2; /* across y it is moved along x too */
			quern_real *x = &u[NEAR_POSITION].real[k][i];
			const quern_real upper = b.lower[k] + b.length[k];
			quern_real gone = quern_floor((*x - b.lower[k]) / b.length[k]);
			*x -= gone * b.length[k];
			if (*x >= upper) { /* by rounding: then it is the image at the lower face */
				gone += 1;
				*x = b.lower[k];
			}
			if (*x < b.lower[k]) *x = b.lower[k];
			if (gone == 0) continue;
			u[NEAR_BOX_WORK].real[0][0] += take(s, k, i, gone * b.speed[k]);
			if (k != 1) continue;
			u[NEAR_POSITION].real[0][i] -= gone * b.offset;
			u[NEAR_BOX_WORK].real[0][0] += take(s, 0, i, gone * b.slide);
		}
	}
}

/* A straight box looks like this from one that leans: distances are longer there by `longer` at most, the larger singular value of the
 * shear between both. */
bool quern_dem_box_straighten(const quern_step *s, quern_neighbour_job *job) {
	const dem_box b = dem_box_at(s, &s->use[NEAR_BOX_LENGTH]);
	const quern_real lean = b.offset / b.length[1],
					 longer = 0.5 * (fabs(lean) + sqrt(lean * lean + 4)) * (1 + 1e-12);
	quern_real *x = s->host->memory(s->run, (job->n + (size_t)1) * sizeof *x),
			   *radius = s->host->memory(s->run, (job->n + (size_t)1) * sizeof *radius);
	if (!x || !radius) return false;
	for (uint32_t k = 0; k < s->dim; k++) job->upper[k] = job->lower[k] + b.length[k];
	for (uint32_t i = 0; i < job->n; i++) {
		const quern_real at = job->position[0][i] - lean * (job->position[1][i] - b.lower[1]);
		x[i] = quern_brought_back(at, job->lower[0], job->upper[0]);
		radius[i] = longer * job->radius[i];
	}
	job->position[0] = x;
	job->radius = radius;
	job->largest *= longer;
	job->reach *= longer;
	return true;
}

uint32_t quern_dem_box_keep_near(const quern_step *s, quern_real reach, uint32_t n, quern_pair *pair) {
	const dem_box b = dem_box_at(s, &s->use[NEAR_BOX_LENGTH]);
	quern_real *const *x = s->use[NEAR_POSITION].real;
	const quern_real *radius = s->use[NEAR_RADIUS].real[0];
	uint32_t kept = 0;
	for (uint32_t q = 0; q < n; q++) {
		const int32_t i = pair[q].first, j = pair[q].second;
		const quern_real most = radius[i] + radius[j] + reach;
		quern_real d[3] = { 0 }, crossed[3], sum = 0;
		for (uint32_t k = 0; k < s->dim; k++) d[k] = x[k][i] - x[k][j];
		dem_box_image(&b, (int)s->dim, d, crossed);
		for (uint32_t k = 0; k < s->dim; k++) sum += d[k] * d[k];
		if (sum < most * most) pair[kept++] = pair[q];
	}
	return kept;
}

void quern_dem_box_list(const quern_step *s, quern_real widest) {
	const dem_box b = dem_box_at(s, &s->use[NEAR_BOX_LENGTH]);
	for (uint32_t k = 0; k < s->dim; k++) s->use[NEAR_BOX_LISTED].real[k][0] = b.length[k];
	s->use[NEAR_BOX_LISTED_OFFSET].real[0][0] = b.offset;
	s->use[NEAR_BOX_WIDEST].real[0][0] = widest;
}

/* F = L L_0^-1, how the box has been strained since the list was made. */
static box_matrix since_list(const dem_box *now, const quern_column *listed) {
	dem_box then = *now;
	for (uint32_t k = 0; k < now->dim; k++) then.length[k] = listed[0].real[k][0];
	then.offset = listed[1].real[0][0];
	return dem_box_over(now->length, now->offset, &then);
}

/* Two places that were r_0 apart are r = F r_0 + u apart now, with |u| no more than twice the way beside the box's own strain: so
 * |r_0| <= |F^-1| (|r| + |u|), where |F^-1| <= 1 + |F^-1 - 1| by Frobenius. */
quern_real quern_dem_box_moved(const quern_step *s, quern_real way) {
	const dem_box b = dem_box_at(s, &s->use[NEAR_BOX_LENGTH]);
	const box_matrix f = since_list(&b, &s->use[NEAR_BOX_LISTED]);
	quern_real sum = f.xy / (f.on[0] * f.on[1]) * (f.xy / (f.on[0] * f.on[1]));
	for (uint32_t k = 0; k < s->dim; k++) sum += (1 / f.on[k] - 1) * (1 / f.on[k] - 1);
	const quern_real more = sqrt(sum);
	return (1 + more) * way + 0.5 * more * s->use[NEAR_BOX_WIDEST].real[0][0];
}

void quern_dem_box_ways(const dem_box *b, const quern_column *listed, uint32_t begin, uint32_t n,
	quern_real *const x[3], quern_real *const anchor[3], quern_real *way) {
	const box_matrix f = since_list(b, listed);
	const quern_real middle = b->lower[1] + 0.5 * listed[0].real[1][0]; /* about which it shears */
	for (uint32_t i = 0; i < n; i++) {
		quern_real sum = 0;
		for (uint32_t k = 0; k < b->dim; k++) {
			const quern_real carried = f.on[k] * (anchor[k][begin + i] - b->lower[k]) +
									   (k == 0 ? f.xy * (anchor[1][begin + i] - middle) : 0);
			const quern_real gone = x[k][i] - b->lower[k] - carried;
			sum += gone * gone;
		}
		way[i] = sum;
	}
}

/* ---- contacts ---- */

/* dem_box_image of columns, to rounding */
QUERN_INLINE void bring(const dem_box *box, const forces_work *w, uint32_t n, quern_real *const crossed[3],
	const int dim, const bool notes) {
	const dem_box b = *box;
	quern_real *restrict x = w->normal[0], *restrict y = w->normal[1], *restrict z = w->normal[2];
	quern_real *restrict by_x = crossed[0], *restrict by_y = crossed[1], *restrict by_z = crossed[2];
	const quern_real per_x = 1 / b.length[0], per_y = 1 / b.length[1], per_z = 1 / b.length[2];
	QUERN_SIMD
	for (uint32_t q = 0; q < n; q++) {
		const quern_real over = quern_floor(y[q] * per_y + 0.5), leant = x[q] - over * b.offset,
						 along = quern_floor(leant * per_x + 0.5);
		y[q] -= over * b.length[1];
		x[q] = leant - along * b.length[0];
		if (notes) by_x[q] = along, by_y[q] = over;
		if (dim == 3) {
			const quern_real deep = quern_floor(z[q] * per_z + 0.5);
			z[q] -= deep * b.length[2];
			if (notes) by_z[q] = deep;
		}
	}
}

void quern_dem_box_bring(
	const forces_shared *sh, const forces_work *w, uint32_t n, quern_real *const crossed[3]) {
	static quern_real *const none[3] = { NULL };
	if (sh->box.dim == 2 && crossed) bring(&sh->box, w, n, crossed, 2, true);
	else if (sh->box.dim == 2) bring(&sh->box, w, n, none, 2, false);
	else if (crossed) bring(&sh->box, w, n, crossed, 3, true);
	else bring(&sh->box, w, n, none, 3, false);
}

/* m/s, of an image over what it is one of */
QUERN_INLINE quern_real image_speed(const dem_box *b, quern_real *const crossed[3], uint32_t k, uint32_t q) {
	return crossed[k][q] * b->speed[k] + (k == 0 ? crossed[1][q] * b->slide : 0);
}

void quern_dem_box_motion(
	const forces_shared *sh, const forces_work *w, quern_real *const velocity[3], uint32_t n) {
	for (uint32_t k = 0; k < sh->box.dim; k++)
		for (uint32_t q = 0; q < n; q++) velocity[k][q] -= image_speed(&sh->box, w->crossed, k, q);
}

void quern_dem_box_book(
	const forces_shared *sh, const forces_work *w, const contact_chunk *c, quern_real *sums) {
	const uint32_t begin = sh->grain[c->block], end = sh->grain[c->block + 1];
	quern_real *of_box = sh->box_sums + (size_t)c->block * N_BOX_SUMS;
	for (uint32_t q = 0; q < c->n; q++) {
		const uint32_t i = (uint32_t)w->first[q];
		const quern_real branch = w->arm[0][q] + w->arm[1][q];
		if (i < begin || i >= end) continue;
		for (uint32_t k = 0; k < sh->box.dim; k++) {
			const quern_real way = image_speed(&sh->box, w->crossed, k, q) * sh->s->dt;
			of_box[BOX_LOAD + k] += w->force[k][q] * w->normal[k][q] * branch;
			of_box[BOX_WORK] += w->force[k][q] * way;
			/* sums over grains have the power of dashpots with velocities that are not those of images */
			if (sh->books) sums[E_DAMPED] += w->dashpot[k][q] * way;
		}
	}
}

void quern_dem_box_collect(const forces_shared *sh, uint32_t n_blocks) {
	const quern_column *u = sh->use;
	quern_real sum[N_BOX_SUMS] = { 0 };
	for (uint32_t q = 0; q < n_blocks; q++)
		for (uint32_t k = 0; k < N_BOX_SUMS; k++)
			sum[k] += sh->box_sums[(size_t)quern_nth(sh->by_place, q) * N_BOX_SUMS + k];
	for (uint32_t k = 0; k < sh->box.dim; k++) {
		u[FORCE_BOX_LOAD].real[k][0] = sum[BOX_LOAD + k];
		u[FORCE_BOX_LENGTH].real[k][0] = sh->box_then.length[k];
	}
	u[FORCE_BOX_OFFSET].real[0][0] = sh->box_then.offset;
	u[FORCE_BOX_WORK].real[0][0] += sum[BOX_WORK];
}
