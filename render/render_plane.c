/* SPDX-License-Identifier: MIT */
#include "episodes.h"
#include "param.h"
#include "render.h"
#include <math.h>
#include <quern/body.h>
#include <stdlib.h>
#include <string.h>

void quern_render_set(cairo_t *c, render_colour colour, double alpha) {
	cairo_set_source_rgba(c, colour.r, colour.g, colour.b, alpha);
}

render_colour quern_render_colour_of(const render_style *s, const render_cloud *cloud, size_t i) {
	const bool grains = cloud == &s->frame->grains;
	if (grains && cloud->sort[i] == RENDER_FIXED) return quern_render_grey;
	if (cloud->value && isfinite(cloud->value[i]))
		return quern_render_map(quern_render_share(s->range, cloud->value[i]));
	if (*s->frame->field) return (render_colour) { 0.86, 0.86, 0.88 }; /* something else has the colours */
	return grains ? quern_render_sand : quern_render_sky;
}

bool quern_render_has(const render_cloud *cloud, int sort) {
	for (size_t i = 0; i < cloud->n; i++)
		if ((cloud->sort ? cloud->sort[i] : 0) == sort) return true;
	return false;
}

/* ---- grains and points ---- */

/* A grain that shares its mass with the continuum has a white face. */
void quern_render_disc(
	cairo_t *c, double x, double y, double radius, render_colour colour, int sort, double line) {
	cairo_new_path(c);
	cairo_arc(c, x, y, radius, 0, 2 * M_PI);
	quern_render_set(c, colour, 1);
	cairo_fill_preserve(c);
	if (radius > 2.5 * line) {
		quern_render_set(c, quern_render_mix(colour, quern_render_ink, 0.6), 0.8);
		cairo_set_line_width(c, fmin(line, 0.16 * radius));
		cairo_stroke(c);
	}
	cairo_new_path(c);
	if (sort != RENDER_SHARED) return;
	cairo_arc(c, x, y, 0.5 * radius, 0, 2 * M_PI);
	cairo_set_source_rgb(c, 0.97, 0.97, 0.97);
	cairo_fill(c);
}

/* What lies beyond is left out: far away, Cairo's numbers of pixels begin again from the other side. */
static const double beside = 1000; /* pixels */

static double in_pixels(double size, const render_view *v) { return fmin(size * v->scale, 1e6); }

static bool is_inside(const render_view *v, const double at[3], double reach) {
	return at[0] > -reach && at[1] > -reach && at[0] < v->width + reach && at[1] < v->height + reach;
}

static void draw_grains(cairo_t *c, const render_style *s) {
	const render_cloud *cloud = &s->frame->grains;
	for (size_t i = 0; i < cloud->n; i++) {
		double at[3];
		quern_render_project(s->view, cloud->position[i], at);
		const double radius = fmax(in_pixels(cloud->size[i], s->view), 0.7);
		if (!is_inside(s->view, at, radius + s->line)) continue;
		quern_render_disc(
			c, at[0], at[1], radius, quern_render_colour_of(s, cloud, i), cloud->sort[i], s->line);
	}
}

static void draw_squares(cairo_t *c, const render_style *s, const render_cloud *cloud, double share) {
	for (size_t i = 0; i < cloud->n; i++) {
		double at[3];
		if (cloud == &s->frame->cells && cloud->value[i] == 0) continue;
		quern_render_project(s->view, cloud->position[i], at);
		const double edge = fmax(share * in_pixels(cloud->size[i], s->view), 1.2);
		if (!is_inside(s->view, at, edge)) continue;
		quern_render_set(c, quern_render_colour_of(s, cloud, i), 1);
		cairo_rectangle(c, at[0] - 0.5 * edge, at[1] - 0.5 * edge, edge, edge);
		cairo_fill(c);
	}
}

/* Where cells have the colours, grains and points are only hinted at. */
static void draw_outlines(cairo_t *c, const render_style *s) {
	const render_cloud *clouds[2] = { &s->frame->grains, &s->frame->points };
	quern_render_set(c, quern_render_ink, 0.35);
	cairo_set_line_width(c, 0.7 * s->line);
	for (int k = 0; k < 2; k++)
		for (size_t i = 0; i < clouds[k]->n; i++) {
			double at[3];
			quern_render_project(s->view, clouds[k]->position[i], at);
			const double radius = k == 0 ? in_pixels(clouds[k]->size[i], s->view) : 0.7 * s->line;
			if (!is_inside(s->view, at, radius + s->line)) continue;
			cairo_new_sub_path(c);
			cairo_arc(c, at[0], at[1], radius, 0, 2 * M_PI);
			cairo_stroke(c);
		}
}

