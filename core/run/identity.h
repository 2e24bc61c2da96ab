/* SPDX-License-Identifier: MIT */
/* identity - what a checkpoint and the run that goes on from it must have in common: the scene, but for what may change,
 * and the plugins */
#pragma once
#include "run.h"
#include "text.h"

/* The resolved scene, with files named by their contents: what is compared. Made at the first call, of the files as they are
 * then; the run's own. */
const char *quern_run_identity(quern_run *);
/* The same as a tree, to destroy. */
quern_node *quern_run_tree(const quern_run *);
/* Of all that results depend on: equal for scenes that differ in title, end, compression, checkpoints and run alone. */
uint64_t quern_run_scene_hash(quern_run *);

/* Keys in which two such texts differ: "time.end was 1, is 2". Those that may change go to `allowed`, a line each, the
 * others to `refused`, the first few of them and how many more there are. False if a text cannot be read. */
bool quern_identity_compare(const char *was, const char *is, quern_text *allowed, quern_text *refused);
/* output.every of such a text; 0 if it has none. */
double quern_identity_every(const char *text);

/* The hash by which the loader's plugin i is known: of its object for any processor, whichever was loaded, so that a run may
 * go on elsewhere; as it was when the run was made, since the file may be another one by now. */
uint64_t quern_run_plugin(const quern_run *, size_t i);
/* Looks at all of them: part of quern_run_create. */
uint64_t *quern_plugin_hashes(const quern_loader *);
