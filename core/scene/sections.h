/* SPDX-License-Identifier: MIT */
/* sections - which sections of a scene take part, by which solver, and in which order they are read: all of it from what
 * solvers say of themselves */
#pragma once
#include "scene.h"

/* Whether a solver has a section of its own that is no key of the scene's. */
bool quern_section_is_claimed(const quern_section_of *);

/* Keys of the scene's root that are sections, or lists that rows do not describe, or observers; NULL-terminated, free() it. */
const char **quern_sections_known(quern_scene *, const quern_node *root);

/* Finds the solvers of all sections that `model` keeps, and reads the sections, each after those that it builds on. */
void quern_sections_read(quern_scene *, quern_node *root);
