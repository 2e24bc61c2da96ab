/* SPDX-License-Identifier: MIT */
#include "render.h"
#include <math.h>
#include <stdlib.h>

/* Spheres and cubes go into a raster twice as fine as the picture, pixel by pixel with their depth: so they meet each
 * other where they do in space, and edges come out smooth. */
enum { FINE = 2 };

typedef struct {
	int width, height;
	float *depth; /* m away from the eye; infinite where nothing is */
	render_colour *colour;
	double scale;     /* fine pixels per m */
	double near, far; /* m */
	const render_view *view;
} raster;

/* Light from the upper left, in front; what is far away is paler. */
static render_colour lit(const raster *r, render_colour colour, const double normal[3], double depth) {
	const double facing = fmax(0, -0.38 * normal[0] + 0.70 * normal[1] - 0.60 * normal[2]);
	const double light = 0.58 + 0.56 * facing,
				 haze = 0.20 * (depth - r->near) / fmax(r->far - r->near, 1e-300);
	const render_colour shaded = { fmin(colour.r * light, 1), fmin(colour.g * light, 1),
		fmin(colour.b * light, 1) };
	return quern_render_mix(shaded, (render_colour) { 1, 1, 1 }, fmin(fmax(haze, 0), 0.20));
}

static void put(raster *r, int x, int y, double depth, render_colour colour) {
	const size_t i = (size_t)y * (size_t)r->width + (size_t)x;
	if (!(depth < (double)r->depth[i])) return;
	r->depth[i] = (float)depth;
	r->colour[i] = colour;
}

typedef struct {
	int x[2], y[2];
} window;

/* From first to last; none, with the first behind the last, where it lies beside the picture. */
static void pixels(double at, double reach, int size, int out[2]) {
	out[0] = (int)fmin(fmax(floor(at - reach), 0), size);
	out[1] = (int)fmax(fmin(ceil(at + reach), size - 1), -1);
}

static window around(const raster *r, const double at[3], double reach) {
	window w;
	pixels(at[0], reach, r->width, w.x);
	pixels(at[1], reach, r->height, w.y);
	return w;
}

/* A grain that shares its mass with the continuum has a white face. */
static void put_sphere(raster *r, const double at[3], double radius, render_colour colour, int sort) {
	const double reach = fmax(radius * r->scale, 0.7);
	const window w = around(r, at, reach);
	for (int y = w.y[0]; y <= w.y[1]; y++)
		for (int x = w.x[0]; x <= w.x[1]; x++) {
			const double u = (x + 0.5 - at[0]) / reach, v = (at[1] - y - 0.5) / reach,
						 rest = 1 - u * u - v * v;
			if (rest < 0) continue;
			const double normal[3] = { u, v, -sqrt(rest) };
			const bool face = sort == RENDER_SHARED && rest > 0.75;
			const render_colour own = face ? (render_colour) { 0.97, 0.97, 0.97 } : colour;
			const render_colour rim = quern_render_mix(own, quern_render_ink, rest < 0.12 ? 0.30 : 0);
			const double depth = at[2] + radius * normal[2];
			put(r, x, y, depth, lit(r, rim, normal, depth));
		}
}

/* A ray through a cube along the axes: it enters where the last of three slabs does. */
static void put_cube(raster *r, const double at[3], double half, render_colour colour) {
	const render_view *v = r->view;
	const double reach = 1.8 * half * r->scale;
	const window w = around(r, at, reach);
	for (int y = w.y[0]; y <= w.y[1]; y++)
		for (int x = w.x[0]; x <= w.x[1]; x++) {
			const double u = (x + 0.5 - at[0]) / r->scale, t = (at[1] - y - 0.5) / r->scale;
			double enter = -INFINITY, leave = INFINITY;
			int face = 0;
			for (int k = 0; k < 3; k++) {
				const double from = u * v->right[k] + t * v->up[k], slope = 1 / v->away[k];
				const double a = (-half - from) * slope, b = (half - from) * slope;
				if (fmin(a, b) > enter) enter = fmin(a, b), face = k;
				leave = fmin(leave, fmax(a, b));
			}
			if (!(enter < leave)) continue;
			const double side = v->away[face] > 0 ? -1 : 1;
			const double normal[3] = { side * v->right[face], side * v->up[face], side * v->away[face] };
			put(r, x, y, at[2] + enter, lit(r, colour, normal, at[2] + enter));
		}
}

static void put_cloud(raster *r, const render_style *s, const render_cloud *cloud) {
	for (size_t i = 0; i < cloud->n; i++) {
		double at[3];
		if (cloud == &s->frame->cells && cloud->value[i] == 0) continue;
		if (!quern_render_shown(s->view, s->frame, cloud, i)) continue;
		quern_render_project(s->view, cloud->position[i], at);
		at[0] *= FINE;
		at[1] *= FINE;
		const render_colour colour = quern_render_colour_of(s, cloud, i);
		if (cloud == &s->frame->grains) put_sphere(r, at, cloud->size[i], colour, cloud->sort[i]);
		else put_cube(r, at, (cloud == &s->frame->points ? 0.42 : 0.5) * cloud->size[i], colour);
	}
}

/* What lies in a hollow sees less of the sky: looks around, each at what stands nearer to the eye. What stands very
 * much nearer is something else in front, and casts nothing. */
