/* SPDX-License-Identifier: MIT */
/* run_episodes - a run through the `stages` of its scene: each has a plan of its own, and the state goes from one to the next */
#pragma once
#include "run.h"

/* Makes the plans; what an episode has otherwise than the scene, but for values, is a fault of the scene. */
void quern_run_plan_episodes(quern_run *);
void quern_run_finish_episodes(quern_run *);

/* s, when the present episode ends: infinite for the last one. */
double quern_run_episode_end(const quern_run *, double time);
/* Whether that time is where one episode gives way to another. */
bool quern_run_is_seam(const quern_run *, double time);
/* Before the first step of an interval that begins at `time`. */
void quern_run_enter_episode(quern_run *, double time);
/* Once a checkpoint's clock is there. */
void quern_run_find_episode(quern_run *);
