/* SPDX-License-Identifier: MIT */
/* section - a section of a scene: its solver, and the plugins in the solver's slots */
#pragma once
#include "scene.h"

/* Loads the section's solver, reads its parameters, fills its slots, and lets it publish. On a fault that hides the
 * rest of the section, s->n_sections does not grow. */
void quern_section_read(quern_scene *, const quern_plugin_file *solver, const quern_entry *);

/* Fills one slot from its node (NULL: the slot's default). */
void quern_slot_fill(quern_scene *, quern_slot_use *, quern_node *, quern_mark);
void quern_slot_finish(quern_slot_use *);
void quern_instance_destroy(quern_instance *);