/* ---- zones ---- */

/* Zones of the cells in the picture as a raster with an empty rim; NULL if there are none. */
static uint8_t *zone_raster(const render_style *s, long size[2], double corner[2]) {
	const render_cloud *cells = &s->frame->cells;
	double low[2] = { INFINITY, INFINITY }, high[2] = { -INFINITY, -INFINITY };
	if (!cells->sort || !cells->n || !(s->frame->cell > 0)) return NULL;
	for (size_t i = 0; i < cells->n; i++)
		for (int k = 0; k < 2; k++) {
			low[k] = fmin(low[k], cells->position[i][k]);
			high[k] = fmax(high[k], cells->position[i][k]);
		}
	for (int k = 0; k < 2; k++) {
		const double cell = s->frame->cell;
		if (!((high[k] - low[k]) / cell < 20000)) return NULL;
		size[k] = lround((high[k] - low[k]) / cell) + 3;
		corner[k] = low[k] - 1.5 * cell;
	}
	uint8_t *zone = quern_take((size_t)size[0] * (size_t)size[1], 1);
	for (size_t i = 0; i < cells->n; i++) {
		const long x = lround((cells->position[i][0] - corner[0]) / s->frame->cell - 0.5);
		const long y = lround((cells->position[i][1] - corner[1]) / s->frame->cell - 0.5);
		zone[y * size[0] + x] = cells->sort[i];
	}
	return zone;
}

static void zone_corner(const render_style *s, const double corner[2], long x, long y, double out[3]) {
	const double at[3] = { corner[0] + (double)x * s->frame->cell, corner[1] + (double)y * s->frame->cell,
		0 };
	quern_render_project(s->view, at, out);
	out[0] = fmin(fmax(out[0], -beside), s->view->width + beside);
	out[1] = fmin(fmax(out[1], -beside), s->view->height + beside);
}

static void draw_tints(cairo_t *c, const render_style *s) {
	long size[2];
	double corner[2], low[3], high[3];
	uint8_t *zone = zone_raster(s, size, corner);
	cairo_set_antialias(c, CAIRO_ANTIALIAS_NONE); /* no seams between cells */
	for (long y = 0; zone && y < size[1]; y++)
		for (long x = 0; x < size[0]; x++) {
			const int is = zone[y * size[0] + x];
			if (!is) continue;
			zone_corner(s, corner, x, y, low);
			zone_corner(s, corner, x + 1, y + 1, high);
			quern_render_set(c, is == 1 ? quern_render_rose : quern_render_sky, is == 1 ? 0.16 : 0.22);
			cairo_rectangle(c, low[0], high[1], high[0] - low[0], low[1] - high[1]);
			cairo_fill(c);
		}
	cairo_set_antialias(c, CAIRO_ANTIALIAS_DEFAULT);
	free(zone);
}

/* Lines between zones: rose around what is hybrid. */
static void draw_borders(cairo_t *c, const render_style *s) {
	long size[2];
	double corner[2], from[3], to[3];
	uint8_t *zone = zone_raster(s, size, corner);
	for (long y = 1; zone && y < size[1]; y++)
		for (long x = 1; x < size[0]; x++)
			for (int k = 0; k < 2; k++) {
				const int is = zone[y * size[0] + x], was = zone[(k ? y - 1 : y) * size[0] + (k ? x : x - 1)];
				if (is == was) continue;
				zone_corner(s, corner, x, y, from);
				zone_corner(s, corner, k ? x + 1 : x, k ? y : y + 1, to);
				cairo_move_to(c, from[0], from[1]);
				cairo_line_to(c, to[0], to[1]);
			}
	cairo_set_line_cap(c, CAIRO_LINE_CAP_SQUARE);
	cairo_set_line_width(c, 3.6 * s->line);
	cairo_set_source_rgba(c, 1, 1, 1, 0.6);
	cairo_stroke_preserve(c);
	cairo_set_line_width(c, 1.6 * s->line);
	quern_render_set(c, quern_render_rose, 0.95);
	cairo_stroke(c);
	cairo_set_line_cap(c, CAIRO_LINE_CAP_BUTT);
	free(zone);
}

/* ---- images on paper ---- */

