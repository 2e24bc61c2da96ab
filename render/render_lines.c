/* SPDX-License-Identifier: MIT */
/* Chains and arrows lie over the picture, in space too: what a grain in front hides of a chain is what one looks for. */
#include "render.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double usual = 0.995;  /* of the values are at most what the widest and the longest stand for */
static const double thickest = 1.5; /* of the widest: a force may be anything */

/* ---- chains ---- */

double quern_render_widest(const render_frame *f) {
	double *force = quern_take(f->n_links + 1, sizeof(double));
	size_t n = 0;
	for (size_t i = 0; i < f->n_links; i++)
		if (f->link[i].force > 1 / RENDER_MOST_VALUE) force[n++] = f->link[i].force;
	const double widest = quern_render_quantile(force, n, usual);
	free(force);
	return widest;
}

/* A grain's size where that can be seen and does not hide all: the same in all pictures of one view. */
double quern_render_line_width(const render_style *s) {
	double sum = 0;
	for (size_t i = 0; i < s->frame->grains.n; i++) sum += s->frame->grains.size[i];
	const double mean = s->frame->grains.n ? sum / (double)s->frame->grains.n : 0;
	const double part =
		s->frame->dimension == 2 ? 1.2 : 0.7; /* in space there are more of them, one over the other */
	return fmin(fmax(part * mean * s->view->scale, 3 * s->line), 16 * s->line);
}

/* Far away, Cairo's numbers of pixels begin again from the other side. */
static bool is_near(const render_view *v, const double at[3]) {
	const double far = 1e5;
	return at[0] > -far && at[1] > -far && at[0] < v->width + far && at[1] < v->height + far;
}

static void draw_link(cairo_t *c, const render_style *s, const render_link *l, double width) {
	double from[3], to[3];
	quern_render_project(s->view, l->from, from);
	quern_render_project(s->view, l->to, to);
	if (!is_near(s->view, from) || !is_near(s->view, to)) return;
	cairo_set_line_width(c, width);
	cairo_move_to(c, from[0], from[1]);
	cairo_line_to(c, to[0], to[1]);
	cairo_stroke(c);
}

/* Those that are too thin to be seen, and those that pull, are left out. */
void quern_render_chains(cairo_t *c, const render_style *s) {
	const double widest = quern_render_line_width(s);
	quern_render_set(c, quern_render_ink, 1);
	cairo_set_line_cap(c, CAIRO_LINE_CAP_ROUND);
	for (size_t i = 0; i < s->frame->n_links; i++) {
		const double share = s->frame->link[i].force / s->widest;
		if (share * widest > 0.03 * s->line)
			draw_link(c, s, &s->frame->link[i], widest * fmin(share, thickest));
	}
	cairo_set_line_cap(c, CAIRO_LINE_CAP_BUTT);
}

/* ---- arrows ---- */

static double length_of(const double x[3]) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

double quern_render_longest(const render_frame *f) {
	const render_cloud *clouds[3] = { &f->grains, &f->points, &f->cells };
	double *length = quern_take(f->grains.n + f->points.n + f->cells.n + 1, sizeof(double));
	size_t n = 0;
	for (int k = 0; k < 3; k++)
		for (size_t i = 0; clouds[k]->vector && i < clouds[k]->n; i++) {
			const double size = length_of(clouds[k]->vector[i]);
			if (size > 1 / RENDER_MOST_VALUE && size <= RENDER_MOST_VALUE) length[n++] = size;
		}
	const double longest = quern_render_quantile(length, n, usual);
	free(length);
	return longest;
}

double quern_render_arrow_length(const render_style *s) { return 52 * s->line; }

