/* SPDX-License-Identifier: MIT */
/* fill - the first grains: packed cell by cell, given one by one, or read from a table; and when they have settled */
#include "../common/outlets.h"
#include "../common/placer.h"
#include "dem.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
	const dem *d;
	const quern_step *step;
	placer placer;
	const body_pose *pose; /* by body */
	dem_place *grain;
	quern_real *full; /* m, by grain: the radius that it shall have */
	uint32_t n, cap;
	uint32_t before; /* grains of another run's state, the first of them */
	uint64_t draws;
	const dem_fill *item;
	region region; /* its own */
	region_side side;
	quern_real widest; /* mean radius of what it has */
	quern_real
		reach; /* m around a cell, of seeds: twice the widest radii of a new grain and of one that is there */
	quern_real placed[MOST_MATERIALS]; /* kg, of this item */
	int32_t kind;                      /* material of the grain that waits */
	quern_real lower[3], upper[3];     /* of the cell that is being filled */
	bool last[3]; /* the cell ends the region along this axis: its upper face belongs to it */
	bool failed;
} filling;

static quern_real mass_of(const dem *d, const dem_place *grain) {
	return quern_radius_mass(grain->radius, d->material[grain->kind].density, d->dim);
}

static void add(filling *f, const dem_place *grain) {
	if (f->n == f->cap) {
		f->cap = f->cap ? 2 * f->cap : 1024;
		dem_place *grown = realloc(f->grain, f->cap * sizeof(dem_place));
		if (!grown) {
			f->failed = true;
			return;
		}
		f->grain = grown;
		quern_real *full = realloc(f->full, f->cap * sizeof *full);
		if (!full) {
			f->failed = true;
			return;
		}
		f->full = full;
	}
	f->full[f->n] = grain->radius;
	f->grain[f->n++] = *grain;
	quern_spot spot = { .radius = grain->radius };
	for (uint32_t k = 0; k < f->d->dim; k++) spot.x[k] = grain->position[k];
	quern_placer_add(&f->placer, &spot);
}

static void choose_material(filling *f) {
	const quern_real *share = f->item->of.share;
	f->kind = 0;
	if (f->item->of.mix.n)
		f->kind = quern_dem_mix(f->d, share, f->placed, f->step->host, STREAM_FILLS, f->draws);
	else
		while (!(share[f->kind] > 0)) f->kind++;
}

static quern_real job_radius(quern_pack_job *job) {
	const filling *f = job->scene;
	return quern_dem_radius(f->d, (uint32_t)f->kind, job->host, STREAM_FILLS, f->draws);
}

static bool job_inside(const quern_pack_job *job, const quern_real x[3]) {
	const filling *f = job->scene;
	for (uint32_t k = 0; k < f->d->dim; k++)
		if (x[k] < f->lower[k] || (f->last[k] ? x[k] > f->upper[k] : x[k] >= f->upper[k])) return false;
	return f->side == REGION_AROUND || quern_region_holds(&f->region, x);
}

static bool job_free(const quern_pack_job *job, const quern_spot *spot) {
	return quern_placer_free(&((const filling *)job->scene)->placer, spot);
}

static bool job_place(quern_pack_job *job, const quern_spot *spot) {
	filling *f = job->scene;
	dem_place grain = { .radius = spot->radius, .fixed = f->item->fixed, .kind = f->kind };
	for (uint32_t k = 0; k < f->d->dim; k++)
		grain.position[k] = spot->x[k], grain.velocity[k] = f->item->velocity[k];
	const quern_real full = job_radius(job);
	add(f, &grain);
	if (!f->failed) f->full[f->n - 1] = full;
	grain.radius = full;
	f->placed[f->kind] += mass_of(f->d, &grain);
	f->draws++;
	choose_material(f);
	return !f->failed && !f->placer.failed;
}

/* Fixed grains are walls: they stay where they are put. */
static bool relaxes(const filling *f, const quern_bound *packer) {
	return ((const quern_packer_ops *)packer->ops)->relax && !f->item->fixed;
}

