/* SPDX-License-Identifier: MIT */
#include "edits.h"
#include <stdlib.h>
#include <string.h>

enum { MOST_OBJECTS = 512, MOST_EDITS = 8, MOST_BYTES = 1 << 22, USER_BLOCK = 512 };
static struct {
	char group[24], name[40]; /* group "" is the root */
	bool attribute;
} object[MOST_OBJECTS];
static int n_objects;
static char *image;
static size_t image_size;
static bool is_sealed;

/* ---- what there is to edit ---- */

static void note(const char *group, const char *name, bool attribute) {
	if (n_objects == MOST_OBJECTS) abort();
	snprintf(object[n_objects].group, sizeof object->group, "%s", group);
	snprintf(object[n_objects].name, sizeof object->name, "%s", name);
	object[n_objects++].attribute = attribute;
}

static herr_t note_attribute(hid_t at, const char *name, const H5A_info_t *info, void *group) {
	(void)at, (void)info;
	note(group, name, true);
	return 0;
}

static herr_t note_link(hid_t at, const char *name, const H5L_info_t *info, void *group) {
	(void)info;
	const hid_t below = H5Oopen(at, name, H5P_DEFAULT);
	char copy[40];
	snprintf(copy, sizeof copy, "%s", name);
	if (H5Iget_type(below) == H5I_DATASET) note(group, name, false);
	else {
		H5Aiterate2(below, H5_INDEX_NAME, H5_ITER_INC, NULL, note_attribute, copy);
		H5Literate(below, H5_INDEX_NAME, H5_ITER_INC, NULL, note_link, copy);
	}
	H5Oclose(below);
	return 0;
}

static hid_t open_image(void) {
	const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
	H5Pset_fapl_core(access, 1 << 16, 0);
	H5Pset_file_image(access, image, image_size);
	const hid_t file = H5Fopen("memory", H5F_ACC_RDWR, access);
	H5Pclose(access);
	if (file < 0) abort();
	return file;
}

void edits_begin(const char *path, bool sealed) {
	FILE *f = fopen(path, "rb");
	is_sealed = sealed;
	image = malloc(MOST_BYTES);
	image_size = f && image ? fread(image, 1, MOST_BYTES, f) : 0;
	if (f) fclose(f);
	if (!image_size || image_size == MOST_BYTES) abort();
	const hid_t h = open_image();
	char root[1] = "";
	H5Aiterate2(h, H5_INDEX_NAME, H5_ITER_INC, NULL, note_attribute, root);
	H5Literate(h, H5_INDEX_NAME, H5_ITER_INC, NULL, note_link, root);
	H5Fclose(h);
}

/* ---- edits ---- */

typedef struct {
	const uint8_t *at, *end;
} bytes;

static uint64_t take(bytes *b, int n) {
	uint64_t value = 0;
	for (int i = 0; i < n && b->at < b->end; i++) value |= (uint64_t)*b->at++ << 8 * i;
	return value;
}

static hid_t some_type(uint64_t which) {
	const hid_t types[6] = { H5T_NATIVE_INT32, H5T_NATIVE_DOUBLE, H5T_NATIVE_INT64, H5T_NATIVE_UINT8,
		H5T_NATIVE_FLOAT, H5T_NATIVE_UINT32 };
	return types[which % 6];
}

static void edit_attribute(hid_t at, const char *name, bytes *b) {
	const uint64_t what = take(b, 1) % 3;
	const hid_t old = H5Aopen(at, name, H5P_DEFAULT), is = H5Aget_type(old), space = H5Aget_space(old);
	uint64_t value[32] = { take(b, 8) };
	if (what == 0 && H5Tget_size(is) <= sizeof value) H5Awrite(old, is, value);
	H5Aclose(old);
	if (what) H5Adelete(at, name);
	if (what == 2) {
		const hsize_t n = take(b, 1) % 4;
		const hid_t type = some_type(take(b, 1)), list = H5Screate_simple(1, &n, NULL);
		const hid_t now = H5Acreate2(at, name, type, list, H5P_DEFAULT, H5P_DEFAULT);
		H5Awrite(now, type, value);
		H5Aclose(now);
		H5Sclose(list);
	}
	H5Tclose(is);
	H5Sclose(space);
}

static void edit_dataset(hid_t at, const char *name, bytes *b) {
	const uint64_t what = take(b, 1) % 3;
	const hid_t old = H5Dopen2(at, name, H5P_DEFAULT), is = H5Dget_type(old), space = H5Dget_space(old);
	const hssize_t n = H5Sget_simple_extent_npoints(space);
	const size_t size = H5Tget_size(is);
	char *data = calloc((size_t)n + 1, size);
	if (n) H5Dread(old, is, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
	const uint64_t place = take(b, 2), value = take(b, 8);
	if (what == 0 && n) {
		memcpy(data + place % (uint64_t)n * size, &value, size < 8 ? size : 8);
		H5Dwrite(old, is, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
	}
	H5Dclose(old);
	if (what) H5Ldelete(at, name, H5P_DEFAULT);
	if (what == 2) { /* another type, another size, another rank */
		const hsize_t extent[3] = { place % 1000, take(b, 1) % 4, 1 };
		const hid_t list = H5Screate_simple((int)(1 + take(b, 1) % 3), extent, NULL);
		const hid_t now = H5Dcreate2(
			at, name, value & 1 ? is : some_type(value >> 1), list, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
		char *zeros = calloc(4000, 16); /* what was never written is refused by its size */
		H5Dwrite(now, some_type(0), H5S_ALL, H5S_ALL, H5P_DEFAULT, zeros);
		free(zeros);
		H5Dclose(now);
		H5Sclose(list);
	}
	free(data);
	H5Tclose(is);
	H5Sclose(space);
}

static void edit(hid_t file, bytes *b) {
	for (int k = 0; k < MOST_EDITS && b->at < b->end; k++) {
		const int i = (int)(take(b, 2) % (uint64_t)n_objects);
		const hid_t at = *object[i].group ? H5Gopen2(file, object[i].group, H5P_DEFAULT) : file;
		const bool there = object[i].attribute ? H5Aexists(at, object[i].name) > 0
											   : H5Lexists(at, object[i].name, H5P_DEFAULT) > 0;
		if (there && object[i].attribute) edit_attribute(at, object[i].name, b);
		else if (there) edit_dataset(at, object[i].name, b);
		if (at != file) H5Gclose(at);
	}
}

void edits_make(const char *path, const uint8_t *data, size_t size) {
	bytes b = { data, data + size };
	char why[256];
	const hid_t file = open_image();
	edit(file, &b);
	H5Fflush(file, H5F_SCOPE_GLOBAL);
	const size_t front = is_sealed ? USER_BLOCK : 0;
	const ssize_t n = H5Fget_file_image(file, NULL, 0);
	char *edited = n > 0 ? malloc(front + (size_t)n) : NULL;
	if (!edited || H5Fget_file_image(file, edited + front, (size_t)n) != n) abort();
	H5Fclose(file);
	if (is_sealed) quern_h5_seal(edited, front + (size_t)n);
	if (!quern_save_bytes(path, edited, front + (size_t)n, why)) abort();
	free(edited);
}
