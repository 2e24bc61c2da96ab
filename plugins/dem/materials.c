/* SPDX-License-Identifier: MIT */
/* materials - what grains are made of, by name: who is of which, what pairs of them have of their own, and mixtures by mass.
 * docs/theory/grains.md, section 7 */
#include "../common/name.h"
#include "dem.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WORDS = 240 };

/* ---- names ---- */

int32_t quern_dem_material(const dem *d, const char *name) {
	if (!name) return 0;
	for (uint32_t k = 0; k < d->n_materials; k++)
		if (d->material[k].name && !strcmp(d->material[k].name, name)) return (int32_t)k;
	return -1;
}

/* Which there are, or what to do where none has a name. */
static const char *known(const dem *d, char out[WORDS]) {
	size_t n = 0;
	snprintf(out, WORDS,
		"the grains' material has no name; materials: {sand: {density: ..., radius: ...}} gives one");
	for (uint32_t k = 0; k < d->n_materials && d->material[k].name && n < WORDS; k++)
		n += (size_t)snprintf(out + n, WORDS - n, "%s%s", k ? ", " : "grains are of: ", d->material[k].name);
	return out;
}

static quern_status refuse_name(
	const dem *d, const quern_setup *setup, quern_err *err, const char *param, const char *name) {
	char there[WORDS];
	return setup->host->fail(
		err, QUERN_E_PARAM, param, "no material is called '%.60s'; %s", name, known(d, there));
}

/* ---- materials, and who is of which ---- */

static quern_status check_name(const dem *d, const quern_setup *setup, uint32_t k, quern_err *err) {
	const char *name = d->material[k].name;
	char param[80];
	snprintf(param, sizeof param, "materials.%.60s", name);
	if (!quern_name_is_good(name))
		return setup->host->fail(err, QUERN_E_PARAM, param,
			"'%.60s' is no name: it must be letters, digits and '_', beginning with a letter, at most %d of "
			"them",
			name, LONGEST_NAME);
	if (quern_dem_material(d, name) == (int32_t)k) return QUERN_OK;
	return setup->host->fail(
		err, QUERN_E_PARAM, param, "two materials are called '%s': give each its own name", name);
}

static quern_status read_mix(
	const dem *d, const quern_setup *setup, dem_blend *of, const char *param, quern_err *err) {
	const dem_share *mix = of->mix.items;
	char at[120];
	quern_real sum = 0;
	for (uint32_t i = 0; i < of->mix.n; i++) {
		snprintf(at, sizeof at, "%.60s.mix.%.40s", param, mix[i].name);
		const int32_t k = quern_dem_material(d, mix[i].name);
		if (k < 0) return refuse_name(d, setup, err, at, mix[i].name);
		if (of->share[k] > 0)
			return setup->host->fail(err, QUERN_E_PARAM, at, "'%s' stands twice in the mix", mix[i].name);
		of->share[k] = mix[i].share;
		sum += mix[i].share;
	}
	snprintf(at, sizeof at, "%.60s.mix", param);
	if (!(fabs(sum - 1) <= 1e-6))
		return setup->host->fail(
			err, QUERN_E_PARAM, at, "the shares add up to %g %%, must be 100 %%", 100 * sum);
	for (uint32_t k = 0; k < d->n_materials; k++) of->share[k] /= sum;
	return QUERN_OK;
}

/* `list`, `i`: whose it is. */
static quern_status name_blend(
	const dem *d, const quern_setup *setup, dem_blend *of, const char *list, uint32_t i, quern_err *err) {
	char param[60];
	snprintf(param, sizeof param, "%s.%u", list, i);
	if (of->mix.n) return read_mix(d, setup, of, param, err);
	const int32_t k = quern_dem_material(d, of->material);
	snprintf(param, sizeof param, "%s.%u.material", list, i);
	if (k < 0) return refuse_name(d, setup, err, param, of->material);
	of->share[k] = 1;
	return QUERN_OK;
}

static quern_status name_place(const dem *d, const quern_setup *setup, uint32_t i, quern_err *err) {
	dem_place *place = (dem_place *)d->place.items + i;
	char param[60];
	place->kind = quern_dem_material(d, place->material);
	snprintf(param, sizeof param, "place.%u.material", i);
	return place->kind < 0 ? refuse_name(d, setup, err, param, place->material) : QUERN_OK;
}

/* What a hybrid owes to a cell is mass of no material. */
static quern_status refuse_hybrid(const dem *d, const quern_setup *setup, quern_err *err) {
	if (d->n_materials == 1 || !setup->host->keeps(setup, "hybrid")) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, "materials",
		"a hybrid turns grains into a continuum of one material and back: give one material, or leave hybrid "
		"out");
}

