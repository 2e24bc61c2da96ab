/* SPDX-License-Identifier: MIT */
#include "render.h"
#include <math.h>
#include <quern/oracle.h>
#include <stdio.h>
#include <string.h>

/* Lengths on the page are in units of a sixteen-hundredth of its width, and never so small that one cannot read. */
typedef struct {
	cairo_t *c;
	const render_frame *frame;
	const render_range *range;
	render_view *view;
	double unit, width, margin; /* pixels */
} page;

typedef struct {
	const char *text;
	int sign;
} legend_entry;

enum { SIGN_GRAIN, SIGN_SHARED, SIGN_FIXED, SIGN_POINT, SIGN_HYBRID, SIGN_CONTINUUM, SIGN_BODY, SIGNS };

enum { LEFT, MIDDLE, RIGHT };

static double text_width(const page *p, double size, bool bold, const char *text) {
	cairo_text_extents_t extents;
	cairo_select_font_face(p->c, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
		bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
	cairo_set_font_size(p->c, size * p->unit);
	cairo_text_extents(p->c, text, &extents);
	return extents.x_advance;
}

static void write_text(
	const page *p, double x, double y, double size, bool bold, int align, const char *text) {
	const double width = text_width(p, size, bold, text);
	quern_render_set(p->c, quern_render_ink, 1);
	cairo_move_to(p->c, x - (align == LEFT ? 0 : align == MIDDLE ? 0.5 * width : width), y);
	cairo_show_text(p->c, text);
	cairo_new_path(p->c);
}

/* ---- heading ---- */

static void say_time(double time, char out[48]) {
	const double size = fabs(time);
	if (size >= 1 || size == 0) snprintf(out, 48, "t = %.4g s", time);
	else if (size >= 1e-3) snprintf(out, 48, "t = %.4g ms", 1e3 * time);
	else snprintf(out, 48, "t = %.4g µs", 1e6 * time);
}

static void draw_heading(const page *p, double y) {
	char time[48], name[132];
	say_time(p->frame->time, time);
	write_text(p, p->width - p->margin, y, 26, false, RIGHT, time);
	const double room = p->width - 2 * p->margin - text_width(p, 26, false, time) - 40 * p->unit;
	snprintf(name, sizeof name, "%s", p->frame->name);
	for (size_t n = strlen(name); n > 1 && text_width(p, 26, true, name) > room;) {
		while (n > 1 && (name[--n] & 0xc0) == 0x80) continue; /* whole characters */
		snprintf(name + n, sizeof name - n, "…");
	}
	write_text(p, p->margin, y, 26, true, LEFT, name);
}

/* ---- colour bar ---- */

static void draw_marks(const page *p, double x, double y, double width) {
	const render_range *r = p->range;
	const double factor = r->factor, step = r->step, first = ceil(r->low / step - 1e-6);
	quern_render_set(p->c, quern_render_ink, 1);
	for (double k = first; k * step <= r->high + 1e-6 * step; k++) {
		char text[32];
		const double at = x + width * (k * step - r->low) / (r->high - r->low);
		snprintf(text, sizeof text, "%.6g", k == 0 ? 0 : k * step * factor);
		cairo_move_to(p->c, at, y);
		cairo_line_to(p->c, at, y + 7 * p->unit);
		cairo_set_line_width(p->c, 1.4 * p->unit);
		cairo_stroke(p->c);
		write_text(p, at, y + 28 * p->unit, 19, false, MIDDLE, text);
	}
}

/* Values beyond an end are in the tip there. */
static void draw_tip(const page *p, double x, double y, double way, double height, double t) {
	cairo_move_to(p->c, x, y);
	cairo_line_to(p->c, x + way, y + 0.5 * height);
	cairo_line_to(p->c, x, y + height);
	cairo_close_path(p->c);
	quern_render_set(p->c, quern_render_map(t), 1);
	cairo_fill_preserve(p->c);
	quern_render_set(p->c, quern_render_ink, 0.8);
	cairo_set_line_width(p->c, 1.2 * p->unit);
	cairo_stroke(p->c);
}

static void draw_bar(const page *p, double x, double y, double width) {
	const double height = 22 * p->unit, top = y + 34 * p->unit;
	cairo_pattern_t *colours = cairo_pattern_create_linear(x, 0, x + width, 0);
	for (int k = 0; k <= 64; k++) {
		const render_colour c = quern_render_map(k / 64.0);
		cairo_pattern_add_color_stop_rgb(colours, k / 64.0, c.r, c.g, c.b);
	}
	write_text(p, x, y + 20 * p->unit, 20, false, LEFT, p->range->label);
	cairo_rectangle(p->c, x, top, width, height);
	cairo_set_source(p->c, colours);
	cairo_fill_preserve(p->c);
	quern_render_set(p->c, quern_render_ink, 0.8);
	cairo_set_line_width(p->c, 1.2 * p->unit);
	cairo_stroke(p->c);
	cairo_pattern_destroy(colours);
	if (p->range->above) draw_tip(p, x + width, top, 14 * p->unit, height, 1);
	if (p->range->below) draw_tip(p, x, top, -14 * p->unit, height, 0);
	draw_marks(p, x, top + height, width);
}

/* ---- scale ---- */

/* In 3-D the picture is orthographic: lengths across the line of sight are everywhere the same. */
static void draw_scale(const page *p, double x, double y) {
	const double length = quern_render_round_step(220 * p->unit / p->view->scale),
				 width = length * p->view->scale;
	const double level = y + 45 * p->unit, tick = 7 * p->unit;
	char text[32];
	if (length < 0.9995e-3) snprintf(text, sizeof text, "%.3g µm", 1e6 * length);
	else if (length < 0.9995) snprintf(text, sizeof text, "%.3g mm", 1e3 * length);
	else snprintf(text, sizeof text, "%.3g m", length);
	cairo_move_to(p->c, x, level - tick);
	cairo_line_to(p->c, x, level + tick);
	cairo_move_to(p->c, x, level);
	cairo_line_to(p->c, x + width, level);
	cairo_move_to(p->c, x + width, level - tick);
	cairo_line_to(p->c, x + width, level + tick);
	quern_render_set(p->c, quern_render_ink, 1);
	cairo_set_line_width(p->c, 2.6 * p->unit);
	cairo_stroke(p->c);
	write_text(p, x + 0.5 * width, y + 84 * p->unit, 20, false, MIDDLE, text);
}

/* ---- legend ---- */

static size_t list_signs(const render_frame *f, legend_entry out[SIGNS]) {
	const bool plane = f->dimension == 2, zones = plane && f->cells.sort;
	const bool cells = f->cells.value != NULL,
			   bodies = plane && f->scene && quern_scene_section(f->scene, "bodies");
	const struct {
		bool here;
		legend_entry entry;
	} all[] = { { !cells && quern_render_has(&f->grains, RENDER_WHOLE), { "grain", SIGN_GRAIN } },
		{ !cells && quern_render_has(&f->grains, RENDER_SHARED), { "hybrid grain", SIGN_SHARED } },
		{ !cells && quern_render_has(&f->grains, RENDER_FIXED), { "fixed grain", SIGN_FIXED } },
		{ !cells && f->points.n, { "continuum point", SIGN_POINT } },
		{ zones && quern_render_has(&f->cells, QUERN_HYBRID), { "hybrid zone", SIGN_HYBRID } },
		{ zones && quern_render_has(&f->cells, QUERN_CONTINUUM), { "continuum zone", SIGN_CONTINUUM } },
		{ bodies, { "wall or body", SIGN_BODY } } };
	size_t n = 0;
	for (size_t k = 0; k < SIGNS; k++)
		if (all[k].here) out[n++] = all[k].entry;
	return n;
}

static void draw_sign(const page *p, double x, double y, int sign) {
	const double r = 10 * p->unit, line = p->unit;
	const bool mapped = *p->frame->field != 0;
	const bool grains = p->frame->grains.value || !mapped, points = p->frame->points.value || !mapped;
	const render_colour pale = { 0.86, 0.86, 0.88 }, middle = quern_render_map(0.62);
	const render_colour grain = !grains ? pale : mapped ? middle : quern_render_sand;
	const render_colour point = !points ? pale : mapped ? middle : quern_render_sky;
	if (sign <= SIGN_FIXED) {
		const int sort = sign == SIGN_SHARED  ? RENDER_SHARED
						 : sign == SIGN_FIXED ? RENDER_FIXED
											  : RENDER_WHOLE;
		quern_render_disc(p->c, x, y, r, sign == SIGN_FIXED ? quern_render_grey : grain, sort, 1.4 * line);
		return;
	}
	const double half = sign == SIGN_POINT ? 0.6 * r : 1.1 * r;
	cairo_save(p->c);
	cairo_rectangle(p->c, x - half, y - half, 2 * half, 2 * half);
	if (sign == SIGN_POINT) quern_render_set(p->c, point, 1), cairo_fill(p->c);
	if (sign == SIGN_HYBRID || sign == SIGN_CONTINUUM) {
		quern_render_set(p->c, sign == SIGN_HYBRID ? quern_render_rose : quern_render_sky,
			sign == SIGN_HYBRID ? 0.16 : 0.22);
		cairo_fill_preserve(p->c);
		quern_render_set(p->c, quern_render_rose, 0.95);
		cairo_set_line_width(p->c, 1.6 * line);
		cairo_stroke(p->c);
	}
	if (sign == SIGN_BODY) {
		cairo_clip_preserve(p->c);
		cairo_new_path(p->c);
		quern_render_hatch(p->c, line);
	}
	cairo_restore(p->c);
}

/* Two columns; returns the height. */
static double draw_legend(const page *p, double x, double y, bool measure) {
	legend_entry entry[SIGNS];
	const size_t n = list_signs(p->frame, entry), rows = (n + 1) / 2;
	for (size_t k = 0; k < n && !measure; k++) {
		const double left = x + (k / rows ? 250 : 0) * p->unit,
					 level = y + (18 + 34 * (double)(k % rows)) * p->unit;
		draw_sign(p, left + 12 * p->unit, level, entry[k].sign);
		write_text(p, left + 36 * p->unit, level + 7 * p->unit, 20, false, LEFT, entry[k].text);
	}
	return (double)(34 * rows) * p->unit;
}

/* ---- the page ---- */

cairo_surface_t *quern_render_page(const render_frame *f, int width) {
	const double unit = fmax(width / 1600.0, 0.5), margin = 40 * unit, head = 84 * unit;
	const render_range range = quern_render_range_of(f);
	render_view view = quern_render_view_of(f);
	page p = { .frame = f, .range = &range, .view = &view, .unit = unit, .width = width, .margin = margin };
	quern_render_view_fit(&view, f, width - 2 * margin, 0.8 * width);
	const double foot = fmax(draw_legend(&p, 0, 0, true), 100 * unit) + 24 * unit;
	const int height = (int)ceil(head + view.height + 28 * unit + foot);
	cairo_surface_t *surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
	p.c = cairo_create(surface);
	cairo_set_source_rgb(p.c, 1, 1, 1);
	cairo_paint(p.c);
	draw_heading(&p, 50 * unit);
	const render_style style = { .frame = f, .view = &view, .range = &range, .line = unit };
	cairo_save(p.c);
	cairo_translate(p.c, floor(0.5 * (width - view.width)), floor(head));
	if (f->dimension == 2) quern_render_plane(p.c, &style);
	else quern_render_space(p.c, &style);
	cairo_restore(p.c);
	const double top = head + view.height + 28 * unit, room = width - 2 * margin;
	if (*f->field) draw_bar(&p, margin + 16 * unit, top, 0.36 * room);
	draw_scale(&p, margin + (*f->field ? 0.46 * room : 0), top);
	draw_legend(&p, width - margin - 480 * unit, top, false);
	cairo_destroy(p.c);
	return surface;
}