static void fill_cell(filling *f, const quern_bound *packer, uint64_t key) {
	uint32_t n = 0;
	quern_spot *seed = quern_placer_seeds(&f->placer, f->lower, f->upper, f->reach, &n);
	if (!seed) {
		f->failed = true;
		return;
	}
	quern_pack_job job = { .dim = f->d->dim,
		.stream = f->d->stream + 1,
		.key = key,
		.host = f->step->host,
		.seed = seed,
		.n_seed = n,
		.radius = job_radius,
		.inside = job_inside,
		.free = job_free,
		.place = job_place,
		.scene = f };
	memcpy(job.lower, f->lower, sizeof job.lower);
	memcpy(job.upper, f->upper, sizeof job.upper);
	const quern_packer_ops *ops = packer->ops;
	if (relaxes(f, packer)) job.growth = QUERN_GROWS_TOGETHER;
	ops->pack[f->d->dim - 2](packer->self, &job);
	free(seed);
}

/* Cells of about two diameters, along gravity last, so that the packing grows upwards as it would by pouring. Returns how many of
 * them hold some of the region. */
static uint32_t fill_region(filling *f, uint32_t i) {
	const uint32_t dim = f->d->dim;
	const quern_step *s = f->step;
	const dem_fill *item = (const dem_fill *)f->d->fill.items + i;
	const uint64_t key = (uint64_t)(i + 1) << 40;
	uint32_t count[3] = { 1, 1, 1 }, held = 0;
	f->item = item;
	f->region = quern_region_of(s, &s->slot[SLOT_REGION][i], item->lower, item->upper);
	quern_region_put_above(&f->region, s, &item->above, SLOT_BODIES, f->pose);
	const dem_fill *fill = f->d->fill.items;
	quern_real others = 0;
	for (uint32_t k = 0; k < f->d->fill.n; k++) others = fmax(others, quern_dem_most(f->d, fill[k].of.share));
	f->widest = quern_dem_widest(f->d, item->of.share);
	f->reach = 2 * quern_dem_most(f->d, item->of.share) + 2 * others;
	memset(f->placed, 0, sizeof f->placed);
	choose_material(f);
	f->placer.n_bodies = item->fixed ? 0 : s->n_slot[SLOT_BODIES]; /* a rough floor may be let into a plane */
	for (uint32_t k = 0; k < dim; k++) {
		const quern_real cells = (item->upper[k] - item->lower[k]) / (4 * f->widest);
		count[k] = cells > 1 ? (uint32_t)cells : 1;
	}
	for (uint32_t z = 0; z < count[2]; z++)
		for (uint32_t y = 0; y < count[1]; y++)
			for (uint32_t x = 0; x < count[0] && !f->failed; x++) {
				const uint32_t at[3] = { x, y, z };
				for (uint32_t k = 0; k < dim; k++) {
					const quern_real width = (item->upper[k] - item->lower[k]) / count[k];
					f->lower[k] = item->lower[k] + at[k] * width;
					f->last[k] = at[k] + 1 == count[k];
					f->upper[k] = f->last[k] ? item->upper[k] : item->lower[k] + (at[k] + 1) * width;
				}
				f->side = quern_region_side(&f->region, f->lower, f->upper);
				if (f->side == REGION_APART) continue;
				fill_cell(f, &s->slot[SLOT_PACKER][i], key + ((uint64_t)z * count[1] + y) * count[0] + x);
				held++;
			}
	return held;
}

/* True if the grain lies in the domain. A fixed one may lie beyond it by the domain's own width, any grain along
 * periodic axes. */
static bool is_near(const quern_step *s, const dem_place *grain) {
	bool near = true;
	for (uint32_t k = 0; k < s->dim; k++) {
		const quern_real slack = grain->fixed || s->periodic[k] ? s->upper[k] - s->lower[k] : 0;
		const quern_real x = grain->position[k];
		near = near && x >= s->lower[k] - slack && x <= s->upper[k] + slack;
	}
	return near;
}

/* ---- grains that somebody has placed ---- */

enum { WORDS = 200 };

/* Fixed grains may overlap each other. */
static bool moves(const void *arg, int32_t i) { return !((const filling *)arg)->grain[i].fixed; }