static double openness(const raster *r, int x, int y, double reach) {
	const double here = (double)r->depth[(size_t)y * (size_t)r->width + (size_t)x];
	double hidden = 0;
	for (int k = 0; k < 18; k++) {
		const double way = reach * (0.35 + 0.1 * k), angle = 2.399963 * k; /* a sunflower */
		const int u = x + (int)lround(way * cos(angle)), v = y + (int)lround(way * sin(angle));
		if (u < 0 || v < 0 || u >= r->width || v >= r->height) continue;
		const double above =
			(here - (double)r->depth[(size_t)v * (size_t)r->width + (size_t)u]) * r->scale / way;
		if (above > 0 && isfinite(above)) hidden += above / (1 + above * above);
	}
	return 1 - 0.075 * hidden;
}

/* Averages FINE x FINE pixels into one; cairo wants colours multiplied by alpha. */
static cairo_surface_t *smooth(const raster *r, double reach) {
	const int width = r->width / FINE, height = r->height / FINE;
	cairo_surface_t *image = cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width, height);
	unsigned char *data = cairo_image_surface_get_data(image);
	const int stride = cairo_image_surface_get_stride(image);
	for (int y = 0; y < height; y++)
		for (int x = 0; x < width; x++) {
			double sum[4] = { 0 };
			for (int k = 0; k < FINE * FINE; k++) {
				const int u = FINE * x + k % FINE, v = FINE * y + k / FINE;
				const size_t i = (size_t)v * (size_t)r->width + (size_t)u;
				if (!isfinite(r->depth[i])) continue;
				const double open = openness(r, u, v, reach);
				sum[0] += r->colour[i].b * open;
				sum[1] += r->colour[i].g * open;
				sum[2] += r->colour[i].r * open;
				sum[3] += 1;
			}
			uint32_t pixel = 0;
			for (int k = 0; k < 4; k++) pixel |= (uint32_t)lround(255 * sum[k] / (FINE * FINE)) << 8 * k;
			*(uint32_t *)(void *)(data + y * stride + 4 * x) = pixel;
		}
	cairo_surface_mark_dirty(image);
	return image;
}

/* ---- the ground ---- */

static void line_between(cairo_t *c, const render_style *s, const double from[3], const double to[3]) {
	double a[3], b[3];
	quern_render_project(s->view, from, a);
	quern_render_project(s->view, to, b);
	cairo_move_to(c, a[0], a[1]);
	cairo_line_to(c, b[0], b[1]);
}

/* A pale floor with lines at round distances, below all that is shown. */
static void draw_ground(cairo_t *c, const render_style *s) {
	const render_view *v = s->view;
	const double level = v->low[2], longest = fmax(v->high[0] - v->low[0], v->high[1] - v->low[1]);
	const double step = quern_render_round_step(longest / 6);
	const double corner[4][2] = { { v->low[0], v->low[1] }, { v->high[0], v->low[1] },
		{ v->high[0], v->high[1] }, { v->low[0], v->high[1] } };
	for (int k = 0; k < 4; k++) {
		double at[3];
		quern_render_project(v, (const double[3]) { corner[k][0], corner[k][1], level }, at);
		cairo_line_to(c, at[0], at[1]);
	}
	cairo_close_path(c);
	cairo_set_source_rgb(c, 0.955, 0.955, 0.96);
	cairo_fill_preserve(c);
	cairo_set_line_width(c, s->line);
	quern_render_set(c, quern_render_ink, 0.30);
	cairo_stroke(c);
	for (int k = 0; k < 2; k++)
		for (double x = ceil(v->low[k] / step) * step; x < v->high[k]; x += step) {
			const double from[3] = { k ? v->low[0] : x, k ? x : v->low[1], level };
			const double to[3] = { k ? v->high[0] : x, k ? x : v->high[1], level };
			line_between(c, s, from, to);
		}
	cairo_set_line_width(c, 0.8 * s->line);
	quern_render_set(c, quern_render_ink, 0.14);
	cairo_stroke(c);
}

static void set_depths(raster *r, const render_style *s) {
	r->near = INFINITY;
	r->far = -INFINITY;
	for (int corner = 0; corner < 8; corner++) {
		double x[3], at[3];
		for (int k = 0; k < 3; k++) x[k] = corner >> k & 1 ? s->view->high[k] : s->view->low[k];
		quern_render_project(s->view, x, at);
		r->near = fmin(r->near, at[2]);
		r->far = fmax(r->far, at[2]);
	}
}

static double typical_size(const render_cloud *cloud) {
	double sum = 0;
	for (size_t i = 0; i < cloud->n; i++) sum += cloud->size[i];
	return cloud->n ? sum / (double)cloud->n : 0;
}

void quern_render_space(cairo_t *c, const render_style *s) {
	raster r = { .width = FINE * (int)ceil(s->view->width),
		.height = FINE * (int)ceil(s->view->height),
		.scale = FINE * s->view->scale,
		.view = s->view };
	const size_t n = (size_t)r.width * (size_t)r.height;
	const double size = fmax(typical_size(&s->frame->grains), 0.5 * typical_size(&s->frame->points));
	r.depth = quern_take(n, sizeof(float));
	r.colour = quern_take(n, sizeof(render_colour));
	for (size_t i = 0; i < n; i++) r.depth[i] = INFINITY;
	set_depths(&r, s);
	draw_ground(c, s);
	if (s->frame->cells.value) put_cloud(&r, s, &s->frame->cells);
	else {
		put_cloud(&r, s, &s->frame->points);
		put_cloud(&r, s, &s->frame->grains);
	}
	cairo_surface_t *image = smooth(&r, fmax(0.8 * size * r.scale, 2));
	cairo_set_source_surface(c, image, 0, 0);
	cairo_paint(c);
	cairo_save(c);
	cairo_rectangle(c, 0, 0, s->view->width, s->view->height);
	cairo_clip(c);
	quern_render_chains(c, s);
	quern_render_arrows(c, s);
	cairo_restore(c);
	cairo_surface_destroy(image);
	free(r.depth);
	free(r.colour);
}