/* Twice as fine as on the page. */
void quern_render_as_image(cairo_t *c, const render_style *s, void (*draw)(cairo_t *, const render_style *)) {
	enum { FINER = 2 };
	render_view view = *s->view;
	render_style style = *s;
	view.scale *= FINER, view.width *= FINER, view.height *= FINER, style.line *= FINER;
	style.view = &view;
	cairo_surface_t *image =
		cairo_image_surface_create(CAIRO_FORMAT_ARGB32, (int)ceil(view.width), (int)ceil(view.height));
	cairo_t *on = cairo_create(image);
	draw(on, &style);
	cairo_destroy(on);
	cairo_save(c);
	cairo_scale(c, 1.0 / FINER, 1.0 / FINER);
	cairo_set_source_surface(c, image, 0, 0);
	cairo_paint(c);
	cairo_restore(c);
	cairo_surface_destroy(image);
}

/* ---- bodies, by their own geometry, whatever plugin they are of ---- */

enum { RUN = 256 };

/* The gaps of the pixels of one line, from pixel `begin` on. */
static void gaps(const render_style *s, const quern_filling *body, const quern_pose *pose, int y, int begin,
	double gap[RUN]) {
	_Alignas(64) quern_real x[3][RUN], radius[RUN], normal[3][RUN], velocity[3][RUN];
	for (int i = 0; i < RUN; i++) {
		x[0][i] = s->view->left + (begin + i + 0.5) / s->view->scale;
		x[1][i] = s->view->top - (y + 0.5) / s->view->scale;
		x[2][i] = radius[i] = 0;
	}
	const quern_body_batch batch = { .n = RUN,
		.cap = RUN,
		.dim = 2,
		.pose = pose,
		.position = { x[0], x[1], x[2] },
		.radius = radius,
		.gap = gap,
		.normal = { normal[0], normal[1], normal[2] },
		.velocity = { velocity[0], velocity[1], velocity[2] } };
	((const quern_body_ops *)body->instance->ops)->closest(body->instance->self, &batch);
}

/* A body that is there only while grains settle is gone in every frame; one that is never there too. */
static bool is_there(const quern_section *bodies, const quern_filling *body) {
	const quern_param *row = bodies->slots[0].slot->rows;
	row = row ? quern_param_find(row, "while") : NULL;
	const double when = row && body->item ? quern_param_number(row, body->item) : 0;
	return when != 1 && when != 3;
}

/* With the values of the scene's stage that led to the frame. */
const quern_section *quern_render_bodies(const render_frame *f) {
	const quern_scene *scene = f->scene;
	if (!scene) return NULL;
	int64_t k = quern_episode_at(scene, f->time);
	if (k > 0 && scene->episodes[k].begin == f->time) k--;
	if (k >= 0 && scene->episodes[k].scene) scene = scene->episodes[k].scene;
	return quern_scene_section(scene, "bodies");
}

/* The distance to one body, in pixels, of every pixel; returns the least. */
static float distances_to(const render_style *s, const quern_filling *body, const quern_pose *pose, int width,
	int height, float *distance) {
	float least = INFINITY;
	for (int y = 0; y < height; y++)
		for (int begin = 0; begin < width; begin += RUN) {
			_Alignas(64) double gap[RUN];
			gaps(s, body, pose, y, begin, gap);
			for (int i = 0; i < RUN && begin + i < width; i++) {
				float *at = &distance[(size_t)y * (size_t)width + (size_t)(begin + i)];
				*at = (float)(gap[i] * s->view->scale);
				least = fminf(least, *at);
			}
		}
	return least;
}

/* What is there but thinner than a line is drawn as one: bounded, since of other bodies only the rim may be in sight. */
static float thickening(const render_style *s, const quern_filling *body, float least) {
	quern_real lower[3] = { 0 }, upper[3] = { 0 };
	const float half = 0.75f * (float)s->line;
	((const quern_body_ops *)body->instance->ops)->bounds(body->instance->self, 2, lower, upper);
	for (int k = 0; k < 2; k++)
		if (!isfinite(lower[k]) || !isfinite(upper[k])) return 0;
	return least > -half && least < 1 ? half : 0;
}