/* Whether it may stand there, after all those before it; says why not. */
static bool may_stand(const filling *f, const dem_place *grain, char why[WORDS]) {
	const quern_step *s = f->step;
	quern_spot spot = { .radius = grain->radius };
	quern_real by;
	memcpy(spot.x, grain->position, sizeof spot.x);
	const int32_t other = quern_placer_worst(
		&f->placer, &spot, (1 + 1e-9) * f->d->overlap_start, grain->fixed ? moves : NULL, f, &by);
	if (other >= 0) {
		const quern_real *x = f->grain[other].position;
		const uint32_t given = (uint32_t)other - f->before, n_placed = f->d->place.n;
		const char *of = (uint32_t)other < f->before ? "from, entry"
						 : given < n_placed          ? "place"
													 : "file, row";
		snprintf(why, WORDS,
			"overlaps that of %s %u, at (%g, %g, %g) m, by %.2g of a radius; overlap.start allows %g", of,
			(uint32_t)other < f->before ? (uint32_t)other
			: given < n_placed          ? given
										: given - n_placed,
			x[0], x[1], x[2], by, f->d->overlap_start);
		return false;
	}
	for (uint32_t b = 0; b < s->n_slot[SLOT_BODIES] && !grain->fixed; b++) {
		const quern_bound *body = &s->slot[SLOT_BODIES][b];
		if (!quern_body_is_there(body, f->d->settles)) continue;
		const quern_real in =
			-quern_body_gap(body, &f->pose[b], s->dim, spot.x, spot.radius, NULL) / spot.radius;
		if (!(in > (1 + 1e-9) * f->d->overlap_start)) continue;
		char which[BODY_WORDS];
		quern_body_say(body, b, which);
		if (in >= 1) snprintf(why, WORDS, "starts in %s, with its centre", which);
		else
			snprintf(why, WORDS, "overlaps %s, by %.2g of a radius; overlap.start allows %g", which, in,
				f->d->overlap_start);
		return false;
	}
	return true;
}

/* Number k of `param`. No law has a direction for grains whose centres coincide. */
static quern_status add_given(filling *f, const dem_place *given, const char *param, uint32_t k) {
	const quern_step *s = f->step;
	dem_place grain = *given;
	char why[WORDS], item[40];
	if (isnan(grain.radius)) grain.radius = f->d->material[grain.kind].radii.mean;
	quern_spot centre = { .radius = 1e-3 * grain.radius };
	memcpy(centre.x, grain.position, sizeof centre.x);
	bool good = false;
	if (!is_near(s, &grain)) snprintf(why, WORDS, "lies outside of the domain");
	else if (quern_too_fast(grain.velocity, 1) || quern_too_fast(grain.spin, grain.radius))
		snprintf(why, WORDS, "moves or turns faster than light");
	else if (!grain.fixed && !quern_placer_free(&f->placer, &centre))
		snprintf(why, WORDS, "has its centre within another grain");
	else good = may_stand(f, &grain, why);
	if (good) return add(f, &grain), QUERN_OK;
	snprintf(item, sizeof item, "%s.%u", param, k);
	return s->host->stop(s->run, QUERN_E_PARAM, item, -1, "the grain at (%g, %g, %g) m %s", centre.x[0],
		centre.x[1], centre.x[2], why);
}

static quern_status add_all(filling *f, const dem_place *grain, uint32_t n, const char *param) {
	quern_status status = QUERN_OK;
	f->placer.n_bodies = 0; /* they are asked for one by one */
	for (uint32_t i = 0; i < n && status == QUERN_OK; i++) status = add_given(f, &grain[i], param, i);
	return status;
}

static quern_status read_file(const dem *d, const quern_step *s, grain_table *table) {
	char why[200];
	if (!d->file || quern_grain_table_load(d->file, d, table, why)) return QUERN_OK;
	return s->host->stop(s->run, QUERN_E_PARAM, "file", -1, "%s: %s", d->file, why);
}

