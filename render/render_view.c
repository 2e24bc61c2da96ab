/* SPDX-License-Identifier: MIT */
#include "render.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static bool is_fixed(const render_cloud *cloud, const render_frame *f, size_t i) {
	return cloud == &f->grains && cloud->sort[i] == RENDER_FIXED;
}

static void add(render_view *v, const double x[3], double half) {
	for (int k = 0; k < 3 && isfinite(x[0] + x[1] + x[2]); k++) {
		v->low[k] = fmin(v->low[k], x[k] - half);
		v->high[k] = fmax(v->high[k], x[k] + half);
	}
}

bool quern_render_shown(const render_view *v, const render_frame *f, const render_cloud *cloud, size_t i) {
	for (int k = 0; k < f->dimension - 1 && is_fixed(cloud, f, i); k++)
		if (cloud->position[i][k] < v->low[k] || cloud->position[i][k] > v->high[k]) return false;
	return true;
}

static bool is_within(const double x[3], const double low[3], const double high[3]) {
	for (int k = 0; k < 3; k++)
		if (x[k] < low[k] || x[k] > high[k]) return false;
	return true;
}

/* Grains that make up a rough floor do not widen the picture, unless there are no others. */
static size_t list_places(const render_frame *f, double (*place)[3], double *half) {
	const bool all = !f->points.n && !quern_render_has(&f->grains, RENDER_WHOLE) &&
					 !quern_render_has(&f->grains, RENDER_SHARED);
	size_t n = 0;
	for (size_t i = 0; i < f->grains.n; i++)
		if (all || !is_fixed(&f->grains, f, i)) {
			memcpy(place[n], f->grains.position[i], sizeof *place);
			half[n++] = f->grains.size[i];
		}
	for (size_t i = 0; i < f->points.n; i++) {
		memcpy(place[n], f->points.position[i], sizeof *place);
		half[n++] = 0.5 * f->points.size[i];
	}
	return n;
}

/* How far out what moves is no stray: by half of the longest side beyond 99.8 % of it along each axis. */
static void set_fence(double (*place)[3], size_t n, double low[3], double high[3]) {
	enum { LEAST = 50, PART = 1000 };
	const size_t out = n < LEAST ? 0 : n / PART ? n / PART : 1;
	double *along = quern_take(n + 1, sizeof(double)), longest = 0;
	for (int k = 0; k < 3; k++) {
		for (size_t i = 0; i < n; i++) along[i] = place[i][k];
		quern_render_quantile(along, n, 0);
		low[k] = out ? along[out] : -INFINITY;
		high[k] = out ? along[n - 1 - out] : INFINITY;
		longest = fmax(longest, high[k] - low[k]);
	}
	for (int k = 0; k < 3; k++) low[k] -= 0.5 * longest, high[k] += 0.5 * longest;
	free(along);
}

static void add_clouds(render_view *v, const render_frame *f) {
	const size_t most = f->grains.n + f->points.n + 1;
	double(*place)[3] = quern_take(most, sizeof *place), *half = quern_take(most, sizeof(double));
	double low[3], high[3];
	const size_t n = list_places(f, place, half);
	set_fence(place, n, low, high);
	for (int k = 0; k < 3; k++) v->low[k] = INFINITY, v->high[k] = -INFINITY;
	for (size_t i = 0; i < n; i++)
		if (is_within(place[i], low, high)) add(v, place[i], half[i]);
	free(place);
	free(half);
}

