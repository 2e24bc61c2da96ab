/* SPDX-License-Identifier: MIT */
/* file - bytes on the disk: files that are whole or absent, and hashes that tell one content from another */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* FNV-1a: finds accidents, not forgers. */
uint64_t quern_hash(const void *data, size_t length);
/* Goes on with a hash, so that parts give the hash of the whole; begin with quern_hash("", 0). */
uint64_t quern_hash_more(uint64_t hash, const void *data, size_t length);
/* A regular file, to be read; -1, with errno set: a pipe or a device would wait for ever, or never end. */
int quern_open_file(const char *path);
/* Of a regular file from byte `from` on; false, with errno set, if it cannot be read. */
bool quern_hash_file(const char *path, size_t from, uint64_t *hash);

/* Written aside, flushed, renamed: after a crash or on a full disk there is the new file or the old one, whole. */
bool quern_save_bytes(const char *path, const void *data, size_t size, char why[256]);
/* The same of another file's bytes. */
bool quern_save_copy(const char *path, const char *from, char why[256]);