static quern_status store(filling *f) {
	const quern_step *s = f->step;
	const uint32_t dim = f->d->dim;
	if (f->before && f->n == f->before) return QUERN_OK;
	int32_t *from = s->host->memory(s->run, ((size_t)f->n + 1) * sizeof(int32_t));
	if (!from) return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < f->n; i++) from[i] = i < f->before ? (int32_t)i : -1;
	const quern_status status = s->host->remap(s->run, "grain", f->n, from, 0, NULL);
	if (status != QUERN_OK) return status;
	const quern_column *use = s->use;
	for (uint32_t i = f->before; i < f->n; i++) {
		const dem_place *g = &f->grain[i];
		for (uint32_t k = 0; k < dim; k++) {
			use[FILL_POSITION].real[k][i] = g->position[k];
			use[FILL_VELOCITY].real[k][i] = g->fixed ? 0 : g->velocity[k];
		}
		for (uint32_t k = 0; use[FILL_SPIN].real[0] && k < (dim == 3 ? 3u : 1u); k++)
			use[FILL_SPIN].real[k][i] = g->fixed ? 0 : g->spin[k];
		use[FILL_RADIUS].real[0][i] = g->radius;
		use[FILL_MASS].real[0][i] = mass_of(f->d, g);
		if (use[FILL_MATERIAL].index) use[FILL_MATERIAL].index[i] = g->kind;
		if (use[FILL_FIXED].index) use[FILL_FIXED].index[i] = g->fixed;
	}
	use[FILL_DISPLACEMENT].real[0][0] = INFINITY;
	return QUERN_OK;
}

static quern_real widest_of(const dem_place *grain, uint32_t n, quern_real most) {
	for (uint32_t i = 0; i < n; i++)
		if (grain[i].radius > most) most = grain[i].radius;
	return most;
}

/* The placer's cells hold the widest grain that any source may bring. */
static quern_status open_placer(filling *f, const grain_table *table) {
	const quern_step *s = f->step;
	quern_real most = quern_dem_most(f->d, NULL);
	most = widest_of(f->d->place.items, f->d->place.n, most);
	most = widest_of(table->grain, table->n, most);
	for (uint32_t i = 0; i < f->before; i++) most = fmax(most, s->use[FILL_RADIUS].real[0][i]);
	for (uint32_t k = 0; k < s->dim; k++)
		if (!((s->upper[k] - s->lower[k]) / most < 0x1p30))
			return s->host->stop(s->run, QUERN_E_PARAM, "material", -1,
				"the domain is %g m wide along axis %u, more than 2^29 of the widest grains",
				s->upper[k] - s->lower[k], k);
	const quern_status status = quern_placer_init(&f->placer, s->dim, s->lower, s->upper, s->periodic, most);
	f->placer.body = s->slot[SLOT_BODIES];
	f->placer.pose = f->pose = quern_body_poses_now(s, SLOT_BODIES);
	if (!f->pose) return QUERN_E_MEMORY;
	return status;
}

/* Regions that cannot be meant: more grains than a run can number. `all`: grains, of those before too. */
static quern_status check_fill(const dem *d, const quern_step *s, uint32_t i, quern_real *all) {
	const dem_fill *item = (const dem_fill *)d->fill.items + i;
	char param[40];
	quern_real grains = 1, least = INFINITY;
	for (uint32_t k = 0; k < d->n_materials; k++)
		if (item->of.share[k] > 0) least = fmin(least, d->material[k].radii.mean);
	for (uint32_t k = 0; k < d->dim; k++) {
		const quern_real across = (item->upper[k] - item->lower[k]) / (2 * least);
		grains *= across > 1 ? across : 1;
	}
	*all += grains;
	if (grains <= 0x1p30) return QUERN_OK;
	snprintf(param, sizeof param, "fill.%u", i);
	return s->host->stop(s->run, QUERN_E_PARAM, param, -1,
		"the region holds about %.2g grains of radius %g m; more than %.2g cannot be numbered", grains, least,
		0x1p30);
}

/* Whoever has asked for so many may have mistaken a unit. */
static const quern_real many = 2e7;
/* A grain takes so many bytes with its contacts (docs/run_folder.md). */
static const quern_real bytes_each = 600;

/* Of many it is said before they are placed, which takes a while. */
static quern_status check_fills(const dem *d, const quern_step *s) {
	quern_status status = QUERN_OK;
	quern_real all = 0;
	for (uint32_t i = 0; i < d->fill.n && status == QUERN_OK; i++) status = check_fill(d, s, i, &all);
	if (status == QUERN_OK && all > many)
		s->host->log(s->run, 2,
			"fill: boxes around its regions hold about %.2g grains; with their contacts they take some %.0f GB",
			all, all * bytes_each * 1e-9);
	return status;
}

