/* SPDX-License-Identifier: MIT */
#include "file.h"
#include "text.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

uint64_t quern_hash_more(uint64_t hash, const void *data, size_t length) {
	for (size_t i = 0; i < length; i++) hash = (hash ^ ((const unsigned char *)data)[i]) * 1099511628211u;
	return hash;
}

uint64_t quern_hash(const void *data, size_t length) {
	return quern_hash_more(1469598103934665603u, data, length);
}

static bool hash_rest(int fd, uint64_t *hash) {
	unsigned char buffer[65536];
	uint64_t sum = quern_hash("", 0);
	ssize_t n;
	while ((n = read(fd, buffer, sizeof buffer)) != 0) {
		if (n < 0 && errno == EINTR) continue;
		if (n < 0) return false;
		sum = quern_hash_more(sum, buffer, (size_t)n);
	}
	*hash = sum;
	return true;
}

int quern_open_file(const char *path) {
	struct stat is = { 0 };
	const int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
	if (fd < 0) return -1;
	if (!fstat(fd, &is) && S_ISREG(is.st_mode)) return fd;
	close(fd);
	errno = S_ISDIR(is.st_mode) ? EISDIR : EINVAL;
	return -1;
}

bool quern_hash_file(const char *path, size_t from, uint64_t *hash) {
	const int fd = quern_open_file(path);
	if (fd < 0) return false;
	const bool good = lseek(fd, (off_t)from, SEEK_SET) >= 0 && hash_rest(fd, hash);
	const int why = errno;
	close(fd);
	errno = why;
	return good;
}

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
	const int fd = open(slash ? folder : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
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

static int open_aside(const char *path, char **aside) {
	*aside = quern_format("%s.part", path);
	return open(*aside, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
}

/* Ends what was written aside: in the place of `path` if all of it was, gone if not. errno says why. */
static bool put_in_place(int fd, char *aside, const char *path, bool written, char why[256]) {
	bool good = written && !fsync(fd);
	int error = good ? 0 : errno;
	if (fd >= 0 && close(fd) && good) good = false, error = errno;
	if (good && rename(aside, path)) good = false, error = errno;
	if (good) flush_folder(path);
	else {
		if (fd >= 0) unlink(aside);
		snprintf(why, 256, "%.180s cannot be written: %s", path, strerror(error));
	}
	free(aside);
	return good;
}

bool quern_save_bytes(const char *path, const void *data, size_t size, char why[256]) {
	if (is_no_file(path)) {
		const bool good = save_in_place(path, data, size);
		if (!good) snprintf(why, 256, "%.180s cannot be written: %s", path, strerror(errno));
		return good;
	}
	char *aside;
	const int fd = open_aside(path, &aside);
	return put_in_place(fd, aside, path, fd >= 0 && write_all(fd, data, size), why);
}

static bool copy_all(int from, int to) {
	char buffer[65536];
	ssize_t n;
	while ((n = read(from, buffer, sizeof buffer)) != 0) {
		if (n < 0 && errno == EINTR) continue;
		if (n < 0 || !write_all(to, buffer, (size_t)n)) return false;
	}
	return true;
}

bool quern_save_copy(const char *path, const char *from, char why[256]) {
	char *aside;
	const int source = open(from, O_RDONLY | O_CLOEXEC);
	if (source < 0) return snprintf(why, 256, "%.180s cannot be read: %s", from, strerror(errno)), false;
	const int fd = open_aside(path, &aside);
	const bool good = put_in_place(fd, aside, path, fd >= 0 && copy_all(source, fd), why);
	close(source);
	return good;
}
