/* SPDX-License-Identifier: MIT */
/* run_folder - the folder of a run: who holds it, what of it a run has left, and the scene that lies in it */
#pragma once
#include "run.h"
#include "text.h"

typedef struct quern_run_folder {
	const char *path;
	int lock;  /* -1: not held */
	bool made; /* it was not there before */
} quern_run_folder;

/* Makes the folder and holds it until it is given back, or until the process is gone, however it ends. False with one
 * sentence if another run holds it or it cannot be made. `path` must outlive the folder. */
bool quern_run_folder_take(quern_run_folder *, const char *path, quern_text *why);
/* A folder that was made for nothing goes again. */
void quern_run_folder_give_back(quern_run_folder *);

/* Whether a run of this scene may begin here: false with one sentence if there is what a run has left and `force` is not
 * given, or if the scene or one of its files would be replaced, or a scene that somebody has written. */
bool quern_run_folder_is_free(const quern_run_folder *, const quern_scene *, bool force, quern_text *why);
/* Whether a run may begin where one was stopped before its first checkpoint. */
bool quern_run_folder_is_begun(const quern_run_folder *, quern_text *why);
/* Removes what runs leave and nothing else; the scene and its files stay, and with the folder's own scene.yaml the text that
 * it was made from. */
void quern_run_folder_clear(const quern_run_folder *, const quern_scene *);
/* Removes frames from this number on, with their views. */
void quern_run_folder_trim(const quern_run_folder *, int64_t frames);

/* Writes scene.yaml, the scene with every default, with the files that it names in files/; input.yaml, the scene as it was
 * written; and makes frames/. A scene.yaml that no run has written, or that was changed, stays as it is, and so does what
 * the scene was read from. */
bool quern_run_folder_begin(const quern_run_folder *, const quern_run *, char why[256]);