/* What comes next must find them. */
static void add_before(filling *f) {
	const quern_column *u = f->step->use;
	for (uint32_t i = 0; i < f->before && !f->failed; i++) {
		dem_place grain = { .radius = u[FILL_RADIUS].real[0][i],
			.fixed = u[FILL_FIXED].index && u[FILL_FIXED].index[i],
			.kind = u[FILL_MATERIAL].index ? u[FILL_MATERIAL].index[i] : 0 };
		for (uint32_t k = 0; k < f->d->dim; k++) grain.position[k] = u[FILL_POSITION].real[k][i];
		add(f, &grain);
	}
}

/* ---- grains of a fill that grow together ---- */

static bool relax_inside(const quern_relax_job *job, const quern_real x[3]) {
	const filling *f = job->scene;
	for (uint32_t k = 0; k < f->d->dim; k++)
		if (!(x[k] >= f->item->lower[k] && x[k] <= f->item->upper[k])) return false;
	return quern_region_holds(&f->region, x);
}

static quern_real relax_gap(
	const quern_relax_job *job, uint32_t body, const quern_spot *spot, quern_real normal[3]) {
	const filling *f = job->scene;
	return quern_body_gap(&f->placer.body[body], &f->pose[body], job->dim, spot->x, spot->radius, normal);
}

static void take_over(filling *f, uint32_t from, const quern_spot *spot, uint32_t n) {
	const uint32_t before = f->n;
	f->n = from;
	for (uint32_t i = 0; i < n; i++) {
		dem_place grain = f->grain[from + i];
		if (!(spot[i].radius > 0)) continue;
		memcpy(grain.position, spot[i].x, sizeof grain.position);
		grain.radius = spot[i].radius;
		f->full[f->n] = grain.radius;
		f->grain[f->n++] = grain;
	}
	quern_placer_empty(&f->placer);
	for (uint32_t i = 0; i < f->n; i++) {
		quern_spot one = { .radius = f->grain[i].radius };
		memcpy(one.x, f->grain[i].position, f->d->dim * sizeof one.x[0]);
		quern_placer_add(&f->placer, &one);
	}
	if (before > f->n)
		f->step->host->log(
			f->step->run, 1, "%u grains found no room to grow and are left out", before - f->n);
}

/* The item's grains are those from `from` on. */
static quern_status relax(filling *f, const quern_bound *packer, uint32_t from) {
	const quern_step *s = f->step;
	if (f->n == from || !relaxes(f, packer)) return QUERN_OK;
	quern_relax_job job = { .dim = f->d->dim,
		.n = f->n - from,
		.full = f->full + from,
		.n_bodies = f->placer.n_bodies,
		.inside = relax_inside,
		.gap = relax_gap,
		.scene = f };
	memcpy(job.lower, s->lower, sizeof job.lower);
	memcpy(job.upper, s->upper, sizeof job.upper);
	memcpy(job.periodic, s->periodic, sizeof job.periodic);
	quern_spot *spot = s->host->memory(s->run, (size_t)f->n * sizeof *spot);
	if (!spot) return QUERN_E_MEMORY;
	memcpy(spot, f->placer.spot, (size_t)f->n * sizeof *spot);
	job.spot = spot + from;
	job.around = spot;
	job.n_around = from;
	const quern_status status = ((const quern_packer_ops *)packer->ops)->relax(packer->self, &job);
	if (status == QUERN_OK) take_over(f, from, job.spot, job.n);
	return status;
}

/* Where others stand in the way an item may bring nothing; where there is no place for it, it cannot be meant. */
static quern_status fill_item(filling *f, uint32_t i) {
	const quern_step *s = f->step;
	const bool above = ((const dem_fill *)f->d->fill.items)[i].above.n;
	const uint32_t before = f->n, held = fill_region(f, i);
	char param[40];
	if (f->failed || f->placer.failed) return QUERN_E_MEMORY;
	const quern_status status = relax(f, &s->slot[SLOT_PACKER][i], before);
	if (status != QUERN_OK) return status;
	snprintf(param, sizeof param, "fill.%u.%s", i, held ? "above" : "region");
	if (!held)
		return s->host->stop(s->run, QUERN_E_PARAM, param, -1, "no place of the domain lies in the region");
	if (above && f->n == before)
		return s->host->stop(s->run, QUERN_E_PARAM, param, -1, "no grain of the region has room above that");
	return QUERN_OK;
}

