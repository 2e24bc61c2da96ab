/* SPDX-License-Identifier: MIT */
/* edits - a good file of HDF5 with some of its values, sizes and types changed
 *
 * The fuzzer's bytes are a list of edits: which attribute or dataset, what to do, how. HDF5 itself is not the target:
 * damage of the bytes of a checkpoint is caught by its checksum, and of a frame by a child that reads it first. */
#pragma once
#include <h5.h>

/* Takes the file as the one to edit; `sealed`: with a checksum in front. Ends the program if it cannot. */
void edits_begin(const char *path, bool sealed);
/* Writes an edited copy to `path`, with its checksum put right. */
void edits_make(const char *path, const uint8_t *data, size_t size);