/* What is occupied, down to the floor unless that is far below or nothing falls. */
static void crop(render_view *v, const render_frame *f) {
	const int up = f->dimension - 1;
	double floor = INFINITY, most = 0;
	add_clouds(v, f);
	for (int k = 0; k < f->dimension; k++) most = fmax(most, v->high[k] - v->low[k]);
	if (f->scene && f->scene->general.gravity[up] != 0) floor = f->scene->general.lower[up];
	for (size_t i = 0; i < f->grains.n; i++)
		if (is_fixed(&f->grains, f, i) && quern_render_shown(v, f, &f->grains, i))
			floor = fmin(floor, f->grains.position[i][up] - f->grains.size[i]);
	if (floor < v->low[up] && floor > v->low[up] - 0.5 * most) v->low[up] = floor;
	if (f->dimension == 2) v->low[2] = v->high[2] = 0;
	/* a single place; or so little, so far from the origin, that its numbers hardly differ */
	double far = 0;
	for (int k = 0; k < f->dimension; k++) far = fmax(far, fmax(fabs(v->low[k]), fabs(v->high[k])));
	if (!(most > fmax(1e-9 * far, 1e-12))) most = 1;
	const double margin = (f->dimension == 2 ? 0.03 : 0.02) * most;
	for (int k = 0; k < f->dimension; k++) {
		if (f->dimension == 3 && k == up) continue;
		v->low[k] -= margin;
		v->high[k] += margin;
	}
}

render_view quern_render_view_of(const render_frame *f, const render_wish *wish) {
	render_view v = { .right = { 1, 0, 0 }, .up = { 0, 1, 0 }, .away = { 0, 0, -1 } };
	if (f->dimension == 3) {
		const double turn = -0.45, lift = 0.40;
		const double away[3] = { -sin(turn), cos(turn), 0 };
		v.right[0] = cos(turn), v.right[1] = sin(turn);
		v.up[0] = sin(lift) * away[0], v.up[1] = sin(lift) * away[1], v.up[2] = cos(lift);
		v.away[0] = cos(lift) * away[0], v.away[1] = cos(lift) * away[1], v.away[2] = -sin(lift);
	}
	v.fixed = wish->has_view;
	memcpy(v.low, wish->low, sizeof v.low);
	memcpy(v.high, wish->high, sizeof v.high);
	if (!v.fixed) crop(&v, f);
	return v;
}

/* Of something round at x that reaches `half` far. */
static void widen(const render_view *v, const double x[3], double half, double low[2], double high[2]) {
	const double at[2] = { dot(v->right, x), dot(v->up, x) };
	for (int k = 0; k < 2 && isfinite(at[k]); k++) {
		low[k] = fmin(low[k], at[k] - half);
		high[k] = fmax(high[k], at[k] + half);
	}
}

void quern_render_view_fit(render_view *v, const render_frame *f, double most_width, double most_height) {
	double low[2] = { INFINITY, INFINITY }, high[2] = { -INFINITY, -INFINITY };
	/* in 3-D of the ground alone, where nothing else is wished: the upper ones are empty */
	const int corners = f->dimension == 3 && !v->fixed ? 4 : 8;
	for (int corner = 0; corner < corners; corner++) {
		double x[3];
		for (int k = 0; k < 3; k++) x[k] = corner >> k & 1 ? v->high[k] : v->low[k];
		widen(v, x, 0, low, high);
	}
	for (size_t i = 0; i < f->grains.n && !v->fixed; i++)
		if (!is_fixed(&f->grains, f, i) && is_within(f->grains.position[i], v->low, v->high))
			widen(v, f->grains.position[i], f->grains.size[i], low, high);
	for (size_t i = 0; i < f->points.n && !v->fixed; i++)
		if (is_within(f->points.position[i], v->low, v->high))
			widen(v, f->points.position[i], f->points.size[i], low, high);
	v->scale = fmin(most_width / (high[0] - low[0]), most_height / (high[1] - low[1]));
	v->left = low[0];
	v->top = high[1];
	v->width = v->scale * (high[0] - low[0]);
	v->height = v->scale * (high[1] - low[1]);
}

void quern_render_project(const render_view *v, const double x[3], double out[3]) {
	out[0] = (dot(v->right, x) - v->left) * v->scale;
	out[1] = (v->top - dot(v->up, x)) * v->scale;
	out[2] = dot(v->away, x);
}
