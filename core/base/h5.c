/* SPDX-License-Identifier: MIT */
#include "h5.h"
#include "platform.h"
#include "text.h"
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Of a file with a checksum: what stands in its first 512 bytes. */
enum { USER_BLOCK = 512 };
/* Bytes by which a file in memory grows, and what is too much to lie among other memory. */
enum { PIECE = 1 << 18, APART = 1 << 24 };
static const char magic[16] = "quern checksum\n";

void quern_h5_begin(void) {
	const int most = 1 << 16, of_a_kind = most / 4; /* unlimited, they hold a megabyte after the first file */
	H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
	H5set_free_list_limits(most, of_a_kind, most, of_a_kind, most, of_a_kind);
}

/* ---- the memory that a file is built in ----
 * HDF5 grows it through these functions and gives it back when the file is closed. Then it is kept, not freed, so that
 * a file in memory never exists twice. */

static void *image_malloc(size_t size, H5FD_file_image_op_t op, void *h) {
	(void)op, (void)h;
	return malloc(size);
}

static void *image_copy(void *to, const void *from, size_t size, H5FD_file_image_op_t op, void *h) {
	(void)op, (void)h;
	return memcpy(to, from, size);
}

/* What is more than one piece gets more than is asked for, which costs nothing until it is written: so it lies in pages of its own. Grown piece by
 * piece among other memory, it would leave a hole of a megabyte or two there. */
static void *image_realloc(void *image, size_t size, H5FD_file_image_op_t op, void *owner) {
	quern_h5 *h = owner;
	(void)op;
	if (image && size <= h->capacity) return image;
	size_t given = size;
	if (size > PIECE && size < SIZE_MAX / 2) given = size < APART ? APART : size + size / 2;
	void *grown = realloc(image, given);
	if (!grown) grown = realloc(image, given = size); /* where not even an address is free of charge */
	if (grown) h->capacity = given;
	return grown;
}

static herr_t image_free(void *image, H5FD_file_image_op_t op, void *h) {
	if (op == H5FD_FILE_IMAGE_OP_FILE_CLOSE) ((quern_h5 *)h)->image = image;
	else free(image);
	return 0;
}

static void *same_owner(void *h) { return h; }
static herr_t keep_owner(void *h) {
	(void)h;
	return 0;
}

/* Two runs that do the same write the same bytes: HDF5 shall not note when an object was made. */
static hid_t without_times(hid_t class) {
	const hid_t create = H5Pcreate(class);
	H5Pset_obj_track_times(create, false);
	return create;
}

bool quern_h5_create(quern_h5 *h, bool compress, size_t user_block) {
	*h = (quern_h5) { .compress = compress, .user_block = user_block };
	H5FD_file_image_callbacks_t own = { image_malloc, image_copy, image_realloc, image_free, same_owner,
		keep_owner, h };
	const hid_t access = H5Pcreate(H5P_FILE_ACCESS), create = without_times(H5P_FILE_CREATE);
	H5Pset_fapl_core(access, PIECE, 0);
	H5Pset_file_image_callbacks(access, &own);
	if (user_block) H5Pset_userblock(create, user_block);
	/* of a file of this name, were there one, HDF5 would read all before it makes its own */
	h->file = H5Fcreate("/dev/null/memory", H5F_ACC_TRUNC, create, access);
	H5Pclose(access);
	H5Pclose(create);
	h->failed = h->file < 0;
	return !h->failed;
}

static void discard(quern_h5 *h) {
	if (h->file >= 0) H5Fclose(h->file);
	h->file = -1;
	free(h->image);
	h->image = NULL;
}

void quern_h5_seal(void *image, size_t size) {
	memset(image, 0, USER_BLOCK);
	const uint64_t sum = quern_hash((char *)image + USER_BLOCK, size - USER_BLOCK);
	memcpy(image, magic, sizeof magic);
	memcpy((char *)image + sizeof magic, &sum, sizeof sum);
}

/* How many bytes of the memory are the file: HDF5 counts without the user block, and takes more than it needs. */
static size_t close_image(quern_h5 *h) {
	ssize_t n = -1;
	if (!h->failed && H5Fflush(h->file, H5F_SCOPE_GLOBAL) >= 0) n = H5Fget_file_image(h->file, NULL, 0);
	if (H5Fclose(h->file) < 0) n = -1;
	h->file = -1;
	const size_t size = n > 0 ? h->user_block + (size_t)n : 0;
	return h->image && size <= h->capacity ? size : 0;
}

