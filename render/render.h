/* SPDX-License-Identifier: MIT */
/* render - a frame as a picture: what is read from it, how numbers become colours, and who paints what */
#pragma once
#include "command.h"
#include "scene.h"
#include "text.h"
#include <cairo.h>
#include <hdf5.h>
#include <quern/body.h>

extern const quern_command quern_command_render;

/* ---- render_frame.c: what a picture needs of a frame ---- */

enum { RENDER_WHOLE, RENDER_SHARED, RENDER_FIXED }; /* a grain; one in a hybrid zone; one that never moves */

/* What is wished of a picture, in SI units. */
typedef struct render_wish {
	const char *field, *vectors; /* as quern_render_frame_read takes them */
	bool chains, has_view, has_range;
	double low[3], high[3]; /* m, if has_view: the corners of what is shown */
	double range[2];        /* if has_range: what the first and the last colour stand for */
	double widest,
		longest; /* N of the widest line of a chain, and what the longest arrow stands for; 0: of the frame */
} render_wish;

/* Grains, points or cells. */
typedef struct render_cloud {
	size_t n;
	double (*position)[3]; /* m */
	double (*vector)[3];   /* what is drawn as arrows; NULL: nothing is */
	double *size;          /* m, radius of a grain, edge of a point or cell */
	double *value;         /* what colours it; NULL: nothing does */
	uint8_t *sort;         /* RENDER_*, or a cell's zone; NULL: all zero */
	bool unreadable;       /* there are positions or sizes, and they cannot be used */
} render_cloud;

/* Two grains, or a grain and a body, that press on each other. */
typedef struct render_link {
	double from[3], to[3]; /* m, from centre to centre, or to where the grain touches the body */
	double force;          /* N, along that line; positive: they press */
	double vector[3];      /* N, all of it, on what is at `from` */
	double radius;         /* m, of the grain at `from` */
	int64_t body;          /* -1: two grains */
} render_link;

typedef struct render_frame {
	int dimension;
	int64_t number;
	double time; /* s */
	char name[128];
	render_cloud grains, points, cells;
	quern_pose
		*pose; /* of bodies, where the frame says that they move; NULL: they stand where the scene put them */
	size_t n_poses;
	char field[64], unit[32]; /* of the values; "" if there are none */
	bool signs;               /* a component, not a magnitude */
	double cell;              /* m, edge of a cell */
	render_link *link;
	size_t n_links;
	char vector_field[64], vector_unit[32]; /* of the arrows; "" if there are none */
	quern_scene
		*scene; /* of scene.yaml in the run's folder, or NULL: then no domain and no bodies are drawn */
} render_frame;

/* Reads frame `number` (negative: the last one) of a run. `field` of the wish: "point.pressure", "grain.velocity.x", a
 * bare "velocity" of all that have it, or NULL for the speed where it is known and no chains are wished; `vectors`: the
 * same, without a component. On a fault returns an exit status and one sentence. */
int quern_render_frame_read(
	render_frame *, const char *folder, int64_t number, const render_wish *, quern_text *why);
/* The same of one file, without the run's scene. */
int quern_render_frame_read_file(
	render_frame *, const char *path, int64_t number, const render_wish *, quern_text *why);
void quern_render_frame_finish(render_frame *);
/* The number of the last frame that a run has; -1: none. */
int64_t quern_render_frame_last(const char *folder);
/* Any numbers of a dataset as doubles; free(). NULL if it is missing, of another length, not of numbers, or larger than
 * what memory there is: a damaged file may say that it holds anything. */
double *quern_render_table(hid_t group, const char *name, size_t rows, size_t *columns);

/* m, what no place and no size in a run can be: a domain ends within a tenth of it. */
#define RENDER_FAR 1e10

/* ---- render_links.c: forces between what touches ---- */

/* Of a frame's contacts and touches, for grains that are read already; false, with a sentence, if the frame has none or
 * they are damaged. */
bool quern_render_links_read(render_frame *, hid_t file, const char *path, quern_text *why);
/* Once the scene is there: to the places where grains touch bodies, and through periodic faces. */
void quern_render_links_mend(render_frame *);
/* The bodies of the scene as they are at the frame's time; NULL: none. */
const quern_section *quern_render_bodies(const render_frame *);

/* ---- render_colour.c: numbers to colours, and numbers to read ---- */

typedef struct render_colour {
	double r, g, b;
} render_colour;