quern_status quern_dem_name_materials(dem *d, const quern_setup *setup, quern_err *err) {
	quern_status status = QUERN_OK;
	dem_material *named = d->materials.items;
	d->stream = setup->stream;
	d->n_materials = d->materials.n ? d->materials.n : 1;
	d->material = d->materials.n ? named : &d->alone;
	d->mixed = d->mixed || d->n_materials > 1;
	d->alone.radii.stream = setup->stream;
	for (uint32_t k = 0; k < d->materials.n; k++) {
		named[k].radii.stream = setup->stream;
		if (check_name(d, setup, k, err) != QUERN_OK) return QUERN_E_PARAM;
	}
	for (uint32_t k = 0; k < MOST_MATERIALS; k++)
		for (uint32_t l = 0; l < MOST_MATERIALS; l++) d->pair[k][l] = -1;
	dem_fill *fill = d->fill.items;
	for (uint32_t i = 0; i < d->fill.n && status == QUERN_OK; i++)
		status = name_blend(d, setup, &fill[i].of, "fill", i, err);
	dem_source *pours = d->source.items;
	for (uint32_t i = 0; i < d->source.n && status == QUERN_OK; i++) {
		status = name_blend(d, setup, &pours[i].of, "source", i, err);
		d->blends = d->blends || pours[i].of.mix.n;
	}
	for (uint32_t i = 0; i < d->place.n && status == QUERN_OK; i++) status = name_place(d, setup, i, err);
	return status == QUERN_OK ? refuse_hybrid(d, setup, err) : status;
}

/* ---- pairs ---- */

static const char *material_of(const quern_bound *body) { return ((const body_item *)body->item)->material; }

static const char *name_in(const dem *d, uint32_t i, uint32_t side) {
	const dem_pair *pair = (const dem_pair *)d->pairs.items + i;
	return ((const dem_word *)pair->between.items)[side].name;
}

/* Whether item i is between these two, in either order. */
static bool is_between(const dem *d, uint32_t i, const char *one, const char *two) {
	if (((const dem_pair *)d->pairs.items)[i].between.n != 2) return false;
	const char *a = name_in(d, i, 0), *b = name_in(d, i, 1);
	return one && two && ((!strcmp(a, one) && !strcmp(b, two)) || (!strcmp(a, two) && !strcmp(b, one)));
}

static int32_t item_between(const dem *d, const char *one, const char *two) {
	for (uint32_t i = 0; i < d->pairs.n; i++)
		if (is_between(d, i, one, two)) return (int32_t)i;
	return -1;
}

static bool is_of_a_body(const quern_bound *body, uint32_t n, const char *name) {
	for (uint32_t b = 0; b < n; b++)
		if (material_of(&body[b]) && !strcmp(material_of(&body[b]), name)) return true;
	return false;
}

static quern_status check_pair(const dem *d, const quern_setup *setup, uint32_t i, const quern_bound *body,
	uint32_t n_bodies, quern_err *err) {
	const dem_pair *pair = (const dem_pair *)d->pairs.items + i;
	char param[60], there[WORDS];
	snprintf(param, sizeof param, "pairs.%u.between", i);
	if (pair->between.n != 2)
		return setup->host->fail(
			err, QUERN_E_PARAM, param, "it has %u names, must have two: [sand, steel]", pair->between.n);
	for (uint32_t side = 0; side < 2; side++)
		if (quern_dem_material(d, name_in(d, i, side)) < 0 &&
			!is_of_a_body(body, n_bodies, name_in(d, i, side)))
			return setup->host->fail(err, QUERN_E_PARAM, param,
				"neither grains nor a body are of '%.60s'; %s", name_in(d, i, side), known(d, there));
	if (quern_dem_material(d, name_in(d, i, 0)) < 0 && quern_dem_material(d, name_in(d, i, 1)) < 0)
		return setup->host->fail(err, QUERN_E_PARAM, param,
			"no grains are of %s or of %s, and bodies do not touch each other", name_in(d, i, 0),
			name_in(d, i, 1));
	const int32_t first = item_between(d, name_in(d, i, 0), name_in(d, i, 1));
	if (first == (int32_t)i) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, param,
		"%s and %s are a pair already, number %d: give it once", name_in(d, i, 0), name_in(d, i, 1), first);
}

