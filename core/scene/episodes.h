/* SPDX-License-Identifier: MIT */
/* episodes - the key `stages` of a scene: intervals of time in which some keys have other values. In the code an episode, since
 * stages are what solvers have. Each is a scene of its own, read and checked before the run begins. */
#pragma once
#include "scene.h"

/* Reads `stages`; faults are reported to the scene, those of an episode's own values too. */
void quern_episodes_read(quern_scene *);
void quern_episodes_finish(quern_scene *);
/* Which one a time belongs to, -1 before the first; where two meet, the later one. */
int64_t quern_episode_at(const quern_scene *, double time);
/* `stages` as a part of the scene that is written out. */
void quern_episodes_write(const quern_scene *, quern_node *root);
