/* SPDX-License-Identifier: MIT */
/* start_file - another run's state as a file holds it: a checkpoint, or a frame, which has what its scene showed */
#pragma once
#include "h5.h"
#include "state.h"

typedef struct quern_start_file {
	quern_h5 h5;
	bool frame;
	int64_t dimension;
	double time;        /* s */
	char sections[400]; /* of a frame: sections of its scene, each between blanks; "": it does not say */
	quern_tree
		*scene; /* of the run, resolved; of a frame the one beside it: without a root where there is none */
} quern_start_file;

/* A file of one moment, whatever takes its place: a run that is still at work replaces its checkpoint. */
typedef struct quern_held {
	const char *path; /* the caller's */
	int file;         /* its bytes; -1: it cannot be read */
	hid_t h5;         /* a checkpoint whose checksum holds; -1: it is none */
} quern_held;
quern_held quern_start_file_hold(const char *path); /* NULL: nothing */
void quern_start_file_let_go(quern_held *);
char *quern_start_file_name(const quern_held *); /* by which its bytes are read; malloc'ed */

/* False with a reason; finish it in any case. `held`: what is held of it; NULL: it is read from `path`. `sets`: of a frame
 * those that a child reads first, since it has no checksum; NULL-terminated, as the file calls them. */
bool quern_start_file_open(
	quern_start_file *, const char *path, const quern_held *held, const char *const *sets, quern_text *why);
void quern_start_file_finish(quern_start_file *);

/* The group of a set and how many entries it has; below 0 if there is none, or none that makes sense. */
hid_t quern_start_file_set(const quern_start_file *, const quern_set_store *, uint32_t *n, int64_t *next_id);
/* Whether a field stands in its set's group. */
bool quern_start_file_has(const quern_start_file *, hid_t group, const quern_field *);
/* Whether it stands there with n entries, as far as can be told without reading them. */
bool quern_start_file_holds(const quern_start_file *, hid_t group, const quern_field *, uint32_t n);
/* Reads n entries of it into its columns, in the order of places; false if it is of another type or size. */
bool quern_start_file_read(
	const quern_start_file *, hid_t group, const quern_store *, const quern_field *, uint32_t n);
/* Whether a plugin took part in the run, or made the field of the frame. */
bool quern_start_file_knows(const quern_start_file *, hid_t group, const quern_field *, const char *plugin);