bool quern_h5_save(quern_h5 *h, const char *path, char why[256]) {
	const size_t size = h->file >= 0 ? close_image(h) : 0;
	bool good = size > 0;
	if (!good) snprintf(why, 256, "%.180s cannot be made: out of memory, or HDF5 refuses", path);
	if (good && h->user_block) quern_h5_seal(h->image, size);
	good = good && quern_save_bytes(path, h->image, size, why);
	discard(h);
	if (h->bytes >> 20) quern_platform_trim(); /* few leave little */
	return good;
}

/* ---- writing ---- */

hid_t quern_h5_group(quern_h5 *h, hid_t parent, const char *name) {
	const hid_t create = without_times(H5P_GROUP_CREATE);
	const hid_t group = H5Gcreate2(parent, name, H5P_DEFAULT, create, H5P_DEFAULT);
	H5Pclose(create);
	h->failed = h->failed || group < 0;
	return group;
}

/* So many rows are a chunk of the file: half a megabyte of doubles or less. */
static size_t rows_at_once(size_t columns) {
	size_t rows = 65536;
	while (rows * columns > 65536) rows /= 2;
	return rows;
}

static hid_t new_set(quern_h5 *h, hid_t group, const char *name, hid_t type, size_t rows, size_t columns) {
	const int rank = columns > 1 ? 2 : 1;
	const size_t most = rows_at_once(columns);
	const hsize_t size[2] = { rows, columns }, chunk[2] = { rows < most ? rows : most, columns };
	const hid_t space = H5Screate_simple(rank, size, NULL), create = without_times(H5P_DATASET_CREATE);
	h->bytes += rows * columns * H5Tget_size(type);
	if (h->compress && rows > 64) {
		H5Pset_chunk(create, rank, chunk);
		H5Pset_shuffle(create);
		H5Pset_deflate(create, 1);
		H5Pset_fletcher32(create);
	}
	const hid_t set = H5Dcreate2(group, name, type, space, H5P_DEFAULT, create, H5P_DEFAULT);
	H5Pclose(create);
	H5Sclose(space);
	return set;
}

void quern_h5_put(
	quern_h5 *h, hid_t group, const char *name, hid_t type, size_t rows, size_t columns, const void *data) {
	const hid_t set = new_set(h, group, name, type, rows, columns);
	if (set < 0 || (rows && H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0)) h->failed = true;
	if (set >= 0) H5Dclose(set);
}

static bool write_piece(hid_t set, hid_t type, size_t first, size_t rows, size_t columns, const void *piece) {
	const int rank = columns > 1 ? 2 : 1;
	const hsize_t from[2] = { first, 0 }, size[2] = { rows, columns };
	const hid_t space = H5Dget_space(set), memory = H5Screate_simple(rank, size, NULL);
	const bool good = H5Sselect_hyperslab(space, H5S_SELECT_SET, from, NULL, size, NULL) >= 0 &&
					  H5Dwrite(set, type, memory, space, H5P_DEFAULT, piece) >= 0;
	H5Sclose(memory);
	H5Sclose(space);
	return good;
}

hid_t quern_h5_write(quern_h5 *h, hid_t group, const char *name, hid_t type, size_t rows, size_t columns,
	quern_h5_make make, const void *what) {
	const hid_t set = new_set(h, group, name, type, rows, columns);
	const size_t most = rows_at_once(columns), once = rows < most ? rows : most;
	void *piece = quern_take(once * columns, H5Tget_size(type));
	h->failed = h->failed || set < 0;
	for (size_t first = 0; first < rows && !h->failed; first += once) {
		const size_t n = rows - first < once ? rows - first : once;
		make(what, first, n, piece);
		h->failed = !write_piece(set, type, first, n, columns, piece);
	}
	free(piece);
	return set;
}

static void attribute(quern_h5 *h, hid_t object, const char *name, hid_t type, const void *value) {
	const hid_t space = H5Screate(H5S_SCALAR);
	const hid_t a = H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
	if (a < 0 || H5Awrite(a, type, value) < 0) h->failed = true;
	if (a >= 0) H5Aclose(a);
	H5Sclose(space);
}

void quern_h5_text(quern_h5 *h, hid_t object, const char *name, const char *text) {
	const hid_t type = H5Tcopy(H5T_C_S1);
	H5Tset_size(type, strlen(text) + 1);
	attribute(h, object, name, type, text);
	H5Tclose(type);
}

void quern_h5_number(quern_h5 *h, hid_t object, const char *name, double value) {
	attribute(h, object, name, H5T_NATIVE_DOUBLE, &value);
}

void quern_h5_integer(quern_h5 *h, hid_t object, const char *name, int64_t value) {
	attribute(h, object, name, H5T_NATIVE_INT64, &value);
}

/* ---- reading ---- */

