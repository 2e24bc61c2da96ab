/* SPDX-License-Identifier: MIT */
/* state - sets and their fields in a file: what checkpoints and settled states have in common */
#pragma once
#include "h5.h"
#include "run.h"
#include "text.h"

/* Which fields are meant. */
typedef bool (*quern_state_picks)(const quern_field *);

/* NULL, or what is wrong with what a field holds: no run could go on from it. */
const char *quern_state_fault(const quern_run *, const quern_field *);

/* What a component is in a file. */
hid_t quern_state_type(const quern_field *);
/* Vectors have three columns and tensors six or nine in both dimensions, so that every tool reads them. Returns how
 * many columns, and in `from` which component fills each; -1 is zero. */
int quern_state_columns(uint8_t shape, uint32_t dim, int from[9]);

/* Writes a set as a group: its size, its partition, and the fields that are picked. */
void quern_state_write(quern_h5 *, const quern_run *, int set, quern_state_picks);

/* A set as a file holds it. */
typedef struct quern_state_group {
	hid_t at; /* -1: none */
	uint32_t n;
	int64_t next_id;
} quern_state_group;

/* Looks whether the file holds a set of a sane size with all fields that are picked; false with a reason. */
bool quern_state_find(
	const quern_run *, hid_t file, int set, quern_state_picks, quern_state_group *, quern_text *why);
void quern_state_leave(quern_state_group *);
/* Reads partition, numbering and the fields that are picked into a set that has the group's size already. Takes no memory
 * but for the partition. False with a reason; the run must then not be used. */
bool quern_state_read(quern_run *, const quern_state_group *, int set, quern_state_picks, quern_text *why);
