#include "h5.h"
#include "scene.h"
#include "text.h"
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Of a file with a checksum: what stands in its first 512 bytes. */
static const char magic[16] = "quern checksum\n";

void quern_h5_quiet(void) { H5Eset_auto2(H5E_DEFAULT, NULL, NULL); }

bool quern_h5_create(quern_h5 *h, bool compress, size_t user_block) {
	*h = (quern_h5) { .compress = compress, .user_block = user_block };
	const hid_t access = H5Pcreate(H5P_FILE_ACCESS), create = H5Pcreate(H5P_FILE_CREATE);
	H5Pset_fapl_core(access, 1 << 20, 0);
	if (user_block) H5Pset_userblock(create, user_block);
	h->file = H5Fcreate("memory", H5F_ACC_TRUNC, create, access);
	H5Pclose(access);
	H5Pclose(create);
	h->failed = h->file < 0;
	return !h->failed;
}

void quern_h5_discard(quern_h5 *h) {
	if (h->file >= 0) H5Fclose(h->file);
	h->file = -1;
}

/* ---- bytes to disk ---- */

static bool write_all(int fd, const char *data, size_t size) {
	while (size) {
		const ssize_t n = write(fd, data, size);
		if (n < 0 && errno == EINTR) continue;
		if (n <= 0) return false;
		data += n;
		size -= (size_t)n;
	}
	return true;
}

/* The new name must survive a crash too, so its folder is flushed as well. */
static void flush_folder(const char *path) {
	char *folder = quern_copy(path), *slash = strrchr(folder, '/');
	if (slash) *slash = 0;
	const int fd = open(slash ? folder : ".", O_RDONLY | O_DIRECTORY);
	if (fd >= 0) {
		fsync(fd);
		close(fd);
	}
	free(folder);
}

/* A device or a pipe gets the bytes itself: a file renamed onto it would take its place. */
static bool save_in_place(const char *path, const void *data, size_t size) {
	const int fd = open(path, O_WRONLY);
	const bool good = fd >= 0 && write_all(fd, data, size);
	const int error = errno;
	if (fd >= 0 && close(fd) && good) return false;
	errno = error;
	return good;
}

static bool is_no_file(const char *path) {
	struct stat is;
	return !stat(path, &is) && !S_ISREG(is.st_mode);
}

bool quern_save_bytes(const char *path, const void *data, size_t size, char why[256]) {
	if (is_no_file(path)) {
		const bool good = save_in_place(path, data, size);
		if (!good) snprintf(why, 256, "%.180s cannot be written: %s", path, strerror(errno));
		return good;
	}
	char *aside = quern_format("%s.part", path);
	const int fd = open(aside, O_WRONLY | O_CREAT | O_TRUNC, 0666);
	bool good = fd >= 0 && write_all(fd, data, size) && !fsync(fd);
	int error = good ? 0 : errno;
	if (fd >= 0 && close(fd) && good) good = false, error = errno;
	if (good && rename(aside, path)) good = false, error = errno;
	if (good) flush_folder(path);
	else {
		unlink(aside);
		snprintf(why, 256, "%.180s cannot be written: %s", path, strerror(error));
	}
	free(aside);
	return good;
}

/* HDF5 gives the image without the user block, which goes in front of it. */
static char *take_image(quern_h5 *h, size_t *size) {
	ssize_t n = -1;
	if (!h->failed && H5Fflush(h->file, H5F_SCOPE_GLOBAL) >= 0) n = H5Fget_file_image(h->file, NULL, 0);
	char *image = n > 0 ? calloc(1, h->user_block + (size_t)n) : NULL;
	if (image && H5Fget_file_image(h->file, image + h->user_block, (size_t)n) != n) {
		free(image);
		image = NULL;
	}
	*size = image ? h->user_block + (size_t)n : 0;
	quern_h5_discard(h);
	return image;
}