/* From dark violet at 0 to yellow at 1, in steps that look equal. */
render_colour quern_render_map(double t);
render_colour quern_render_mix(render_colour a, render_colour b, double t);

typedef struct render_range {
	double low, high, step; /* ends of the colour bar, and a round distance between its marks */
	double factor;          /* from SI to the unit shown */
	bool below, above;      /* some values lie beyond: stray ones must not take all the colours */
	bool empty;             /* there are no values, or all are the same: the ends are anything */
	char label[128];        /* "|velocity| (mm/s)" */
} render_range;

render_range quern_render_range_of(const render_frame *, const render_wish *);
/* "1.5 mm/s": a value in a unit with a fitting prefix. */
void quern_render_quantity(char *out, size_t size, double value, const char *unit);
/* The number that stands at the part `share` of the way from the least to the greatest of n, or the next one; sorts them. 0
 * if there are none. */
double quern_render_quantile(double *values, size_t n, double share);
/* The least and greatest that colours stand for lie within it; what is beyond has none. */
#define RENDER_MOST_VALUE 1e150
double quern_render_share(const render_range *, double value); /* into [0, 1] */
double quern_render_round_step(double wanted); /* 1, 2 or 5 times a power of ten, at most `wanted` */

/* ---- render_view.c: where things lie in the picture ---- */

/* Orthographic. In 2-D along -z; in 3-D from the front, the right and above, with the last axis upright. */
typedef struct render_view {
	double right[3], up[3], away[3];
	double low[3], high[3];  /* m, what is shown */
	double left, top, scale; /* m of screen at the upper left corner, pixels per m */
	double width, height;    /* pixels */
	bool fixed;              /* as it was wished */
} render_view;

/* What is wished, or all that moves, without strays: up to 0.2 % (of 50 bodies or more at least one) that would make the
 * picture half as large again. */
render_view quern_render_view_of(const render_frame *, const render_wish *);
void quern_render_view_fit(render_view *, const render_frame *, double most_width, double most_height);
void quern_render_project(
	const render_view *, const double x[3], double out[3]); /* pixels, and m away from the eye */
/* False for what is left out: fixed grains beside what moves. */
bool quern_render_shown(const render_view *, const render_frame *, const render_cloud *, size_t i);

/* ---- render_plane.c, render_space.c: what lies in the picture, with its upper left corner at the origin ---- */

typedef struct render_style {
	const render_frame *frame;
	const render_view *view;
	const render_range *range;
	double line;            /* pixels, a hairline of the page */
	double widest, longest; /* N and the field's unit: what the widest line and the longest arrow stand for */
} render_style;

extern const render_colour quern_render_sand, quern_render_sky, quern_render_grey, quern_render_rose,
	quern_render_ink;
render_colour quern_render_colour_of(const render_style *, const render_cloud *, size_t i);
bool quern_render_has(const render_cloud *, int sort);
void quern_render_plane(cairo_t *, const render_style *);
void quern_render_space(cairo_t *, const render_style *);
/* What `draw` would draw, as an image in the page. */
void quern_render_as_image(cairo_t *, const render_style *, void (*draw)(cairo_t *, const render_style *));
/* Signs of the legend, also used for what they stand for. */
void quern_render_disc(cairo_t *, double x, double y, double radius, render_colour, int sort, double line);
void quern_render_hatch(cairo_t *, double line);
void quern_render_set(cairo_t *, render_colour, double alpha);

/* ---- render_lines.c: chains and arrows, over all else ---- */

/* N that the widest line stands for: 99.5 % of the forces are at most that; 0: there are none. */
double quern_render_widest(const render_frame *);
/* The same of the arrows' lengths. */
double quern_render_longest(const render_frame *);
double quern_render_line_width(const render_style *); /* pixels, of the widest line */
double quern_render_arrow_length(const render_style *);
void quern_render_chains(cairo_t *, const render_style *);
void quern_render_arrows(cairo_t *, const render_style *);
void quern_render_arrow(cairo_t *, double x, double y, double dx, double dy, double line);

/* ---- render_page.c: the picture with its heading, colour bar, scale and legend ---- */

typedef enum { RENDER_PNG, RENDER_SVG, RENDER_PDF } render_form;

/* An image for RENDER_PNG; else a page whose bytes go to `write`, the last of them as the surface is finished. `width`: pixels. */
cairo_surface_t *quern_render_page(
	const render_frame *, const render_wish *, int width, render_form, cairo_write_func_t write, void *to);