static quern_status fill_all(filling *f, const grain_table *table) {
	const quern_step *s = f->step;
	const dem *d = f->d;
	const dem_fill *item = d->fill.items;
	add_before(f);
	quern_status status = add_all(f, d->place.items, d->place.n, "place");
	if (status == QUERN_OK) status = add_all(f, table->grain, table->n, "file");
	if (status == QUERN_OK) status = check_fills(d, s);
	if (status != QUERN_OK) return status;
	for (int fixed = 1; fixed >= 0; fixed--) /* floors first: what falls must find them */
		for (uint32_t i = 0; i < d->fill.n && status == QUERN_OK; i++)
			if (item[i].fixed == fixed) status = fill_item(f, i);
	if (status != QUERN_OK) return status;
	if (f->failed || f->placer.failed) return QUERN_E_MEMORY;
	if (!f->n && !d->source.n && d->from && !d->fill.n)
		return s->host->stop(s->run, QUERN_E_PARAM, "from", -1,
			"that state has no grains left: name a frame from before, RUN:FRAME, or give a source");
	if (!f->n && !d->source.n)
		return s->host->stop(s->run, QUERN_E_PARAM, "fill", -1,
			"no grain has room: is the region too small, or a body in it?");
	if (f->n > f->before || !f->before) s->host->log(s->run, 0, "%u grains placed", f->n - f->before);
	return store(f);
}

/* The hybrid books the impulse of each force in its step, and changes weights between steps; an integrator that evaluates forces at
 * the step's end gives half of it in the next. */
static quern_status refuse_two_steps(const quern_step *s) {
	const quern_bound *integrator = &s->slot[SLOT_INTEGRATOR][0];
	if (!s->host->has(s->run, "hybrid") || quern_integrator_ahead(integrator->ops, s->dim) < 1)
		return QUERN_OK;
	return s->host->stop(s->run, QUERN_E_PARAM, "integrator", -1,
		"%s gives half of each kick in the next step, and the books of a hybrid take one: use position_verlet or "
		"symplectic_euler",
		integrator->id);
}

/* Grains stand for stiff ones: where their weight alone presses them into each other, the bed is too dense and too
 * low. */
static void warn_of_softness(const dem *d, const quern_step *s) {
	bool loose = false;
	for (uint32_t i = 0; i < d->fill.n; i++) loose = loose || !((const dem_fill *)d->fill.items)[i].fixed;
	if (!loose || !(d->sinks > 0.01)) return;
	s->host->log(s->run, 2,
		"under %.3g m of fill grains overlap by about %.2g %% of a diameter, so that the bed is too dense: "
		"the contacts "
		"(%s) have %.2g N/m there; take %.2g N/m, for half a percent",
		d->height, 100 * d->sinks, d->stiffest, d->stiffness, d->stiffness * d->sinks / 0.005);
}

static quern_status open_books(const dem *d, const quern_step *s) {
	const quern_status status = d->outlets ? book_open(s, "grain_face", outlet_faces(s)) : QUERN_OK;
	if (status != QUERN_OK || !d->sources) return status;
	if (d->blends && book_open(s, "grain_share", d->source.n * d->n_materials) != QUERN_OK)
		return QUERN_E_MEMORY;
	return book_open(s, "grain_source", d->source.n);
}

quern_status quern_dem_fill(const void *self, const quern_step *s) {
	if (refuse_two_steps(s) != QUERN_OK) return QUERN_E_PARAM;
	filling f = { .d = self, .step = s, .before = s->host->set(s->run, "grain").n };
	grain_table table = { 0 };
	quern_status status = open_books(f.d, s);
	if (status == QUERN_OK) status = quern_dem_begin(f.d, s);
	if (status == QUERN_OK) status = read_file(f.d, s, &table);
	if (status == QUERN_OK) status = open_placer(&f, &table);
	if (status == QUERN_OK) status = fill_all(&f, &table);
	if (status == QUERN_OK) status = quern_dem_box_begin(f.d, s);
	if (status == QUERN_OK) warn_of_softness(f.d, s);
	quern_placer_finish(&f.placer);
	quern_grain_table_finish(&table);
	free(f.grain);
	free(f.full);
	return status;
}