/* Paper around the ink, so that it is seen on all colours. */
void quern_render_arrow(cairo_t *c, double x, double y, double dx, double dy, double line) {
	const double length = hypot(dx, dy), head = fmin(11 * line, 0.5 * length), half = 0.45 * head;
	if (!(length > 0)) return;
	const double u = dx / length, v = dy / length, thick = fmin(2.6 * line, 0.2 * length);
	cairo_new_path(c);
	cairo_move_to(c, x, y);
	cairo_line_to(c, x + dx - 0.8 * head * u, y + dy - 0.8 * head * v);
	for (int k = 0; k < 2; k++) {
		if (k) quern_render_set(c, quern_render_ink, 1);
		else cairo_set_source_rgba(c, 1, 1, 1, 0.75);
		cairo_set_line_width(c, k ? thick : 2.2 * thick);
		if (k) cairo_stroke(c);
		else cairo_stroke_preserve(c);
	}
	cairo_move_to(c, x + dx, y + dy);
	cairo_line_to(c, x + dx - head * u - half * v, y + dy - head * v + half * u);
	cairo_line_to(c, x + dx - head * u + half * v, y + dy - head * v - half * u);
	cairo_close_path(c);
	cairo_set_source_rgba(c, 1, 1, 1, 0.75);
	cairo_set_line_width(c, 1.2 * line);
	cairo_stroke_preserve(c);
	quern_render_set(c, quern_render_ink, 1);
	cairo_fill(c);
}

/* One arrow for each square of the picture. */
typedef struct {
	double at[2], vector[2], depth, n;
} square;

/* In the plane the mean of what lies in the square; in space what stands in front, as it hides the rest. */
static void put(square *q, const render_style *s, const double at[3], const double x[3]) {
	double on[2] = { 0 };
	for (int k = 0; k < 3; k++) on[0] += s->view->right[k] * x[k], on[1] -= s->view->up[k] * x[k];
	if (s->frame->dimension == 3) {
		if (q->n > 0 && at[2] >= q->depth) return;
		*q = (square) { .depth = at[2] };
	}
	for (int k = 0; k < 2; k++) q->at[k] += at[k], q->vector[k] += on[k];
	q->n++;
}

static void gather(
	square *squares, long across, long down, double edge, const render_style *s, const render_cloud *cloud) {
	for (size_t i = 0; cloud->vector && i < cloud->n; i++) {
		double at[3];
		quern_render_project(s->view, cloud->position[i], at);
		const bool still = cloud == &s->frame->grains && cloud->sort[i] == RENDER_FIXED;
		const bool inside = at[0] >= 0 && at[1] >= 0 && at[0] < s->view->width && at[1] < s->view->height;
		if (still || !inside || !(length_of(cloud->vector[i]) <= RENDER_MOST_VALUE)) continue;
		const long x = (long)(at[0] / edge), y = (long)(at[1] / edge);
		if (x < across && y < down) put(&squares[y * across + x], s, at, cloud->vector[i]);
	}
}

void quern_render_arrows(cairo_t *c, const render_style *s) {
	const double edge = 40 * s->line, scale = quern_render_arrow_length(s) / s->longest;
	const long across = (long)ceil(s->view->width / edge) + 1, down = (long)ceil(s->view->height / edge) + 1;
	const double longest = 3 * quern_render_arrow_length(s); /* a vector may be anything */
	square *squares = quern_take((size_t)(across * down), sizeof *squares);
	gather(squares, across, down, edge, s, &s->frame->points);
	gather(squares, across, down, edge, s, &s->frame->grains);
	gather(squares, across, down, edge, s, &s->frame->cells);
	for (long k = 0; k < across * down; k++) {
		const square *q = &squares[k];
		if (!(q->n > 0)) continue;
		const double dx = scale * q->vector[0] / q->n, dy = scale * q->vector[1] / q->n, size = hypot(dx, dy);
		const double cut = size > longest ? longest / size : 1;
		if (size > 2 * s->line && isfinite(size))
			quern_render_arrow(c, q->at[0] / q->n, q->at[1] / q->n, cut * dx, cut * dy, s->line);
	}
	free(squares);
}