/* The distance to the nearest body, in pixels, of every pixel. */
static float *distances(const render_style *s, int width, int height) {
	const quern_section *bodies = quern_render_bodies(s->frame);
	const size_t n = (size_t)width * (size_t)height;
	if (!bodies || !bodies->n_slots) return NULL;
	float *nearest = quern_take(n, sizeof(float)), *one = quern_take(n, sizeof(float));
	for (size_t i = 0; i < n; i++) nearest[i] = INFINITY;
	static const quern_pose still = { .turn = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } };
	const bool posed = s->frame->n_poses == bodies->slots[0].n;
	for (size_t b = 0; b < bodies->slots[0].n; b++) {
		const quern_filling *body = &bodies->slots[0].filling[b];
		if (!is_there(bodies, body)) continue;
		const float more = thickening(
			s, body, distances_to(s, body, posed ? &s->frame->pose[b] : &still, width, height, one));
		for (size_t i = 0; i < n; i++) nearest[i] = fminf(nearest[i], one[i] - more);
	}
	free(one);
	return nearest;
}

void quern_render_hatch(cairo_t *c, double line) {
	double x0, y0, x1, y1;
	cairo_clip_extents(c, &x0, &y0, &x1, &y1);
	cairo_set_source_rgb(c, 0.93, 0.93, 0.93);
	cairo_paint(c);
	for (double x = floor(x0 - (y1 - y0)); x < x1; x += 7 * line) {
		cairo_move_to(c, x, y1);
		cairo_line_to(c, x + (y1 - y0), y0);
	}
	quern_render_set(c, quern_render_ink, 0.35);
	cairo_set_line_width(c, 0.8 * line);
	cairo_stroke(c);
}

static cairo_surface_t *mask_of(const float *gap, int width, int height, double inner, double outer) {
	cairo_surface_t *mask = cairo_image_surface_create(CAIRO_FORMAT_A8, width, height);
	unsigned char *data = cairo_image_surface_get_data(mask);
	const int stride = cairo_image_surface_get_stride(mask);
	for (int y = 0; y < height; y++)
		for (int x = 0; x < width; x++) {
			const double d = gap[y * width + x];
			const double in = fmin(fmax(outer + 0.5 - d, 0), 1), out = fmin(fmax(inner + 0.5 - d, 0), 1);
			data[y * stride + x] = (unsigned char)lround(255 * fmax(in - out, 0));
		}
	cairo_surface_mark_dirty(mask);
	return mask;
}

static void fill_bodies(cairo_t *c, const render_style *s) {
	const int width = (int)ceil(s->view->width), height = (int)ceil(s->view->height);
	float *gap = distances(s, width, height);
	if (!gap) return;
	cairo_surface_t *solid = mask_of(gap, width, height, -1e9, 0);
	cairo_surface_t *rim = mask_of(gap, width, height, -1.5 * s->line, 0);
	cairo_push_group(c);
	quern_render_hatch(c, s->line);
	cairo_pop_group_to_source(c);
	cairo_mask_surface(c, solid, 0, 0);
	quern_render_set(c, quern_render_ink, 0.9);
	cairo_mask_surface(c, rim, 0, 0);
	cairo_surface_destroy(solid);
	cairo_surface_destroy(rim);
	free(gap);
}

/* Masks are of pixels: on paper too. */
static void draw_bodies(cairo_t *c, const render_style *s) {
	if (cairo_surface_get_type(cairo_get_target(c)) == CAIRO_SURFACE_TYPE_IMAGE) fill_bodies(c, s);
	else quern_render_as_image(c, s, fill_bodies);
}

/* ---- the plane ---- */

static void draw_domain(cairo_t *c, const render_style *s) {
	double low[3], high[3];
	if (!s->frame->scene) return;
	quern_render_project(s->view, s->frame->scene->general.lower, low);
	quern_render_project(s->view, s->frame->scene->general.upper, high);
	const double left = fmax(low[0], -9 * s->line), right = fmin(high[0], s->view->width + 9 * s->line);
	const double top = fmax(high[1], -9 * s->line), bottom = fmin(low[1], s->view->height + 9 * s->line);
	cairo_rectangle(c, left, top, right - left, bottom - top);
	quern_render_set(c, quern_render_ink, 0.5);
	cairo_set_line_width(c, s->line);
	cairo_stroke(c);
}

void quern_render_plane(cairo_t *c, const render_style *s) {
	cairo_save(c);
	cairo_rectangle(c, 0, 0, s->view->width, s->view->height);
	cairo_clip(c);
	draw_tints(c, s);
	draw_domain(c, s);
	draw_bodies(c, s);
	if (s->frame->cells.value) {
		draw_squares(c, s, &s->frame->cells, 1);
		draw_outlines(c, s);
	} else {
		draw_squares(c, s, &s->frame->points, 0.8);
		draw_grains(c, s);
	}
	draw_borders(c, s);
	quern_render_chains(c, s);
	quern_render_arrows(c, s);
	cairo_restore(c);
}
