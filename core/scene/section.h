/* SPDX-License-Identifier: MIT */
/* section - a section of a scene: its solver, and the plugins in the solver's slots */
#pragma once
#include "scene.h"

/* Reads the parameters of the section's solver, fills its slots, and lets it publish. On a fault that hides the rest
 * of the section, s->n_sections does not grow. */
void quern_section_read(quern_scene *, const quern_plugin_file *solver, const quern_entry *);

/* Fills one slot from its node (NULL: the slot's default). */
void quern_slot_fill(quern_scene *, quern_slot_use *, quern_node *, quern_mark);
void quern_slot_finish(quern_slot_use *);
/* Whether a key is one of these rows, or the first part of one. */
bool quern_rows_open(const quern_param *, const char *key);
/* An instance of the same plugin in the same slot, with other parameters; NULL after one sentence if there is no memory. */
quern_instance *quern_instance_again(
	quern_scene *, const quern_instance *, const quern_node *map, quern_mark);
void quern_instance_destroy(quern_instance *);
/* Says that an item takes no such key: it takes those of `own`, those of the slot's plugins, and their names. */
void quern_slot_refuse_key(
	quern_scene *, const quern_slot_use *, const quern_param *own, const char *path, const quern_entry *);

/* ---- override.c ---- */
/* Gives the plugins of a slot their variants, by what other slots and lists of the section say to them. */
void quern_slot_override(quern_scene *, const quern_section *, quern_slot_use *);
