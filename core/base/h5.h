/* SPDX-License-Identifier: MIT */
/* h5 - HDF5 files that are whole or absent: built in memory, written aside, flushed, renamed */
#pragma once
#include "file.h"
#include <hdf5.h>

typedef struct quern_h5 {
	hid_t file;
	bool compress, failed;
	size_t user_block; /* bytes before the HDF5 data, 0 or 512 */
	void *image;       /* the file in memory, once HDF5 has let go of it */
	size_t capacity;
	size_t bytes; /* of all sets, before they are compressed */
} quern_h5;

/* Nothing is printed by the library from here on; our own messages name file and cause. And of the memory that it has no use for it
 * keeps little. */
void quern_h5_begin(void);

/* A file in memory, which stays where it is until it is saved or discarded. `user_block`: 0, or 512 bytes in front that
 * hold a checksum of the rest. */
bool quern_h5_create(quern_h5 *, bool compress, size_t user_block);
/* Puts it on the disk under `path`, or leaves there what was there before; on a fault `why` says what went wrong.
 * Ends the file in memory in any case. Takes no more memory than the file itself. */
bool quern_h5_save(quern_h5 *, const char *path, char why[256]);
/* Writes the checksum into the first 512 bytes of a file's image. */
void quern_h5_seal(void *image, size_t size);

/* Makes the rows from `first` on of a table, `n` of them one after the other. */
typedef void (*quern_h5_make)(const void *what, size_t first, size_t n, void *out);

/* rows x columns numbers; columns 1 makes a list. The faults of all writes are collected in `failed`. Rows are made a
 * few at a time, so that the table is never in memory as a whole. */
hid_t quern_h5_write(quern_h5 *, hid_t group, const char *name, hid_t type, size_t rows, size_t columns,
	quern_h5_make make, const void *what);
/* The same for rows that are there already, and get no attributes. */
void quern_h5_put(
	quern_h5 *, hid_t group, const char *name, hid_t type, size_t rows, size_t columns, const void *data);
hid_t quern_h5_group(quern_h5 *, hid_t parent, const char *name);
void quern_h5_text(quern_h5 *, hid_t object, const char *name, const char *text);
void quern_h5_number(quern_h5 *, hid_t object, const char *name, double value);
void quern_h5_integer(quern_h5 *, hid_t object, const char *name, int64_t value);

/* Reading: each returns false if the thing is missing or of another type or size. */
bool quern_h5_open(quern_h5 *, const char *path, char why[256]);
void quern_h5_close(quern_h5 *);
bool quern_h5_read_size(hid_t group, const char *name, size_t *rows, size_t *columns);
bool quern_h5_read(hid_t group, const char *name, hid_t type, size_t rows, size_t columns, void *data);
bool quern_h5_read_number(hid_t object, const char *name, double *value);
bool quern_h5_read_integer(hid_t object, const char *name, int64_t *value);
bool quern_h5_read_text(hid_t object, const char *name, char *text, size_t size);
/* Opens a group, or returns a negative number. */
hid_t quern_h5_find(hid_t parent, const char *name);