bool quern_h5_save(quern_h5 *h, const char *path, char why[256]) {
	size_t size;
	char *image = take_image(h, &size);
	if (!image) {
		snprintf(why, 256, "%.180s cannot be made: out of memory, or HDF5 refuses", path);
		return false;
	}
	if (h->user_block) {
		const uint64_t sum = quern_hash(image + h->user_block, size - h->user_block);
		memcpy(image, magic, sizeof magic);
		memcpy(image + sizeof magic, &sum, sizeof sum);
	}
	const bool good = quern_save_bytes(path, image, size, why);
	free(image);
	return good;
}

/* ---- writing ---- */

hid_t quern_h5_group(quern_h5 *h, hid_t parent, const char *name) {
	const hid_t group = H5Gcreate2(parent, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
	h->failed = h->failed || group < 0;
	return group;
}

hid_t quern_h5_write(
	quern_h5 *h, hid_t group, const char *name, hid_t type, size_t rows, size_t columns, const void *data) {
	const int rank = columns > 1 ? 2 : 1;
	const hsize_t size[2] = { rows, columns }, chunk[2] = { rows < 65536 ? rows : 65536, columns };
	const hid_t space = H5Screate_simple(rank, size, NULL), create = H5Pcreate(H5P_DATASET_CREATE);
	if (h->compress && rows > 64) {
		H5Pset_chunk(create, rank, chunk);
		H5Pset_shuffle(create);
		H5Pset_deflate(create, 1);
		H5Pset_fletcher32(create);
	}
	const hid_t set = H5Dcreate2(group, name, type, space, H5P_DEFAULT, create, H5P_DEFAULT);
	if (set < 0 || (rows && H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0)) h->failed = true;
	H5Pclose(create);
	H5Sclose(space);
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

static char *read_bytes(const char *path, size_t *size, char why[256]) {
	struct stat s;
	const int fd = open(path, O_RDONLY);
	char *data = NULL;
	if (fd < 0 || fstat(fd, &s) || !S_ISREG(s.st_mode)) {
		snprintf(why, 256, "it cannot be opened: %s", strerror(errno));
		if (fd >= 0) close(fd);
		return NULL;
	}
	*size = (size_t)s.st_size;
	data = malloc(*size + 1);
	size_t n = 0;
	while (data && n < *size) {
		const ssize_t got = read(fd, data + n, *size - n);
		if (got <= 0) break;
		n += (size_t)got;
	}
	close(fd);
	if (n == *size && data) return data;
	snprintf(why, 256, "it cannot be read");
	free(data);
	return NULL;
}

/* The checksum is looked at before HDF5 sees a byte: a damaged file is refused here, whatever the damage. */
bool quern_h5_open(quern_h5 *h, const char *path, char why[256]) {
	size_t size = 0;
	*h = (quern_h5) { .file = -1 };
	char *image = read_bytes(path, &size, why);
	if (!image) return false;
	uint64_t sum = 0;
	const bool sealed = size > 512 && !memcmp(image, magic, sizeof magic);
	if (sealed) memcpy(&sum, image + sizeof magic, sizeof sum);
	if (!sealed || quern_hash(image + 512, size - 512) != sum) {
		snprintf(why, 256, "it is damaged or not of this program: its checksum does not hold");
		free(image);
		return false;
	}
	const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
	H5Pset_fapl_core(access, 1 << 20, 0);
	H5Pset_file_image(access, image, size);
	h->file = H5Fopen("memory", H5F_ACC_RDONLY, access);
	H5Pclose(access);
	free(image);
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

static hid_t open_set(hid_t group, const char *name, size_t *rows, size_t *columns) {
	hsize_t size[2] = { 0, 1 };
	if (group < 0 || H5Lexists(group, name, H5P_DEFAULT) <= 0) return -1;
	const hid_t set = H5Dopen2(group, name, H5P_DEFAULT);
	if (set < 0) return -1;
	const hid_t space = H5Dget_space(set);
	const int rank = H5Sget_simple_extent_ndims(space);
	const bool good = (rank == 1 || rank == 2) && H5Sget_simple_extent_dims(space, size, NULL) == rank;
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