/* A word that nothing knows is misspelt. */
static quern_status check_body(
	const dem *d, const quern_setup *setup, const quern_bound *body, uint32_t b, quern_err *err) {
	const char *name = material_of(&body[b]);
	char which[BODY_WORDS], there[WORDS];
	bool used = !name || quern_dem_material(d, name) >= 0;
	for (uint32_t i = 0; i < d->pairs.n; i++)
		used = used || !strcmp(name_in(d, i, 0), name) || !strcmp(name_in(d, i, 1), name);
	if (used) return QUERN_OK;
	return setup->host->fail(err, QUERN_E_PARAM, NULL,
		"%s, is of '%.60s', which is no material of grains and stands in none of grains.pairs; %s",
		quern_body_say(&body[b], b, which), name, known(d, there));
}

quern_status quern_dem_pair_up(
	dem *d, const quern_setup *setup, const quern_bound *body, uint32_t n_bodies, quern_err *err) {
	const uint32_t n = d->n_materials;
	for (uint32_t i = 0; i < d->pairs.n; i++)
		if (check_pair(d, setup, i, body, n_bodies, err) != QUERN_OK) return QUERN_E_PARAM;
	for (uint32_t b = 0; b < n_bodies; b++)
		if (check_body(d, setup, body, b, err) != QUERN_OK) return QUERN_E_PARAM;
	for (uint32_t k = 0; k < n; k++)
		for (uint32_t l = 0; l < n; l++)
			d->pair[k][l] = item_between(d, d->material[k].name, d->material[l].name);
	d->on_body = malloc(((size_t)n_bodies * n + 1) * sizeof *d->on_body);
	if (!d->on_body) return QUERN_E_MEMORY;
	for (uint32_t b = 0; b < n_bodies; b++)
		for (uint32_t k = 0; k < n; k++)
			d->on_body[b * n + k] = item_between(d, d->material[k].name, material_of(&body[b]));
	return QUERN_OK;
}

void quern_dem_part(dem *d) {
	free(d->on_body);
	d->on_body = NULL;
}

/* ---- mixtures ---- */

quern_real quern_dem_widest(const dem *d, const quern_real share[MOST_MATERIALS]) {
	quern_real most = 0;
	for (uint32_t k = 0; k < d->n_materials; k++)
		if (share[k] > 0 && d->material[k].radii.mean > most) most = d->material[k].radii.mean;
	return most;
}

bool quern_dem_pours(const dem *d, uint32_t material) {
	const dem_source *pours = d->source.items;
	bool any = false;
	for (uint32_t i = 0; i < d->source.n; i++) any = any || pours[i].of.share[material] > 0;
	return any;
}

quern_real quern_dem_most(const dem *d, const quern_real *share) {
	quern_real most = 0;
	for (uint32_t k = 0; k < d->n_materials; k++)
		if (!share || share[k] > 0) most = fmax(most, quern_radius_most(&d->material[k].radii));
	return most;
}

quern_real quern_dem_radius(const dem *d, uint32_t m, const quern_host *host, uint32_t stream, uint64_t k) {
	radius_law law = d->material[m].radii;
	law.stream += stream;
	return quern_radius_draw(&law, host, k);
}

/* Nobody knows beforehand how many grains there will be, so that every beginning of the row must have its shares. Only a material
 * that is not above its own may come next, and is then above by less than one grain. Each of these comes with the probability that
 * makes good what it lacks, in numbers of grains; but one that would lack more than the heaviest grain comes at once. */
int32_t quern_dem_mix(const dem *d, const quern_real share[MOST_MATERIALS],
	const quern_real placed[MOST_MATERIALS], const quern_host *host, uint32_t stream, uint64_t k) {
	quern_real mass[MOST_MATERIALS], weight[MOST_MATERIALS];
	quern_real whole = 0, heaviest = 0, sum = 0, most = -1, u[2];
	uint32_t first = 0;
	for (uint32_t m = 0; m < d->n_materials; m++) {
		whole += placed[m];
		mass[m] = share[m] > 0 ? quern_radius_mass(
									 quern_dem_radius(d, m, host, stream, k), d->material[m].density, d->dim)
							   : 0;
		heaviest = mass[m] > heaviest ? mass[m] : heaviest;
	}
	for (uint32_t m = 0; m < d->n_materials; m++) {
		const quern_real lacks = share[m] * whole - placed[m], without = lacks + share[m] * heaviest;
		weight[m] = share[m] > 0 && lacks >= 0 ? without / mass[m] : 0;
		sum += weight[m];
		if (share[m] > 0 && without > most) most = without, first = m;
	}
	if (most > heaviest) return (int32_t)first;
	host->random(d->stream + STREAM_MIX + stream, k, 0, u);
	quern_real at = u[0] * sum;
	for (uint32_t m = 0; m < d->n_materials; m++) {
		if (weight[m] > 0 && at < weight[m]) return (int32_t)m;
		at -= weight[m];
	}
	return (int32_t)first;
}