/* Of sqrt(H/g), H the height of the fill: for so long grains must have been at rest. A bed bounces on its own springs, and at each turn it
 * has no kinetic energy: half a period is 2 sqrt(e H/g) where its lowest grains are pressed together by e. */
static const quern_real quiet = 0.25;
/* Of the energy at rest: from there down grains hardly rearrange, and what is left is taken out. */
static const quern_real nearly = 100;
enum { LOOK_EVERY = 50, LEAST_QUIET = 3 * LOOK_EVERY };

static void stop_grains(const quern_step *s, uint32_t n) {
	const quern_column *u = s->use;
	for (uint32_t k = 0; k < s->dim; k++) memset(u[FILL_VELOCITY].real[k], 0, n * sizeof(quern_real));
	for (uint32_t k = 0; k < quern_shape_size(QUERN_AXIAL, s->dim) && u[FILL_SPIN].real[0]; k++)
		memset(u[FILL_SPIN].real[k], 0, n * sizeof(quern_real));
}

/* Stops grains when their kinetic energy has passed a maximum, where springs and weight are in balance. `sway` keeps the energy of the last
 * look, negative if it had fallen since the one before. */
static void take_sway(const quern_step *s, uint32_t n, quern_real energy, quern_real bound) {
	quern_real *sway = s->use[FILL_SWAY].real[0];
	const bool rose = *sway > 0, falls = energy < fabs(*sway);
	if (rose && falls && energy > bound && *sway < nearly * bound) {
		stop_grains(s, n);
		*sway = 0;
	} else *sway = falls ? -energy : energy;
}

/* At rest: the mean kinetic energy has been small against m g d for a while, looked at every 50 steps, and not before the
 * grains had the time to fall by a diameter. */
bool quern_dem_settled(const void *self, const quern_step *s) {
	const dem *d = self;
	const cloud grains = dem_cloud(s, NULL);
	if (!d->settles || !grains.n) return true;
	if (s->substep % LOOK_EVERY) return false;
	if (s->substep >= d->settle_most) {
		s->host->log(
			s->run, 2, "settling was cut off after %d steps: the grains are not at rest", d->settle_most);
		return true;
	}
	const quern_real diameter = dem_diameter(d), g = quern_gravity_size(d->dim, s->gravity);
	const quern_real fall = 2 * sqrt(2 * diameter / g);
	int32_t *stirred = s->use[FILL_STIRRED].index;
	cloud_sums c;
	quern_real energy = 0;
	if (!cloud_open(&c, s->host, s->run, &grains)) return false;
	CLOUD_ADD(&c, i, 0.5 * cloud_square(&s->use[FILL_VELOCITY], i, s->dim), energy);
	const quern_real bound = d->rest * cloud_total(&c) * g * diameter;
	const bool falling = (quern_real)s->substep * s->dt < fall;
	if (falling || !(energy <= bound)) *stirred = (int32_t)s->substep;
	if (!falling) take_sway(s, grains.n, energy, bound);
	const int64_t still = s->substep - *stirred;
	const bool rests =
		still >= LEAST_QUIET && (quern_real)still * s->dt >= quiet * sqrt((d->height + diameter) / g);
	if (rests)
		*stirred = 0, s->use[FILL_SWAY].real[0][0] = 0; /* a settled state that was kept does not know them */
	return rests;
}

/* What falls comes to rest within 2 to 10 sqrt(H/g): docs/theory/grains.md, section 6. */
quern_real quern_dem_settling(const void *self, const quern_step *s) {
	const dem *d = self;
	const quern_real g = quern_gravity_size(d->dim, s->gravity);
	if (!d->settles || !(g > 0) || !(s->dt > 0)) return 0;
	const quern_real steps = 4 * sqrt((d->height + dem_diameter(d)) / g) / s->dt;
	return steps < d->settle_most ? steps : d->settle_most;
}
