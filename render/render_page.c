/* SPDX-License-Identifier: MIT */
#include "render.h"
#include <cairo-pdf.h>
#include <cairo-svg.h>
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
	char chain[96], arrow[160];       /* what a line and an arrow of the legend stand for */
	double chain_width, arrow_length; /* pixels */
	double unit, width, margin;       /* pixels */
} page;

typedef struct {
	const char *text;
	int sign;
} legend_entry;

enum {
	SIGN_GRAIN,
	SIGN_SHARED,
	SIGN_FIXED,
	SIGN_POINT,
	SIGN_HYBRID,
	SIGN_CONTINUUM,
	SIGN_BODY,
	SIGN_CHAIN,
	SIGN_ARROW,
	SIGNS
};

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

static size_t list_signs(const page *p, legend_entry out[SIGNS]) {
	const render_frame *f = p->frame;
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
		{ bodies, { "wall or body", SIGN_BODY } }, { *p->chain != 0, { p->chain, SIGN_CHAIN } },
		{ *p->arrow != 0, { p->arrow, SIGN_ARROW } } };
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
	if (sign == SIGN_CHAIN) {
		cairo_move_to(p->c, x - 12 * line, y);
		cairo_line_to(p->c, x + 12 * line, y);
		quern_render_set(p->c, quern_render_ink, 1);
		cairo_set_line_width(p->c, p->chain_width);
		cairo_stroke(p->c);
		return;
	}
	if (sign == SIGN_ARROW) {
		quern_render_arrow(p->c, x - 12 * line, y, p->arrow_length, 0, line);
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
	const size_t n = list_signs(p, entry), rows = (n + 1) / 2;
	for (size_t k = 0; k < n && !measure; k++) {
		const double left = x + (k / rows ? 250 : 0) * p->unit,
					 level = y + (18 + 34 * (double)(k % rows)) * p->unit;
		draw_sign(p, left + 12 * p->unit, level, entry[k].sign);
		const double room =
			entry[k].sign == SIGN_ARROW ? fmax(36 * p->unit, p->arrow_length + 12 * p->unit) : 36 * p->unit;
		write_text(p, left + room, level + 7 * p->unit, 20, false, LEFT, entry[k].text);
	}
	return (double)(34 * rows) * p->unit;
}

/* Round values, as large as they may be, so that their signs fit in. */
static void set_scales(page *p, const render_style *s) {
	char value[64];
	if (s->frame->n_links && s->widest > 0) {
		const double force = quern_render_round_step(s->widest);
		quern_render_quantity(value, sizeof value, force, "N");
		snprintf(p->chain, sizeof p->chain, "presses with %s", value);
		p->chain_width = quern_render_line_width(s) * force / s->widest;
	}
	if (*s->frame->vector_field && s->longest > 0) {
		const double size = quern_render_round_step(s->longest);
		quern_render_quantity(value, sizeof value, size, s->frame->vector_unit);
		const char *dot = strrchr(s->frame->vector_field, '.');
		snprintf(p->arrow, sizeof p->arrow, "%.12s %s", dot ? dot + 1 : s->frame->vector_field, value);
		p->arrow_length = quern_render_arrow_length(s) * size / s->longest;
	}
}

/* ---- the page ---- */

static void draw_picture(cairo_t *c, const render_style *s) {
	if (s->frame->dimension == 2) quern_render_plane(c, s);
	else quern_render_space(c, s);
}

/* Spheres are an image on paper too, and so are very many discs, which would be a file that nothing opens. */
static bool is_image(const render_frame *f, render_form form) {
	const size_t most = 10000; /* of what may be drawn one by one */
	return form != RENDER_PNG && (f->dimension == 3 || f->grains.n + f->points.n + f->cells.n > most);
}

/* An empty page; `scale`: from pixels to the form's own unit. A date would make the same picture another file. */
static cairo_surface_t *open_page(
	double width, double height, double scale, render_form form, cairo_write_func_t write, void *to) {
	if (form == RENDER_PNG) return cairo_image_surface_create(CAIRO_FORMAT_RGB24, (int)width, (int)height);
	cairo_surface_t *surface =
		form == RENDER_PDF ? cairo_pdf_surface_create_for_stream(write, to, scale * width, scale * height)
						   : cairo_svg_surface_create_for_stream(write, to, width, height);
	if (form == RENDER_SVG) cairo_svg_surface_set_document_unit(surface, CAIRO_SVG_UNIT_PX);
	else cairo_pdf_surface_set_metadata(surface, CAIRO_PDF_METADATA_CREATE_DATE, "");
	return surface;
}

/* Of a page that is one of many all rows are kept, so that every one is as high. */
static double foot_of(const page *p, bool fixed) {
	return fmax(fixed ? 34 * (SIGNS + 1) / 2 * p->unit : draw_legend(p, 0, 0, true), 100 * p->unit) +
		   24 * p->unit;
}

static void draw_page(page *p, const render_style *style, double head, render_form form) {
	const double unit = p->unit, width = p->width;
	cairo_set_source_rgb(p->c, 1, 1, 1);
	cairo_paint(p->c);
	draw_heading(p, 50 * unit);
	cairo_save(p->c);
	cairo_translate(p->c, floor(0.5 * (width - p->view->width)), floor(head));
	if (is_image(p->frame, form)) quern_render_as_image(p->c, style, draw_picture);
	else draw_picture(p->c, style);
	cairo_restore(p->c);
	const double top = head + p->view->height + 28 * unit, room = width - 2 * p->margin;
	if (*p->frame->field) draw_bar(p, p->margin + 16 * unit, top, 0.36 * room);
	draw_scale(p, p->margin + (*p->frame->field ? 0.46 * room : 0), top);
	draw_legend(p, width - p->margin - 480 * unit, top, false);
}

cairo_surface_t *quern_render_page(const render_frame *f, const render_wish *wish, int width,
	render_form form, cairo_write_func_t write, void *to) {
	const double unit = fmax(width / 1600.0, 0.5), margin = 40 * unit, head = 84 * unit;
	const double scale = form == RENDER_PDF ? 0.45 : 1; /* 1600 pixels are as wide as a sheet on its side */
	const render_range range = quern_render_range_of(f, wish);
	render_view view = quern_render_view_of(f, wish);
	const render_style style = { .frame = f,
		.view = &view,
		.range = &range,
		.line = unit,
		.widest = wish->widest > 0 ? wish->widest : quern_render_widest(f),
		.longest = wish->longest > 0 ? wish->longest : quern_render_longest(f) };
	page p = { .frame = f, .range = &range, .view = &view, .unit = unit, .width = width, .margin = margin };
	quern_render_view_fit(&view, f, width - 2 * margin, 0.8 * width);
	set_scales(&p, &style);
	const double height = ceil(head + view.height + 28 * unit + foot_of(&p, view.fixed));
	cairo_surface_t *surface = open_page(width, height, scale, form, write, to);
	p.c = cairo_create(surface);
	cairo_scale(p.c, scale, scale);
	draw_page(&p, &style, head, form);
	cairo_destroy(p.c);
	return surface;
}