/* The checksum is looked at before HDF5 sees a byte: a damaged file is refused here, whatever the damage. */
static bool checksum_holds(const char *path, char why[256]) {
	char head[sizeof magic + sizeof(uint64_t)] = "";
	uint64_t is = 0, wanted = 0;
	const int fd = quern_open_file(path);
	/* what is nobody's checkpoint may be very long */
	const bool sealed =
		fd >= 0 && read(fd, head, sizeof head) == (ssize_t)sizeof head && !memcmp(head, magic, sizeof magic);
	if (fd >= 0) close(fd);
	if (fd < 0 || (sealed && !quern_hash_file(path, USER_BLOCK, &is))) {
		snprintf(why, 256, "it cannot be read: %s", strerror(errno));
		return false;
	}
	memcpy(&wanted, head + sizeof magic, sizeof wanted);
	if (sealed && is == wanted) return true;
	snprintf(why, 256, "it is damaged or not of this program: its checksum does not hold");
	return false;
}

/* Read from the disk as it is asked for, never as a whole into memory. */
bool quern_h5_open(quern_h5 *h, const char *path, char why[256]) {
	*h = (quern_h5) { .file = -1 };
	if (!checksum_holds(path, why)) return false;
	h->file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
	if (h->file < 0) snprintf(why, 256, "it is no HDF5 file");
	return h->file >= 0;
}

void quern_h5_close(quern_h5 *h) {
	if (h->file >= 0) H5Fclose(h->file);
	h->file = -1;
}

hid_t quern_h5_find(hid_t parent, const char *name) {
	if (H5Lexists(parent, name, H5P_DEFAULT) <= 0) return -1;
	return H5Gopen2(parent, name, H5P_DEFAULT);
}

/* Whether as much was stored as the sizes say: a damaged file may claim any, and memory is taken by what it claims. What
 * is packed is at best a thousandth. */
static bool is_stored(hid_t set, const hsize_t size[2]) {
	const hid_t type = H5Dget_type(set);
	const double claimed = (double)size[0] * (double)size[1] * (double)H5Tget_size(type);
	H5Tclose(type);
	return claimed <= 1100.0 * (double)H5Dget_storage_size(set);
}

static hid_t open_set(hid_t group, const char *name, size_t *rows, size_t *columns) {
	hsize_t size[2] = { 0, 1 };
	if (group < 0 || H5Lexists(group, name, H5P_DEFAULT) <= 0) return -1;
	const hid_t set = H5Dopen2(group, name, H5P_DEFAULT);
	if (set < 0) return -1;
	const hid_t space = H5Dget_space(set);
	const int rank = H5Sget_simple_extent_ndims(space);
	const bool good = (rank == 1 || rank == 2) && H5Sget_simple_extent_dims(space, size, NULL) == rank &&
					  is_stored(set, size);
	H5Sclose(space);
	*rows = size[0];
	*columns = size[1];
	if (good) return set;
	H5Dclose(set);
	return -1;
}

bool quern_h5_read_size(hid_t group, const char *name, size_t *rows, size_t *columns) {
	const hid_t set = open_set(group, name, rows, columns);
	if (set < 0) return false;
	H5Dclose(set);
	return true;
}

bool quern_h5_read(hid_t group, const char *name, hid_t type, size_t rows, size_t columns, void *data) {
	size_t r, c;
	const hid_t set = open_set(group, name, &r, &c);
	if (set < 0) return false;
	const hid_t is = H5Dget_type(set);
	bool good = r == rows && c == columns && H5Tget_class(is) == H5Tget_class(type) &&
				H5Tget_size(is) == H5Tget_size(type);
	if (good && rows) good = H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0;
	H5Tclose(is);
	H5Dclose(set);
	return good;
}

static bool read_attribute(hid_t object, const char *name, hid_t type, void *value) {
	if (H5Aexists(object, name) <= 0) return false;
	const hid_t a = H5Aopen(object, name, H5P_DEFAULT);
	const hid_t space = H5Aget_space(a), is = H5Aget_type(a);
	const bool good = H5Sget_simple_extent_npoints(space) == 1 && H5Tget_class(is) == H5Tget_class(type) &&
					  H5Aread(a, type, value) >= 0;
	H5Tclose(is);
	H5Sclose(space);
	H5Aclose(a);
	return good;
}

bool quern_h5_read_number(hid_t object, const char *name, double *value) {
	return read_attribute(object, name, H5T_NATIVE_DOUBLE, value);
}

bool quern_h5_read_integer(hid_t object, const char *name, int64_t *value) {
	return read_attribute(object, name, H5T_NATIVE_INT64, value);
}

bool quern_h5_read_text(hid_t object, const char *name, char *text, size_t size) {
	const hid_t type = H5Tcopy(H5T_C_S1);
	H5Tset_size(type, size);
	memset(text, 0, size);
	const bool good = read_attribute(object, name, type, text);
	H5Tclose(type);
	text[size - 1] = 0;
	return good;
}
